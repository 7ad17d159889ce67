"""What a map file holds, before its numbers are read as pixels."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError

# a compressed file may claim any size in a few bytes: more than this is refused before memory is taken
_MAX_DECODED = 2**28

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
    note : str
        What a user should know about how the file was read, or "".
    """

    values: NDArray[Any]
    format: str
    nodata: tuple[float, ...] = ()
    note: str = ""


def require_map_shape(shape: tuple[int, ...], name: str) -> None:
    """Refuse anything that is not (H, W) with at least one pixel."""
    if len(shape) != 2:
        raise InputError(f"{name}: is a {len(shape)}-D array of shape {shape}; a disparity map is 2-D (H, W)")
    if 0 in shape:
        raise InputError(f"{name}: has no pixels (shape {shape})")


def require_decoded_fits(size: int, claim: str, name: str) -> None:
    """Refuse a compressed image of more bytes than any map has."""
    if size > _MAX_DECODED:
        raise InputError(
            f"{name}: {claim}; compressed images of up to {_MAX_DECODED >> 20} MB of pixels are read"
        )


def native(values: NDArray[Any]) -> NDArray[Any]:
    """C-contiguous, in this machine's byte order."""
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))
