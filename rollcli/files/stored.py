"""What a map file holds, before its numbers are read as pixels."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError

# a compressed file may claim any size in a few bytes: more than this is refused before memory is taken
MAX_COMPRESSED_PIXELS = 2**27

# a camera image as it lies in the file, grey or BGR: turning it by its EXIF tag would break rectification
PICTURE_FLAGS = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION


@dataclass(frozen=True)
class Stored:
    """The numbers of a map file, as they are stored.

    Attributes
    ----------
    values : ndarray, shape (H, W)
        A real dtype in native byte order, C-contiguous; may be read-only.
    format : str
        "png", "tiff", "npy" or "pfm".
    nodata : tuple of float
        The stored values that the file itself says mean no data (GDAL's tag).
    """

    values: NDArray[Any]
    format: str
    nodata: tuple[float, ...] = ()


def require_map_shape(shape: tuple[int, ...], name: str) -> None:
    """Refuse anything that is not (H, W) with at least one pixel."""
    if len(shape) != 2:
        raise InputError(f"{name}: is a {len(shape)}-D array of shape {shape}; a disparity map is 2-D (H, W)")
    if 0 in shape:
        raise InputError(f"{name}: has no pixels (shape {shape})")


def require_pixels_fit(width: int, height: int, name: str) -> None:
    """Refuse a compressed image whose header claims more pixels than any map has."""
    if width * height > MAX_COMPRESSED_PIXELS:
        raise InputError(
            f"{name}: its header claims {width} x {height} pixels; "
            f"compressed maps of up to {MAX_COMPRESSED_PIXELS // 10**6} million pixels are read"
        )


def native(values: NDArray[Any]) -> NDArray[Any]:
    """C-contiguous, in this machine's byte order."""
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))
