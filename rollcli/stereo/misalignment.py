"""How the right view of a pair lies against the left one, what of it is in its columns, and what to do.

Import-light.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

_SAME = 2.0**-10  # px: two misalignments that differ by less anywhere are one
_NEAR = 1 / 16  # of the width of a view: the disparity of what is near, where a shift by a tilt is told
# what to do about views that are not level: of several pairs, `rig` tells what none of them does
RECALIBRATE = "recalibrate, or give --align the file that `rig --correction` writes"


@dataclass(frozen=True)
class Misalignment:
    """A right view that is moved, turned and enlarged against a level one, about the centre of the image.

    A point of the level view at (x, y) from the centre lies in the given one at
    ``x + scale x - rotation y`` and ``y + offset + rotation x + scale y + twist x y + tilt d + curve y^2``,
    with d its disparity.

    Attributes
    ----------
    offset : float
        How much lower the right view lies, pixels.
    rotation : float
        How far it is turned clockwise, radians.
    scale : float
        By which share it is larger.
    twist : float
        How the slope of its rows changes down the image, 1/pixels: a yaw, or what rectification leaves.
    tilt : float
        Of the baseline against the rows, radians: how much lower near points lie, px per px of disparity.
    curve : float
        How the scale of its rows changes down the image, 1/pixels: a pitch, or what the lens model leaves.
    """

    offset: float = 0.0
    rotation: float = 0.0
    scale: float = 0.0
    twist: float = 0.0
    tilt: float = 0.0
    curve: float = 0.0

    @property
    def parts(self) -> tuple[float, float, float, float, float, float]:
        """The six numbers; `dataclasses.astuple` takes ten times and more."""
        return self.offset, self.rotation, self.scale, self.twist, self.tilt, self.curve

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
        twist, curve = self.twist / factor, self.curve / factor
        return Misalignment(self.offset * factor, self.rotation, self.scale, twist, self.tilt, curve)

    def rounded(self, height: int, width: int) -> "Misalignment":
        """Return the same, each part to `_SAME` in a view of this size.

        Versions of OpenCV and NumPy differ in the last digits of sums. Here they are dropped: of points that
        differ by a billionth, some are rounded up and some down where a view is read.
        """
        units = Misalignment(1, 1, 1, 1, 1, 1).shifts(height, width)
        parts = zip(self.parts, units, strict=True)
        return Misalignment(*(round(part * unit / _SAME) * _SAME / unit for part, unit in parts))

    def down(self, x: Any, y: Any, near: Any = 0.0) -> Any:
        """Return how far down points (x, y) from the centre are seen, pixels; numbers, or arrays alike.

        `near` are their disparities, pixels.
        """
        straight = self.offset + (self.scale + self.curve * y) * y
        if self.tilt:  # rarely, and `near` may be a whole map
            straight = straight + self.tilt * near
        return straight + (self.rotation + self.twist * y) * x

    def slopes(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return how `down` changes at points (x, y) from the centre, along the rows and down the columns."""
        return self.rotation + self.twist * y, self.scale + self.twist * x + 2 * self.curve * y

    def shifts(self, height: int, width: int) -> tuple[float, float, float, float, float, float]:
        """Return the largest vertical shift of each part in a view of this size, pixels; signed."""
        x, y = width / 2, height / 2
        tilt, curve = self.tilt * width * _NEAR, self.curve * y**2
        return self.offset, self.rotation * x, self.scale * y, self.twist * x * y, tilt, curve

    def reach(self, height: int, width: int) -> float:
        """Return the largest vertical shift in a view of this size, pixels."""
        offset, rotation, scale, twist, tilt, curve = self.shifts(height, width)
        corners = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
        edge = [offset + curve + u * rotation + v * scale + uv * twist for u, v, uv in corners]
        middle = [offset + u * rotation for u in (-1, 1)]
        return max(abs(each + near) for each in edge + middle for near in (0.0, tilt))

    def values(self, height: int, width: int) -> tuple[float, float, float, float]:
        """Return the parts in the units of a result: px, degrees, per cent, and px in the corners."""
        twist = self.shifts(height, width)[3]
        return self.offset, math.degrees(self.rotation), 100 * self.scale, twist

    @staticmethod
    def of_values(values: Sequence[float], height: int, width: int) -> "Misalignment":
        """Return what has these `values` in a view of this size."""
        lower, clockwise, larger, twist = values
        return Misalignment(lower, math.radians(clockwise), larger / 100, twist / (height * width / 4))

    def matrix(
        self, height: int, width: int, larger: float, axis: tuple[float, float], aspect: float = 1.0
    ) -> list[list[float]]:
        """Return the affine map from pixels (u, v, 1) of a level view to the given one, without twist.

        Parameters
        ----------
        height, width : int
            Of the views, px.
        larger : float
            The scale of the columns.
        axis : tuple of float
            What keeps its column, px from the middle: the right view's principal point.
        aspect : float
            fy / fx.
        """
        x, y = (width - 1) / 2, (height - 1) / 2
        across, down = 1 + larger, 1 + self.scale
        turned = self.rotation / aspect**2  # in the columns, where that is in the rows
        return [
            [across, -turned, x - across * x + turned * y + (1 - across) * axis[0] + turned * axis[1]],
            [self.rotation, down, y + self.offset - self.rotation * x - down * y],
            [0.0, 0.0, 1.0],
        ]


