"""Are the views of a pair level, and if not, how to bring them there.

The misalignment is measured coarse to fine on small views, before the pair is matched: matching small costs
little, and an offset of 8 pixels is one of 2 there. After the match it is measured once more.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from rollcli.imaging.misalignment import LEVEL, Misalignment
from rollcli.imaging.vertical_disparity import Measured, Texture, measure_misalignment
from rollcli.imaging.views import Map, View, Views, resampled, seen_at, shrink_both


@dataclass(frozen=True)
class Tolerance:
    """What is level enough, beside some standard errors of what was measured.

    Level rendered pairs measure up to 0.03 px, 0.008 degrees, 0.04 % and 0.18 px; empty roads with much noise
    up to 0.08 px, 0.024 degrees, 0.07 % and 0.24 px, with standard errors of a sixth of that.
    """

    offset: float = 0.06
    """Pixels; turns a road by 0.03 degrees."""
    rotation: float = 0.00025
    """Radians (0.014 degrees); turns a road by 0.03 degrees."""
    scale: float = 0.0003
    """Turns a road by 0.08 degrees."""
    twist: float = 0.15
    """Pixels in the corners; turns a road by 0.03 degrees."""
    sure: float = 4.0
    """Standard errors. Blocks beside each other err together: they are said to err less than they do."""


TOLERANCE = Tolerance()
_MEASURED_AT = 120_000  # px: larger views are measured at this size, which keeps a fifth of the tolerance
# px, before a pair is matched again: the whole of most views. A level road of fine grain seems 0.06 % larger
# at 120,000 and 0.02 % at its 307,000. More would take 25 bytes for each pixel of a large photo
_CLOSER = 480_000
_FURTHEST = 2.0  # times the last change; further away, two measurements do not tell
_NO_CHANGE = 1e-6  # px^2


def is_level(
    lies: Misalignment, errors: Misalignment, shape: tuple[int, ...], tolerance: Tolerance = TOLERANCE
) -> bool:
    """Tell whether views of this shape that lie so, with these standard errors, are within a tolerance."""
    corner = shape[0] * shape[1] / 4
    limits = (tolerance.offset, tolerance.rotation, tolerance.scale, tolerance.twist / corner)
    parts = zip(lies.parts, errors.parts, limits, strict=True)
    return all(abs(value) < limit + tolerance.sure * error for value, error, limit in parts)


def level(right: View, misalignment: Misalignment) -> View:
    """Resample the right view once, as a level camera would have seen it; rows at the border repeat."""
    if misalignment == LEVEL:
        return right
    height, width = right.shape
    u = np.arange(width, dtype=np.float32)
    v = np.arange(height, dtype=np.float32)[:, None]
    at_u, at_v = seen_at(misalignment, u, v, right.shape)
    levelled = cv2.remap(right, at_u, at_v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return levelled.astype(np.uint8, copy=False)


class Approach:
    """Where to measure next, from where was measured before and what came of it.

    A map that was matched with a misalignment hides a part of it, up to four fifths where the texture is
    slanted. Two measurements tell how much: the next attempt is the fixed point of the line through them
    [Anderson 1965, depth 1].
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape
        self._before: tuple[Misalignment, Misalignment] | None = None

    def next(self, at: Misalignment, measured: Misalignment) -> Misalignment:
        """Return the next start after `measured` was found from `at`."""
        before, self._before = self._before, (measured, measured - at)
        if before is None:
            return measured
        measured_before, left_before = before
        left = measured - at
        change = np.array((left - left_before).shifts(*self._shape))
        share = float(np.dot(left.shifts(*self._shape), change) / (np.dot(change, change) + _NO_CHANGE))
        share = max(-_FURTHEST, min(_FURTHEST, share))
        return measured - (measured - measured_before).times(share)


def size_factor(shape: tuple[int, ...], pixels: int) -> float:
    """Return the factor that shrinks a view of this shape to that many pixels; 1 if it has no more."""
    return max(1.0, math.sqrt(shape[0] * shape[1] / pixels))


class SmallViews:
    """The views of a pair at the size that they are measured at; large ones are shrunk once.

    Attributes
    ----------
    shape : tuple of int
        Of the whole views.
    views : pair of ndarray of uint8, shape (h, w)
        Left and right.
    factor : float
        How many times smaller they are than the whole ones.
    """

    def __init__(self, whole: Views, pixels: int = _MEASURED_AT) -> None:
        self.shape = whole[0].shape
        self.factor = size_factor(self.shape, pixels)
        self.views = shrink_both(whole, self.factor)
        self._every = max(1, round(self.views[0].size / _MEASURED_AT))
        self._whole = whole

    @cached_property
    def closer(self) -> "SmallViews":
        """The same pair at four times as many pixels, as far as it has them."""
        return SmallViews(self._whole, _CLOSER)

    @cached_property
    def _texture(self) -> Texture:
        return Texture.of(self.views)

    def swapped(self) -> "SmallViews":
        """Return the views with left and right exchanged."""
        return SmallViews((self.views[1], self.views[0]))

    def measure(self, disparity: Map, start: Misalignment, rounds: int = 2) -> Measured | None:
        """Measure how the right view lies.

        Parameters
        ----------
        disparity : ndarray of float32
            Of the pair at any size, in its own pixels; no data is 0.
        start : Misalignment
            Where to begin; pixels of the whole views.
        rounds : int
            See `measure_misalignment`.

        Returns
        -------
        Measured or None
            Pixels of the whole views.
        """
        seen = resampled(disparity, self.views[0].shape)
        found = measure_misalignment(self._texture, seen, start.resized(1 / self.factor), rounds, self._every)
        return None if found is None else found.resized(self.factor)
