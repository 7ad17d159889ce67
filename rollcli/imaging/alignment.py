"""The vertical offset between the views of a pair: what remains where a rig has moved since its calibration.

Matching looks for a pixel in the same row. Where the right view lies lower or higher, slanted edges find
their match at a wrong disparity: on a road, whose edges converge, that turns the disparities as a roll does,
by half a degree a pixel or so, and nothing in the map tells.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ROUNDS = 4
_SMOOTHING = 1.2  # px: grey levels are then nearly linear within an offset of a pixel
_FLAT = 4.0  # grey levels per pixel, squared: weaker gradients are noise
_TELLING = 0.3  # share of the squared gradient that is vertical, from which an edge is looked at
_FEWEST = 100  # pixels to tell an offset from
_OUTLIER = 3.0  # standard deviations, beyond which a difference is a wrong match
_LONGEST_STEP = 1.0  # px
_ROW = 1024


def vertical_offset(
    left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: NDArray[np.float32]
) -> float:
    """Measure how much lower the right view lies than the left one.

    Least squares on the grey levels at matched pixels [Lucas and Kanade 1981], mostly of edges along the
    rows: a wrong disparity cannot hide an offset there.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Rectified, grey.
    disparity : ndarray of float32, shape (H, W)
        Pixels; no data is 0.

    Returns
    -------
    float
        Pixels; 0 where nothing tells. Beyond a pixel it comes out too small: move the view and measure again.
    """
    left_grey, right_grey = (_smooth(view) for view in (left, right))
    across, down = (
        cv2.Sobel(left_grey, cv2.CV_32F, *order, ksize=3, scale=0.125) for order in ((1, 0), (0, 1))
    )
    telling = np.square(down) / (np.square(across) + np.square(down) + np.float32(_FLAT))
    rows, columns = np.nonzero((telling > _TELLING) & (disparity > 0))
    if len(rows) < _FEWEST:
        return 0.0
    seen, down = left_grey[rows, columns], down[rows, columns]
    telling = np.square(telling[rows, columns])
    at_u, at_v = columns - disparity[rows, columns], rows.astype(np.float32)
    offset = 0.0
    for _ in range(_ROUNDS):
        difference = _at(right_grey, at_u, at_v + np.float32(offset)) - seen
        difference -= np.median(difference)  # the views' brightness may differ
        spread = 1.4826 * float(np.median(np.abs(difference))) + 1e-3
        weight = telling * np.exp(-np.square(difference / np.float32(_OUTLIER * spread))) * down
        step = float(weight @ difference) / (float(weight @ down) + 1e-9)
        offset -= max(-_LONGEST_STEP, min(_LONGEST_STEP, step))
    return offset


def _smooth(view: NDArray[np.uint8]) -> NDArray[np.float32]:
    smooth = cv2.GaussianBlur(view.astype(np.float32), (0, 0), _SMOOTHING)
    return smooth.astype(np.float32, copy=False)


def _at(view: NDArray[np.float32], u: NDArray[Any], v: NDArray[Any]) -> NDArray[np.float32]:
    """Values between pixels, in rows of a length that OpenCV takes."""
    shape = -(-len(u) // _ROW), _ROW
    at_u, at_v = (np.resize(each.astype(np.float32), shape) for each in (u, v))
    found = cv2.remap(view, at_u, at_v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return found.ravel()[: len(u)].astype(np.float32, copy=False)


def moved_up(view: NDArray[np.uint8], offset: float) -> NDArray[np.uint8]:
    """The view, moved up by `offset` pixels; the row at the border is repeated."""
    if offset == 0:
        return view
    height, width = view.shape
    move = np.array([[1, 0, 0], [0, 1, -offset]], np.float32)
    moved = cv2.warpAffine(
        view, move, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return moved.astype(np.uint8, copy=False)
