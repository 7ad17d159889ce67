"""TIFF: tifffile reads the tags, the pixel segments are decoded here [TIFF 6.0; Adobe Photoshop TIFF notes].

Without imagecodecs tifffile decodes neither LZW nor PackBits nor the floating-point predictor; OpenCV has the
first two, but reads no float16. So every segment is decompressed to bytes, whoever can do it, and the bytes
become numbers in one place.
"""

import io
import struct
import warnings
import zlib
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.stored import PICTURE_FLAGS, Stored, native, require_pixels_fit

SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_NONE, _LZW, _DEFLATE, _OLD_DEFLATE, _PACKBITS = 1, 5, 8, 32946, 32773
_OPENCV_DECODES = (_LZW, _PACKBITS)
_MAX_EXPANSION = {_NONE: 1, _DEFLATE: 1032, _OLD_DEFLATE: 1032, _PACKBITS: 64, _LZW: 2732}
_HORIZONTAL, _FLOATING_POINT = 2, 3
_PALETTE = 3
_REDUCED_OR_MASK = 0b101
# how tifffile fails on damaged tags: it has no one error for that
_DAMAGE = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RuntimeError,
    OSError,
    MemoryError,
    struct.error,
)


def decode_tiff(data: bytes, name: str) -> Stored:
    """The first page of a TIFF file, as it is stored; single-channel."""
    import tifffile  # 0.1 s that only TIFF users pay

    try:
        with warnings.catch_warnings(), tifffile.TiffFile(io.BytesIO(data)) as file:
            page = file.pages[0]
            values = _page_values(page, data, name)
            return Stored(native(values), "tiff", nodata=_nodata(page))
    except (tifffile.TiffFileError, *_DAMAGE) as error:
        raise InputError(f"{name}: is a damaged or truncated TIFF ({_reason(error)})") from None


def encode_tiff(values: NDArray[Any], nodata: tuple[float, ...] = ()) -> bytes:
    """A Deflate-compressed single-page TIFF file of any real dtype."""
    import tifffile

    buffer = io.BytesIO()
    tags = [(42113, "s", 0, f"{nodata[0]:.17g}", True)] if nodata else []
    tifffile.imwrite(
        buffer,
        values,
        photometric="minisblack",
        metadata=None,
        software=False,
        compression="zlib",
        extratags=tags,
    )
    return buffer.getvalue()


def picture(data: bytes, name: str) -> NDArray[Any]:
    """The pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), PICTURE_FLAGS)
    if pixels is None or pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{name}: is a damaged TIFF, or no camera image of 8 or 16 bits")
    return pixels


def _page_values(page: Any, data: bytes, name: str) -> NDArray[Any]:
    """The numbers of one page, after refusing what is no map or cannot be true."""
    width, height, samples = int(page.imagewidth), int(page.imagelength), int(page.samplesperpixel)
    if width == 0 or height == 0:
        raise InputError(f"{name}: has no pixels ({width} x {height})")
    if samples != 1 or page.photometric == _PALETTE:
        what = f"{samples} channels" if samples != 1 else "a colour palette"
        raise InputError(f"{name}: is a colour image ({what}); a disparity map has one channel")
    if int(page.imagedepth) != 1:
        raise InputError(f"{name}: is a volume of {page.imagedepth} slices; a disparity map is 2-D")
    if page.dtype is None or page.dtype.kind not in "biuf":
        raise InputError(f"{name}: holds pixels that are no real numbers; a disparity map does")
    _require_size(page, width, height, data, name)
    if int(page.compression) not in _MAX_EXPANSION or int(page.bitspersample) not in (8, 16, 32, 64):
        return _decoded_by_tifffile(page, name)
    return _from_segments(page, width, height, data, name)


def _require_size(page: Any, width: int, height: int, data: bytes, name: str) -> None:
    """Refuse segments beyond the file's end, and sizes that the bytes cannot hold."""
    counts = page.databytecounts
    for offset, count in zip(page.dataoffsets, counts, strict=True):
        if offset + count > len(data):
            raise InputError(
                f"{name}: is truncated: its pixels should end at byte {offset + count} of {len(data)}"
            )
    compression = int(page.compression)
    if compression != _NONE:
        require_pixels_fit(width, height, name)
    needed = width * height * int(page.bitspersample) // 8
    if compression in _MAX_EXPANSION and needed > _MAX_EXPANSION[compression] * sum(counts):
        raise InputError(
            f"{name}: its header claims {width} x {height} pixels, more than {sum(counts)} bytes can hold"
        )


