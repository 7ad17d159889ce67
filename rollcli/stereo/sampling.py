"""Grey levels of views between their pixels, and in blocks; where a right view shows a level one's points."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Bools, Singles
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.views import Map, Number, View, resized

BLOCK = 8  # px: the side of what gets one shift where the grey levels of both views are compared


def seen_at(
    lies: Misalignment, u: Singles, v: Singles, shape: tuple[int, ...], near: Singles | float = 0.0
) -> tuple[Singles, Singles]:
    """Return where a right view of this shape that `lies` so shows the points (u, v) of a level one, px.

    `near` are the points' disparities, px: a tilt moves near points further down.
    """
    if lies == LEVEL:
        return u, v
    height, width = shape
    middle = np.float32((width - 1) / 2)
    x, y = u - middle, v - np.float32((height - 1) / 2)
    return (1 + lies.scale) * x + (middle - lies.rotation * y), v + lies.down(x, y, near)


def block_means(pixels: Singles) -> Singles:
    """Return the means of the blocks that fit into an image, shape (H // BLOCK, W // BLOCK)."""
    height, width = (side // BLOCK for side in pixels.shape)
    whole = pixels[: height * BLOCK, : width * BLOCK]
    return resized(whole, (width, height), cv2.INTER_AREA)


def blocks_at(pixels: NDArray[Number], places: Bools) -> NDArray[Number]:
    """Return the pixels of some of the blocks of an image, shape (blocks, BLOCK ** 2)."""
    height, width = (side // BLOCK for side in pixels.shape)
    blocks = pixels[: height * BLOCK, : width * BLOCK].reshape(height, BLOCK, width, BLOCK)
    return blocks.swapaxes(1, 2)[places].reshape(-1, BLOCK**2)


_SMOOTH = np.array([1, 6, 1], np.float32) / 8  # what `cv2.pyrUp` does at a view's own pixels


def smoothed_between(view: NDArray[Number]) -> NDArray[Number]:
    """Return a view twice as large and a little smoother, for `grey_between`.

    Grey levels that are interpolated between pixels lie off by where between them: linearly by up to 0.08 px,
    by OpenCV's cubic by 0.05. Between these by 0.005, at a tenth of what Lanczos' eight pixels cost.
    """
    return cv2.pyrUp(view).astype(view.dtype, copy=False)


def smoothed(view: View | Map) -> Map:
    """Return the grey levels of a view as smooth as `smoothed_between` makes them, at its own pixels."""
    return cv2.sepFilter2D(view, cv2.CV_32F, _SMOOTH, _SMOOTH).astype(np.float32, copy=False)


def smoothed_at_pixels(view: View) -> View:
    """Return a view as smooth as `smoothed_between` makes it."""
    return _as_stored(smoothed(view), view)


def grey_between(twice: NDArray[Number], u: Singles, v: Singles) -> tuple[Singles, Singles, NDArray[Number]]:
    """Return points (u, v) to 1/64 px, and the grey levels there of a view that is `smoothed_between`.

    The border repeats.
    """
    read_u, read_v = rounded(u, 64), rounded(v, 64)
    return read_u, read_v, _remapped(twice, 2 * read_u, 2 * read_v, cv2.INTER_LINEAR)


def rows_around(v: Singles, height: int) -> slice:
    """Return the rows of a view that `smoothed_between` sees for points in rows v: one more beside each."""
    top = max(0, min(int(v.min()), height) - 3)
    return slice(top, max(top, int(v.max())) + 4)


def grey_along(view: View, u: Singles, v: Singles) -> View:
    """Return what `grey_between` does of the view `smoothed_between`, of which it needs few rows."""
    near = rows_around(v, len(view))
    return grey_between(smoothed_between(view[near]), u, v - np.float32(near.start))[2]


_TO_WHOLE = 1.5 * 2**23  # a float32 of this size has steps of 1, and so has a sum with it
# Grey levels: a sum of 64ths or 1024ths is often halfway between two, and goes up. OpenCV rounds it either
# way, by its version and by whether a pixel is one of the last in its row
_HALF_UP = 2.0**-11


def rounded(points: Singles, parts: int) -> Singles:
    """Return coordinates rounded to parts of a pixel, a power of two of them."""
    to_parts = np.float32(_TO_WHOLE / parts)
    return points + to_parts - to_parts


def sampled(view: NDArray[Number], u: Singles, v: Singles, between: int) -> NDArray[Number]:
    """Return the grey levels at points (u, v) of a view, interpolated as `between`; the border repeats.

    OpenCV 4 rounds points to 1/32 px, and OpenCV 5 does not: angles of 41 real pairs differed by up to 0.07
    degrees. Of points that are rounded here, all versions see the same.
    """
    return _remapped(view, rounded(u, 32), rounded(v, 32), between)


def _remapped(view: NDArray[Number], u: Singles, v: Singles, between: int) -> NDArray[Number]:
    """Return the grey levels at points that are rounded, see `sampled`."""
    grey = view.astype(np.float32, copy=False)
    return _as_stored(cv2.remap(grey, u, v, between, borderMode=cv2.BORDER_REPLICATE), view)


def _as_stored(grey: NDArray[Any], like: NDArray[Number]) -> NDArray[Number]:
    """Return grey levels that were computed as float32 in the type of the view that they are of."""
    if like.dtype == np.uint8:
        grey = cv2.convertScaleAbs(np.maximum(grey, 0), beta=_HALF_UP)
    return grey.astype(like.dtype, copy=False)


def half_the_rows(view: View) -> View:
    """Return the means of every two rows; the last row counts twice where it is alone."""
    following = view[np.minimum(np.arange(1, len(view) + 1, 2), len(view) - 1)]
    return cv2.addWeighted(view[::2], 0.5, following, 0.5, _HALF_UP).astype(np.uint8, copy=False)
