"""Draw the pixels that a user allows: those inside the mask file, the rectangle and the polygon."""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.encodings import read_mask
from rollcli.frames.options import FrameOptions, RegionOptions

Corner = tuple[float, float]
_FAR = 2**17  # pixels; a side that leaves the map there is still straight to a hundredth of a pixel


def region_mask(mask: str | None, options: FrameOptions, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
    """Find the pixels inside all that is given, shape (H, W); None when nothing is given.

    Raises
    ------
    InputError
        The mask cannot be read or has another size, or no pixel is left.
    """
    region = options.region
    if mask is None and region.roi is None and region.polygon is None:
        return None
    allowed = _drawn(region, shape)
    if mask is not None:
        usable = _mask_file(options.at(mask), mask)
        if usable.shape != shape:
            raise InputError(f"the mask {mask} is {_size(usable.shape)}, the map {_size(shape)}")
        allowed = allowed & usable
    if not allowed.any():
        raise InputError(f"no pixel of this {_size(shape)} map lies inside the mask, --roi and --polygon")
    return allowed


@lru_cache(maxsize=4)  # the maps of a batch have one size, or a few
def _drawn(options: RegionOptions, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    inside = np.zeros(shape, np.uint8)
    x0, y0, x1, y1 = options.roi or (0, 0, shape[1], shape[0])
    inside[y0:y1, x0:x1] = 1
    if options.polygon is not None:
        area: NDArray[Any] = np.zeros(shape, np.uint8)
        if corners := _near(options.polygon):
            cv2.fillPoly(area, [np.rint(corners).astype(np.int32)], 1)
        inside &= area
    return inside.astype(np.bool_)


def _near(corners: Sequence[Corner]) -> Sequence[Corner]:
    """Cut off what lies far outside of any map [Sutherland, Hodgman 1974]: OpenCV would fill that, too.

    In fractions, for of a step between 1e300 and a pixel a float keeps nothing.
    """
    exact = [(Fraction(u), Fraction(v)) for u, v in corners]
    for axis in (0, 1):
        for bound, side in ((-_FAR, 1), (_FAR, -1)):
            kept: list[tuple[Fraction, Fraction]] = []
            for one, other in zip(exact, (*exact[1:], *exact[:1]), strict=True):
                first, second = side * (one[axis] - bound), side * (other[axis] - bound)
                if first >= 0:
                    kept.append(one)
                if (first >= 0) != (second >= 0):
                    share = first / (first - second)
                    cut = [a + share * (b - a) for a, b in zip(one, other, strict=True)]
                    kept.append((cut[0], cut[1]))
            exact = kept
    return [(float(u), float(v)) for u, v in exact]


@lru_cache(maxsize=1)  # a mask for all frames is read once
def _mask_file(path: str, name: str) -> NDArray[np.bool_]:
    return read_mask(path, name)


def _size(shape: tuple[int, ...]) -> str:
    return "x".join(map(str, reversed(shape)))
