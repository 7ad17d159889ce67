"""Rotate disparity maps by their roll, so that rows of the road become constant."""

import math
from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError

_LARGEST_SIDE = 32766  # OpenCV addresses pixels with 16 bits


def derotate(
    disparity: NDArray[Any], roll: float, *, expand: bool = False, invalid: Iterable[float] = ()
) -> NDArray[Any]:
    """Rotate a map about its centre so that a rig rolled by `roll` seems level.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Any real dtype: pixels, or numbers as they are stored. NaN, inf and <= 0 are no data.
    roll : float
        theta of the estimate, radians.
    expand : bool
        Enlarge the result so that it keeps the corners.
    invalid : iterable of float
        Further values that are no data.

    Returns
    -------
    ndarray
        Of the same dtype; the same shape unless `expand`. No data is written as the map writes it. Values
        come from valid neighbours alone, and only where the nearest pixel is valid.

    Raises
    ------
    InputError
        A side is longer than 32766 pixels.
    """
    if max(disparity.shape) > _LARGEST_SIDE:
        raise InputError(
            f"a map of shape {disparity.shape} is too large to rotate: up to {_LARGEST_SIDE} a side"
        )
    valid = _validity(disparity, invalid)
    if roll == 0:
        return np.array(disparity)
    matrix, size = _rotation(disparity.shape, roll, expand)
    weight = _warp(valid.astype(np.float32), matrix, size, cv2.INTER_LINEAR)
    total = _warp(
        np.where(valid, disparity, 0).astype(_working_type(disparity.dtype)), matrix, size, cv2.INTER_LINEAR
    )
    known = _warp(valid.astype(np.uint8), matrix, size, cv2.INTER_NEAREST) > 0
    known &= weight > 0
    values = np.divide(total, weight, out=np.zeros_like(total), where=known)
    if disparity.dtype.kind in "iu":
        limits = np.iinfo(disparity.dtype)
        values = np.clip(np.rint(values), limits.min, limits.max)
    rotated: NDArray[Any] = np.where(known, values, _no_data(disparity, valid)).astype(disparity.dtype)
    return rotated


def _validity(values: NDArray[Any], invalid: Iterable[float]) -> NDArray[np.bool_]:
    valid: NDArray[np.bool_] = np.isfinite(values) & (values > 0)
    for value in invalid:
        valid &= values != value
    return valid


def _working_type(dtype: np.dtype[Any]) -> type[np.floating[Any]]:
    """float32 where it holds the numbers exactly."""
    return np.float32 if dtype.itemsize <= 2 or dtype == np.float32 else np.float64


def _rotation(
    shape: tuple[int, ...], roll: float, expand: bool
) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """The matrix from output to input pixels, and the output's (width, height)."""
    height, width = shape
    c, s = math.cos(roll), math.sin(roll)
    size = (width, height)
    if expand:
        size = (
            math.ceil(width * abs(c) + height * abs(s) - 1e-9),
            math.ceil(width * abs(s) + height * abs(c) - 1e-9),
        )
    turn = np.array([[c, -s], [s, c]])  # (u, v) from (x, y)
    centre_in = np.array([width - 1, height - 1]) / 2
    centre_out = np.array([size[0] - 1, size[1] - 1]) / 2
    return np.column_stack([turn, centre_in - turn @ centre_out]), size


def _warp(values: NDArray[Any], matrix: NDArray[np.float64], size: tuple[int, int], how: int) -> NDArray[Any]:
    warped: NDArray[Any] = cv2.warpAffine(
        values, matrix, size, flags=how | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_CONSTANT, borderValue=0
    )
    return warped


def _no_data(values: NDArray[Any], valid: NDArray[np.bool_]) -> float:
    """How this map writes "no data"."""
    if values.dtype.kind == "u" or valid.all():
        return 0
    unused = values[~valid]
    if values.dtype.kind == "f":
        return (
            float("nan")
            if np.isnan(unused).any()
            else float(unused.max() if np.isinf(unused).any() else unused.min())
        )
    return min(float(unused.min()), 0)
