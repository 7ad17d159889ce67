"""How the right view of a pair lies against the left one; import-light, since run records read it too."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# A scale this small is as likely a bend of the rows that a lens has left. On KITTI vertical disparities grow
# by 0.03 to 0.1 % down the image; lidar says that nothing of it is in the horizontal ones.
_DOUBTFUL_SCALE = 0.0003
# What is wrong in a measured scale. The standard error from the blocks is a fifth of it: they share most of
# their error. Without it the interval covers the roll of half the rendered pairs that were levelled.
_SCALE_ERROR = 0.00025


@dataclass(frozen=True)
class Misalignment:
    """A right view that is moved, turned and enlarged against a level one, about the centre of the image.

    A point of the level view at (x, y) from the centre lies in the given one at
    ``x + stretch x - rotation y`` and ``y + offset + rotation x + scale y + twist x y``.

    Attributes
    ----------
    offset : float
        How much lower the right view lies, pixels.
    rotation : float
        How far it is turned clockwise, radians.
    scale : float
        By which share it is larger.
    twist : float
        How the slope of its rows changes down the image, 1/pixels: what rectification leaves on real rigs. It
        moves rows only, and is no rotation, no scale and no offset.
    """

    offset: float = 0.0
    rotation: float = 0.0
    scale: float = 0.0
    twist: float = 0.0

    @property
    def parts(self) -> tuple[float, float, float, float]:
        """The four numbers; `dataclasses.astuple` takes ten times and more."""
        return self.offset, self.rotation, self.scale, self.twist

    def __add__(self, other: "Misalignment") -> "Misalignment":
        """Both, one after the other, to first order."""
        return Misalignment(*(a + b for a, b in zip(self.parts, other.parts, strict=True)))

    def __sub__(self, other: "Misalignment") -> "Misalignment":
        """Return what is left of this after the other is taken away, to first order."""
        return self + other.times(-1)

    def times(self, factor: float) -> "Misalignment":
        """Return this misalignment, `factor` times as much."""
        return Misalignment(*(factor * each for each in self.parts))

    def resized(self, factor: float) -> "Misalignment":
        """Return this misalignment, of views `factor` times as large."""
        return Misalignment(self.offset * factor, self.rotation, self.scale, self.twist / factor)

    def down(self, x: Any, y: Any) -> Any:
        """Return how far down points (x, y) from the centre are seen, pixels; numbers, or arrays alike."""
        return self.offset + self.rotation * x + (self.scale + self.twist * x) * y

    def shifts(self, height: int, width: int) -> tuple[float, float, float, float]:
        """Return the largest vertical shift of each part in a view of this size, pixels; signed."""
        x, y = width / 2, height / 2
        return self.offset, self.rotation * x, self.scale * y, self.twist * x * y

    def reach(self, height: int, width: int) -> float:
        """Return the largest vertical shift in a view of this size, pixels."""
        offset, rotation, scale, twist = self.shifts(height, width)
        corners = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
        return max(abs(offset + u * rotation + v * scale + uv * twist) for u, v, uv in corners)

    def reach_in_rows(self, height: int, width: int, start: int, stop: int) -> float:
        """Return the largest vertical shift in the middle half of some rows of such a view, pixels."""
        x, rows = width / 4, (start - height / 2, stop - height / 2)
        largest: float = max(abs(self.down(u, v)) for u in (-x, x) for v in rows)
        return largest

    def values(self, height: int, width: int) -> tuple[float, float, float, float]:
        """Return the parts in the units of a result: px, degrees, per cent, and px in the corners."""
        twist = self.shifts(height, width)[3]
        return self.offset, self.rotation_deg, 100 * self.scale, twist

    @staticmethod
    def of_values(values: Sequence[float], height: int, width: int) -> "Misalignment":
        """Return what has these `values` in a view of this size."""
        lower, clockwise, larger, twist = values
        return Misalignment(lower, math.radians(clockwise), larger / 100, twist / (height * width / 4))

    @property
    def stretch(self) -> float:
        """The part of the scale that is believed to be in the columns, too."""
        return self.scale * self._believed

    @property
    def stretch_error(self) -> float:
        """Standard deviation of `stretch`, as it was measured; 0 where nothing was to be corrected."""
        return 0.0 if self == LEVEL else math.hypot(_SCALE_ERROR, _DOUBTFUL_SCALE * self._believed)

    @property
    def _believed(self) -> float:
        return self.scale**2 / (self.scale**2 + _DOUBTFUL_SCALE**2)

    @property
    def rotation_deg(self) -> float:
        """The rotation in degrees."""
        return math.degrees(self.rotation)


LEVEL = Misalignment()
