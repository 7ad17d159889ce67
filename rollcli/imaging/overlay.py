"""Pictures of disparity maps, and of the road found in them."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ROAD = (80, 220, 60)  # BGR


def draw_disparity(disparity: NDArray[Any]) -> NDArray[np.uint8]:
    """A map in colour: dark blue is far, yellow is near, black is no data; BGR uint8, shape (H, W, 3)."""
    valid = np.isfinite(disparity) & (disparity > 0)
    top = float(np.percentile(disparity[valid], 99)) if valid.any() else 1.0
    grey = (np.clip(np.where(valid, disparity, 0) / top, 0, 1) * 255).astype(np.uint8)
    picture = cv2.applyColorMap(grey, cv2.COLORMAP_VIRIDIS).astype(np.uint8, copy=False)
    picture[~valid] = 0
    return picture


def draw_road(disparity: NDArray[Any], mask: NDArray[Any]) -> NDArray[np.uint8]:
    """The map in colour with the road tinted; BGR uint8, shape (H, W, 3).

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.
    mask : ndarray, shape (H, W)
        Non-zero where the road is.
    """
    picture = draw_disparity(disparity)
    road = np.asarray(mask) != 0
    picture[road] = (picture[road] * 0.45 + np.array(_ROAD) * 0.55).astype(np.uint8)
    return picture
