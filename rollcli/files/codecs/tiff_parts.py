"""Strips and tiles of a TIFF: predictors undone, put in their places [Adobe's technical notes 1 and 3].

Without imagecodecs tifffile decodes neither LZW nor PackBits nor the floating-point predictor, and OpenCV
reads no float16 and returns damaged data as if they were whole.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.files.codecs.extras import imagecodecs
from rollcli.files.codecs.raw_map import native
from rollcli.files.codecs.unpack import unpacked

_NO_PREDICTOR, _HORIZONTAL, _FLOATING_POINT = 1, 2, 3


def decode_parts(
    page: Any, shape: tuple[int, int, int], part: tuple[int, int], data: bytes, empty: float
) -> NDArray[Any]:
    """Decode strips or tiles into their places.

    Parameters
    ----------
    page : tifffile.TiffPage
        Its tags have been checked; 8, 16, 32 or 64 bits a number, channels side by side.
    shape : tuple of int
        (H, W, channels) of the image.
    part : tuple of int
        Rows and columns of a strip or tile.
    data : bytes
        The file.
    empty : float
        What the pixels of a part that is not in the file hold, as GDAL leaves them out.

    Raises
    ------
    DamagedPartError
    """
    height, width, samples = shape
    down, across = part
    columns = -(-width // across)
    values = np.empty(shape, page.dtype.newbyteorder("="))
    for index, (offset, count) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        top, left = index // columns * down, index % columns * across
        rows = down if page.is_tiled else min(down, height - top)  # the last strip is short
        place = values[top : top + rows, left : left + across]
        if count == 0:
            place[:] = _as(empty, values.dtype)
        else:
            numbers = _part(page, data[offset : offset + count], (rows, across, samples), down)
            place[:] = numbers[: height - top, : width - left]
    return values


def check_parts(page: Any, part: tuple[int, int, int], data: bytes) -> None:
    """Raise DamagedPartError where one does not hold its pixels; part is (rows, columns, channels)."""
    down, across, samples = part
    row = -(-across * samples * int(page.bitspersample) // 8)
    strips = -(-int(page.imagelength) // down)
    for index, (offset, count) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        last = not page.is_tiled and index % strips == strips - 1
        rows = int(page.imagelength) - (strips - 1) * down if last else down
        if count:
            unpacked(int(page.compression), data[offset : offset + count], rows * row, down * row)


def _as(number: float, dtype: np.dtype[Any]) -> Any:
    """Return the number in this dtype, or 0 where that cannot hold it."""
    if dtype.kind in "iu" and not np.iinfo(dtype).min <= number <= np.iinfo(dtype).max:
        return dtype.type(0)  # NaN, too
    with np.errstate(over="ignore"):
        return dtype.type(number)


def _part(page: Any, packed: bytes, shape: tuple[int, int, int], most_rows: int) -> NDArray[Any]:
    """Decode one strip or tile, shape (rows, columns, channels)."""
    rows, columns, samples = shape
    dtype = page.dtype.newbyteorder(page.parent.byteorder)
    row = columns * samples * dtype.itemsize
    plain = unpacked(int(page.compression), packed, rows * row, most_rows * row)
    if page.predictor == _FLOATING_POINT and dtype.kind == "f":
        return _unpredicted_floats(plain, shape, dtype)
    values = _shaped(plain, shape, dtype)
    if page.predictor == _HORIZONTAL:
        bits = native(values).view(f"u{dtype.itemsize}")  # differences are taken of the bits, modulo 2^n
        values = np.cumsum(bits, axis=1, dtype=bits.dtype).view(dtype.newbyteorder("="))
    elif page.predictor != _NO_PREDICTOR:
        raise ValueError(f"predictor {page.predictor} of {dtype}")
    return values


def _shaped(plain: bytes, shape: tuple[int, int, int], dtype: Any) -> NDArray[Any]:
    rows, columns, samples = shape
    return np.frombuffer(plain, dtype, rows * columns * samples).reshape(shape)


def _unpredicted_floats(plain: bytes, shape: tuple[int, int, int], dtype: Any) -> NDArray[Any]:
    """Undo predictor 3: the bytes of a row lie sorted by significance, highest first, as differences."""
    if (codecs := imagecodecs()) is not None:
        decoded: NDArray[Any] = codecs.floatpred_decode(_shaped(plain, shape, dtype), axis=-2)
        return decoded
    rows, columns, samples = shape
    planes = np.frombuffer(plain, np.uint8, rows * columns * samples * dtype.itemsize).reshape(
        rows, -1, samples
    )
    split = np.cumsum(planes, axis=1, dtype=np.uint8).reshape(rows, dtype.itemsize, columns * samples)
    joined: NDArray[Any] = np.ascontiguousarray(split.transpose(0, 2, 1)).view(dtype.newbyteorder(">"))
    return joined.reshape(shape)
