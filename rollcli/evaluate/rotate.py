"""Rotate a map by a known angle, as the paper's accuracy experiment does."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def rotate_nearest(disparity: NDArray[Any], angle: float) -> NDArray[Any]:
    """Turn a map about its centre so that its roll grows by `angle`; the nearest pixel gives the value.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    angle : float
        Radians.

    Returns
    -------
    ndarray, shape (H', W')
        Large enough to keep the corners: an estimate that does not follow by `angle` was moved by the
        rounding of coordinates, not by a loss of pixels. No data is 0.
    """
    height, width = disparity.shape
    c, s = math.cos(angle), math.sin(angle)
    new_width = math.ceil(abs(width * c) + abs(height * s) - 1e-9)
    new_height = math.ceil(abs(width * s) + abs(height * c) - 1e-9)
    u, v = np.arange(new_width) - (new_width - 1) / 2, np.arange(new_height) - (new_height - 1) / 2
    columns = np.rint(np.add.outer(v * s, u * c) + (width - 1) / 2).astype(np.int32)
    rows = np.rint(np.add.outer(v * c, -u * s) + (height - 1) / 2).astype(np.int32)
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    rotated = np.zeros((new_height, new_width), disparity.dtype)
    rotated[inside] = disparity[rows[inside], columns[inside]]
    return rotated