LEVEL = Misalignment()


class Tolerance(NamedTuple):
    """What is level enough, beside some standard errors of what was measured.

    Level rendered pairs measure up to 0.03 px, 0.008 degrees, 0.04 % and 0.18 px; empty roads with much noise
    up to 0.08 px, 0.024 degrees, 0.07 % and 0.24 px, with standard errors of a sixth of that.

    Attributes
    ----------
    offset : float
        Pixels; turns a road by 0.03 degrees.
    rotation : float
        Radians (0.014 degrees); turns a road by 0.03 degrees.
    scale : float
        Turns a road by 0.08 degrees.
    twist : float
        Pixels in the corners; turns a road by 0.03 degrees.
    tilt : float
        Pixels at a disparity of a sixteenth of the width.
    curve : float
        Pixels in the first and last row.
    sure : float
        Standard errors. Blocks beside each other err together: they are said to err less than they do.
    """

    offset: float = 0.06
    rotation: float = 0.00025
    scale: float = 0.0003
    twist: float = 0.15
    tilt: float = 0.1
    curve: float = 0.1
    sure: float = 4.0

    def allows(self, lies: Misalignment, errors: Misalignment, shape: tuple[int, ...]) -> bool:
        """Tell whether views of this shape that lie so, with these standard errors, are level enough."""
        *most, sure = self
        units = 1, 1, 1, *Misalignment(twist=1, tilt=1, curve=1).shifts(*shape)[3:]
        parts = zip(lies.parts, errors.parts, most, units, strict=True)
        return all(abs(value) < limit / unit + sure * error for value, error, limit, unit in parts)


TOLERANCE = Tolerance()


@dataclass(frozen=True)
class ColumnSupport:
    """What is believed of how the columns lie: a point (x, y) lies ``x (scale + twist x + pitch y)`` further.

    Attributes
    ----------
    scale : float
        Share.
    twist, pitch : float
        Of a yaw and of a pitch, 1/pixels.
    error : float
        Standard deviation of the slope along the rows that this leaves on the road, px per px.
    pitch_error : float
        What of it the pitch alone leaves.
    """

    scale: float
    twist: float
    pitch: float
    error: float
    pitch_error: float

    def resized(self, factor: float) -> "ColumnSupport":
        """Return the same of views `factor` times as large."""
        return replace(self, twist=self.twist / factor, pitch=self.pitch / factor)


NO_SUPPORT = ColumnSupport(0.0, 0.0, 0.0, 0.0, 0.0)


def advice_of(lower: float, clockwise: float, larger: float, twist: float) -> str:
    """Return what a run says of its rig, in a sentence; empty where nothing is far enough from level.

    Parameters
    ----------
    lower, clockwise, larger, twist : float
        How the right view lies, px, degrees, per cent, and px in the corners.

    Notes
    -----
    An image that is turned clockwise is of a camera that is rolled counter-clockwise, seen from behind.
    """
    parts = []
    if abs(clockwise) >= 0.03:
        way = "counter-clockwise" if clockwise > 0 else "clockwise"
        against = f"against the left, {way} seen from behind"
        parts.append(f"the right camera is rolled by {abs(clockwise):.2f} degrees {against}")
    if abs(lower) >= 0.15:
        parts.append(f"the right image lies {abs(lower):.2f} px {'lower' if lower > 0 else 'higher'}")
    if abs(larger) >= 0.1:
        parts.append(f"the right image is {abs(larger):.2f} % {'larger' if larger > 0 else 'smaller'}")
    if abs(twist) >= 0.5:
        parts.append(f"the right image's rows are skewed by {abs(twist):.1f} px in the corners")
    return f"{', '.join(parts)}: {RECALIBRATE}" if parts else ""
