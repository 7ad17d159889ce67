"""What a map file holds, before its numbers are read as pixels."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.bounded import MOST_EXPANSION, MOST_SMALL

# A compressed file may claim any size in a few bytes. What it would take is counted before memory is taken:
# as disparities in float32, or in the file's own numbers where these are larger. What is computed from a map
# takes up to fifteen times as much (with every image), so that a file of 1 MB never takes 1 GB
_FLOAT32 = 4
_MOST = 2**29  # bytes: 134 million pixels

COLOUR_REMEDY = "a disparity map has one channel; photographs are given by --left and --right"


@dataclass(frozen=True)
class Stored:
    """The numbers of a map file, as they are stored.

    Attributes
    ----------
    values : ndarray, shape (H, W)
        A real dtype in native byte order, C-contiguous; may be read-only.
    format : str
        "png", "tiff", "npy", "npz", "pfm", "exr", or "rgb" for numbers in the three channels of a PNG.
    nodata : tuple of float
        The stored values that the file itself says mean no data (GDAL's tag).
    note : str
        What a user should know about how the file was read, or "".
    text : str
        What rollcli wrote beside the numbers (PNG text chunk, TIFF description), or "".
    """

    values: NDArray[Any]
    format: str
    nodata: tuple[float, ...] = ()
    note: str = ""
    text: str = ""


def require_map_shape(shape: tuple[int, ...]) -> None:
    """Refuse anything that is not (H, W) with at least one pixel."""
    if len(shape) != 2:
        colours = len(shape) == 3 and shape[2] in (3, 4)
        hint = "; photographs are given as image files, by --left and --right" if colours else ""
        raise InputError(f"is a {len(shape)}-D array of shape {shape}; a disparity map is 2-D (H, W){hint}")
    if 0 in shape:
        raise InputError(f"has no pixels (shape {shape})")


def require_bytes(what: str, needed: int, there: int) -> None:
    """Refuse a file that has fewer bytes than `what` ("3 x 2 pixels need")."""
    if there < needed:
        raise InputError(f"is truncated: {what} {needed} bytes, {there} are there")


def require_decoded_fits(
    width: int, height: int, pixel_bytes: int, stored: int, *, mask: bool = False
) -> None:
    """Refuse an image without pixels, or of more memory than any map takes or its file can be worth.

    Parameters
    ----------
    width, height : int
        As the header claims, pixels.
    pixel_bytes : int
        That the decoder takes for each.
    stored : int
        The size of the file, bytes.
    mask : bool
        Nothing is computed from it: it may stand for as much as any file, and masks compress best of all.
    """
    if width < 1 or height < 1:
        raise InputError(f"has no pixels ({width} x {height})")
    needed = width * height * (pixel_bytes if mask else max(pixel_bytes, _FLOAT32))
    limit = _MOST if mask else min(_MOST, max(MOST_SMALL, MOST_EXPANSION * stored))
    hint = "; save it uncompressed" if needed <= _MOST else ""
    if needed > limit:
        raise InputError(
            f"its header claims {width} x {height} pixels, {-(-needed // 2**20)} MB once decoded; "
            f"from {stored} bytes up to {limit >> 20} MB are read{hint}"
        )


def native(values: NDArray[Any]) -> NDArray[Any]:
    """Make C-contiguous, in this machine's byte order."""
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))
