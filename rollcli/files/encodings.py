"""Stored numbers to pixels of disparity and back."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError
from rollcli.files.formats import Stored, decode_mask, read_bytes, read_stored


class Encoding(str, Enum):
    """How a stored number stands for a disparity in pixels."""

    PX = "px"  # as it is
    KITTI = "kitti"  # p / 256; 0 is no data
    CITYSCAPES = "cityscapes"  # (p - 1) / 256; 0 is no data
    SGBM = "sgbm"  # p / 16; negative is no data


_SCALE = {Encoding.PX: 1.0, Encoding.KITTI: 1 / 256, Encoding.CITYSCAPES: 1 / 256, Encoding.SGBM: 1 / 16}
_AUTO = {np.dtype(np.uint16): Encoding.KITTI, np.dtype(np.int16): Encoding.SGBM}
_WHOLE_PIXELS_BELOW = 512


@dataclass(frozen=True)
class DisparityMap:
    """A map in pixels, and how it came about.

    Attributes
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; float32, or float64 where the file holds float64. No data is exactly 0; no NaN, no inf.
    encoding : Encoding
        The one used.
    scale : float
        Pixels per stored unit.
    stored : Stored
        What the file holds.
    warning : str or None
        Why the encoding taken by "auto" cannot be right, or what else a user should know.
    """

    disparity: NDArray[Any]
    encoding: Encoding
    scale: float
    stored: Stored
    warning: str | None


def to_disparity(
    stored: Stored, *, encoding: str = "auto", scale: float | None = None, invalid: Iterable[float] = ()
) -> DisparityMap:
    """Turn stored numbers into pixels of disparity.

    Parameters
    ----------
    stored : Stored
        What a file holds.
    encoding : {"auto", "px", "kitti", "cityscapes", "sgbm"}
        auto: uint16 is kitti, int16 is sgbm, everything else px.
    scale : float, optional
        Pixels per stored unit, in place of the encoding's own; makes "auto" take px.
    invalid : iterable of float
        Stored values that mean no data, besides NaN, inf, <= 0, the file's own tag, and 65535 in uint16.

    Raises
    ------
    UsageError
        Unknown encoding, or a scale that is not positive.
    """
    used = resolve_encoding(encoding, stored.values.dtype, scale)
    factor = _SCALE[used] if scale is None else scale
    if not (np.isfinite(factor) and factor > 0):
        raise UsageError(f"scale {factor}: must be a positive number (pixels per stored unit)")
    values = stored.values
    disparity = _scaled(values, used, factor)
    _blank(disparity, values, (*invalid, *stored.nodata, *_saturated(values.dtype)))
    warning = _doubt(values, used) if encoding == "auto" and scale is None else None
    return DisparityMap(disparity, used, factor, stored, warning)


def read_disparity(
    path: str | Path, *, encoding: str = "auto", scale: float | None = None, invalid: float | None = None
) -> NDArray[Any]:
    """Read a disparity map: pixels, shape (H, W), float32 (float64 if the file holds that); no data is 0.

    Parameters are those of `to_disparity`; the file may be PNG, TIFF, NPY or PFM.
    """
    values = () if invalid is None else (invalid,)
    return to_disparity(read_stored(path), encoding=encoding, scale=scale, invalid=values).disparity


def from_disparity(
    disparity: NDArray[Any], encoding: str, dtype: Any = np.uint16, *, scale: float | None = None
) -> NDArray[Any]:
    """Turn pixels of disparity back into numbers to store; no data (<= 0) becomes 0, or -16 for sgbm.

    Whole-number types are rounded, and clipped at their ends.
    """
    used, kind = Encoding(encoding), np.dtype(dtype)
    factor = _SCALE[used] if scale is None else scale
    numbers = disparity.astype(np.float64) / factor + (used is Encoding.CITYSCAPES)
    if kind.kind in "iu":
        limits = np.iinfo(kind)
        numbers = np.clip(np.rint(numbers), limits.min, limits.max)
    empty = -16 if used is Encoding.SGBM and kind.kind == "i" else 0
    return np.where(disparity > 0, numbers, empty).astype(kind)


def read_mask(path: str | Path) -> NDArray[np.bool_]:
    """Read a mask: True where any channel is non-zero; shape (H, W)."""
    return decode_mask(read_bytes(path), str(path))


def resolve_encoding(encoding: str, dtype: np.dtype[Any], scale: float | None) -> Encoding:
    """The encoding that a name stands for, "auto" included."""
    if encoding == "auto":
        return Encoding.PX if scale is not None else _AUTO.get(dtype, Encoding.PX)
    try:
        return Encoding(encoding)
    except ValueError:
        names = ", ".join(("auto", *(each.value for each in Encoding)))
        raise UsageError(f"encoding {encoding!r} is unknown: choose one of {names}") from None


def _scaled(values: NDArray[Any], encoding: Encoding, scale: float) -> NDArray[Any]:
    """Pixels; whatever is not a positive finite number becomes 0."""
    real = np.float64 if values.dtype.itemsize >= 8 and values.dtype.kind == "f" else np.float32
    if values.dtype.kind == "u" and encoding is not Encoding.CITYSCAPES:
        product: NDArray[Any] = np.multiply(values, real(scale), dtype=real)
        return product
    pixels: NDArray[Any] = np.fmax(values, 0).astype(real)  # fmax: NaN gives way to 0
    if encoding is Encoding.CITYSCAPES:
        pixels = np.fmax(pixels - real(1), real(0))
    if scale != 1:
        pixels *= real(scale)
    if values.dtype.kind == "f" and not np.isfinite(pixels.max()):
        pixels[np.isinf(pixels)] = 0
    return pixels


def _blank(disparity: NDArray[Any], values: NDArray[Any], invalid: tuple[float, ...]) -> None:
    """Set to 0 the pixels whose stored value means no data."""
    for value in invalid:
        if value > 0 and np.isfinite(value):
            disparity[values == value] = 0


def _saturated(dtype: np.dtype[Any]) -> tuple[float, ...]:
    return (65535.0,) if dtype == np.uint16 else ()


def _doubt(values: NDArray[Any], encoding: Encoding) -> str | None:
    if encoding is Encoding.KITTI and 0 < (top := int(values.max())) < _WHOLE_PIXELS_BELOW:
        return (
            f"uint16 values stay at {top}, read as kitti (/256) that is {top / 256:.2f} px: "
            "they look like whole pixels; use --encoding px"
        )
    return None