def _decoded_by_tifffile(page: Any, name: str) -> NDArray[Any]:
    """Rare codecs and bit depths: tifffile's own decoding, which may need imagecodecs."""
    try:
        values: NDArray[Any] = page.asarray()
    except (ValueError, KeyError) as error:
        if "imagecodecs" not in str(error):
            raise
        raise InputError(f"{name}: {_reason(error)}: pip install 'rollcli[tiff]'") from None
    return values


def _from_segments(page: Any, width: int, height: int, data: bytes, name: str) -> NDArray[Any]:
    """Decode strips or tiles and put them in their places."""
    if page.is_tiled:
        across, down = int(page.tilewidth), int(page.tilelength)
    else:
        across, down = width, min(int(page.rowsperstrip), height)
    columns, rows = -(-width // across), -(-height // down)
    if across * down > 4 * width * height + 2**20 or len(page.dataoffsets) != columns * rows:
        raise InputError(
            f"{name}: is a damaged TIFF: {len(page.dataoffsets)} segments of {across} x {down} pixels"
        )
    values = np.empty((height, width), page.dtype.newbyteorder("="))
    for index, (offset, count) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        top, left = index // columns * down, index % columns * across
        lines = down if page.is_tiled else min(down, height - top)
        segment = _segment(page, data[offset : offset + count], across, lines, name)
        values[top : top + lines, left : left + across] = segment[: height - top, : width - left]
    return values


def _segment(page: Any, packed: bytes, width: int, height: int, name: str) -> NDArray[Any]:
    """One strip or tile: decompressed, byte order and predictor undone; shape (height, width)."""
    dtype = page.dtype.newbyteorder(page.parent.byteorder)
    row = width * dtype.itemsize
    plain = _decompressed(int(page.compression), packed, row, height, name)
    if len(plain) < row * height:
        raise InputError(f"{name}: is truncated: a segment holds {len(plain)} of {row * height} bytes")
    predictor = int(page.predictor)
    if predictor == _FLOATING_POINT:
        # bytes of a row are split by significance, highest first, then differenced
        planes = np.frombuffer(plain, np.uint8, row * height).reshape(height, row)
        split = np.cumsum(planes, axis=1, dtype=np.uint8).reshape(height, dtype.itemsize, width)
        big_endian = np.ascontiguousarray(split.transpose(0, 2, 1))
        values: NDArray[Any] = big_endian.view(dtype.newbyteorder(">")).reshape(height, width)
        return values
    values = np.frombuffer(plain, dtype, width * height).reshape(height, width)
    if predictor == _HORIZONTAL:
        whole = native(values).view(f"u{dtype.itemsize}")  # differences are taken of the bits, modulo 2^n
        return np.cumsum(whole, axis=1, dtype=whole.dtype).view(dtype.newbyteorder("="))
    return values


def _decompressed(compression: int, packed: bytes, row: int, height: int, name: str) -> bytes:
    """The bytes of a segment of `height` rows of `row` bytes."""
    if compression == _NONE:
        return packed
    if compression in _OPENCV_DECODES:
        return _unpacked_by_opencv(compression, packed, row, height, name)
    try:
        return zlib.decompressobj().decompress(packed, row * height)
    except zlib.error:
        raise InputError(f"{name}: is a damaged TIFF: its Deflate data are wrong") from None


def _unpacked_by_opencv(compression: int, packed: bytes, row: int, height: int, name: str) -> bytes:
    """Decompress a segment by dressing it as a one-strip TIFF of `row` x `height` bytes."""
    size = {256: row, 257: height, 278: height}
    entries = sorted({**size, 258: 8, 259: compression, 262: 1, 273: 8, 277: 1, 279: len(packed)}.items())
    start = 8 + len(packed) + len(packed) % 2
    directory = struct.pack("<H", len(entries)) + b"".join(
        struct.pack("<HHII", t, 4, 1, v) for t, v in entries
    )
    file = struct.pack("<2sHI", b"II", 42, start) + packed.ljust(start - 8, b"\0") + directory + bytes(4)
    pixels = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.shape != (height, row):
        raise InputError(f"{name}: is a damaged TIFF: its compressed data are wrong")
    return pixels.tobytes()


def _nodata(page: Any) -> tuple[float, ...]:
    """GDAL's no-data tag, a number as text."""
    tag = page.tags.get(42113)
    try:
        return () if tag is None else (float(str(tag.value).strip("\0 ")),)
    except ValueError:
        return ()


def _reason(error: BaseException) -> str:
    """The first line of an error, for a message of one line."""
    return (str(error).strip("'\"").splitlines() or [type(error).__name__])[0][:120]
