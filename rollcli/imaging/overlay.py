"""Pictures of disparity maps, and of the road found in them."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ROAD = (220, 230, 40)  # BGR
_TINT = 0.5


def draw_disparity(disparity: NDArray[Any]) -> NDArray[np.uint8]:
    """A map in colour: dark is far, bright is near, black is no data.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3)
        BGR.
    """
    return _coloured(_levels(disparity), _colours())


def draw_road(disparity: NDArray[Any], mask: NDArray[Any]) -> NDArray[np.uint8]:
    """A map in colour, as `draw_disparity` has it, with the road tinted and outlined.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.
    mask : ndarray, shape (H, W)
        Non-zero where the road is.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3)
        BGR.
    """
    levels = _levels(disparity)
    road = (np.asarray(mask) != 0).astype(np.uint8)
    colours = _colours()
    tinted = (colours * (1 - _TINT) + np.array(_ROAD) * _TINT).astype(np.uint8)
    picture = _coloured(levels, colours)
    cv2.copyTo(_coloured(levels, tinted), road, picture)
    outlines, _ = cv2.findContours(road, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return cv2.drawContours(picture, outlines, -1, _ROAD, 1).astype(np.uint8, copy=False)


def _levels(disparity: NDArray[Any]) -> NDArray[np.uint8]:
    """0 for no data, 1..255 for small to large disparities."""
    values = np.asarray(disparity)
    valid = np.isfinite(values) & (values > 0)
    if not valid.any():
        return np.zeros(values.shape, np.uint8)
    top = float(np.percentile(values[valid], 99))  # a few outliers would leave the rest dark
    return np.where(valid, np.clip(np.where(valid, values, 0) * (255 / top), 1, 255), 0).astype(np.uint8)


def _coloured(levels: NDArray[np.uint8], colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return cv2.applyColorMap(levels, colours.reshape(256, 1, 3)).astype(np.uint8, copy=False)


def _colours() -> NDArray[np.uint8]:
    """BGR of each level, shape (256, 3); even the smallest disparity differs from no data."""
    ramp = np.linspace(40, 255, 256).astype(np.uint8)
    colours = cv2.applyColorMap(ramp, cv2.COLORMAP_INFERNO).reshape(256, 3).astype(np.uint8, copy=False)
    colours[0] = 0
    return colours
