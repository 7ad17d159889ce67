"""TIFF [TIFF 6.0]: tifffile reads the tags and lays out strips and tiles; zlib and OpenCV unpack them."""

import contextlib
import io
import logging
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.codecs.arrays import COLOUR_REMEDY, Stored, native, require_decoded_fits
from rollcli.files.codecs.png import decoded_by_opencv, decoding

_NONE, _LZW, _JPEG, _DEFLATE, _OLD_DEFLATE, _PACKBITS = 1, 5, 7, 8, 32946, 32773
# how many bytes one byte can stand for
_MAX_EXPANSION = {_NONE: 1, _LZW: 2732, _DEFLATE: 1032, _OLD_DEFLATE: 1032, _PACKBITS: 64}
_PADDING = 1  # bytes after uncompressed data: parts begin at even places
_NO_PREDICTOR, _FLOATING_POINT = 1, 3
_HIGHEST_BIT_FIRST, _LOWEST_BIT_FIRST = 1, 2
# width, height, bits, compression, black is 0, and of the strip its place, rows and bytes
_TAGS = (256, 257, 258, 259, 262, 273, 278, 279)
_EMPTY = 0  # in parts that are not there: no data in every encoding, and in masks
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


class DamagedPartError(ValueError):
    """The bytes of a strip or tile are not its pixels."""


def _unpacked(compression: int, packed: bytes, rows: int, row: int, most_rows: int) -> bytes:
    """Unpack a strip or tile.

    Parameters
    ----------
    compression : int
        A key of `_MAX_EXPANSION`.
    packed : bytes
    rows, row : int
        Its rows, and the bytes of each.
    most_rows : int
        Rows that it may stand for: a short last strip may be filled up.

    Raises
    ------
    DamagedPartError
        Fewer bytes than the rows take, or a wrong checksum; more bytes where there is no LZW or PackBits.
    """
    size, most = rows * row, most_rows * row
    if compression in (_LZW, _PACKBITS):
        return _unpacked_by_opencv(compression, packed, rows, row)
    plain = packed if compression == _NONE else _inflated(packed, most + 1)
    if len(plain) < size:
        raise DamagedPartError(f"{len(plain)} of {size} bytes")
    if len(plain) > most + (_PADDING if compression == _NONE else 0):
        raise DamagedPartError(f"more than {size} bytes")
    return plain


def _inflated(packed: bytes, most: int) -> bytes:
    """Undo Deflate, and hold the data against the checksum at their end."""
    inflater = zlib.decompressobj()
    try:
        plain = inflater.decompress(packed, most)
    except zlib.error as error:
        raise DamagedPartError(str(error)) from None
    if not inflater.eof and len(plain) < most:
        raise DamagedPartError(f"they end after {len(plain)} bytes")
    return plain


def _unpacked_by_opencv(compression: int, packed: bytes, rows: int, row: int) -> bytes:
    """Undo LZW or PackBits; imagecodecs' decoder for LZW crashes on damaged data."""
    # OpenCV refuses data that end too early in pictures of 16 bits alone: two bytes, or two rows, are a pixel
    odd = rows * row % 2
    if odd:  # a further row, of zeros, comes first
        packed = _packed_zero(compression, packed) * row + packed
    width, height = (row, (rows + odd) // 2) if row % 2 else (row // 2, rows)
    pixels = _decoded_picture(compression, packed, width, height)
    if pixels is None:
        raise DamagedPartError(f"they are not {rows * row} bytes")
    return pixels.astype("<u2", copy=False).tobytes()[odd * row :]


def _packed_zero(compression: int, packed: bytes) -> bytes:
    """Pack one byte, 0, to stand before packed data."""
    if compression == _PACKBITS:
        return b"\0\0"  # a run of one
    # 8 codes of 9 bits: the 0, and on both sides of it 256, which clears the table. Data of old LZW begin so,
    # and have their lowest bits first [libtiff]
    old = len(packed) > 1 and packed[0] == 0 and packed[1] % 2
    return sum(256 << 9 * place for place in range(8) if place != 1).to_bytes(9, "little" if old else "big")


def _decoded_picture(compression: int, packed: bytes, width: int, height: int) -> NDArray[Any] | None:
    """Return the pixels of 16 bits of a grey TIFF of one strip; None where OpenCV refuses it."""
    numbers = width, height, 16, compression, 1, 8 + 2 + 12 * len(_TAGS) + 4, height, len(packed)
    entries = [struct.pack("<HHII", tag, 4, 1, number) for tag, number in zip(_TAGS, numbers, strict=True)]
    file = struct.pack("<4sIH", b"II*\0", 8, len(_TAGS)) + b"".join(entries) + bytes(4) + packed
    return decoded_by_opencv(file, cv2.IMREAD_UNCHANGED)[0]


def _unpredicted_floats(plain: bytes, rows: int, dtype: np.dtype[Any], samples: int) -> bytes:
    """Undo predictor 3: the bytes of a row lie sorted by significance, highest first, as differences."""
    differences = np.frombuffer(plain, np.uint8).reshape(rows, -1, samples)
    split = np.cumsum(differences, axis=1, dtype=np.uint8).reshape(rows, dtype.itemsize, -1)
    numbers = np.ascontiguousarray(split.transpose(0, 2, 1)).view(dtype.newbyteorder(">"))
    return numbers.astype(dtype).tobytes()


def _decoded_parts(page: Any, shape: tuple[int, ...], part: tuple[int, int], data: bytes) -> NDArray[Any]:
    """Decode strips or tiles into their places.

    Parameters
    ----------
    page : tifffile.TiffPage
        Its tags have been checked; those of what is undone here are changed.
    shape : tuple of int
        (planes, H, W, channels of a plane) of the image.
    part : tuple of int
        Rows and columns of a strip or tile.
    data : bytes
        The file.

    Raises
    ------
    DamagedPartError
    """
    _, height, width, samples = shape
    down, across = part
    row = -(-across * samples * int(page.bitspersample) // 8)
    compression = int(page.compression)
    bits = _REVERSED if page.fillorder == _LOWEST_BIT_FIRST else None
    page.compression, page.fillorder = _NONE, _HIGHEST_BIT_FIRST  # of the bytes that it is given
    dtype = page.dtype.newbyteorder(page.parent.byteorder)
    floats = page.predictor == _FLOATING_POINT and dtype.kind == "f"
    if floats:
        page.predictor = _NO_PREDICTOR
    values = np.full(shape, _EMPTY, page.dtype.newbyteorder("="))
    for index, (offset, count) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        if count == 0:  # as GDAL leaves them out
            continue
        _, (plane, _, top, left, _), (_, rows, _, _) = page.decode(None, index)
        place = values[plane, top : top + down, left : left + across]
        packed = data[offset : offset + count].translate(bits)
        plain = _unpacked(compression, packed, rows, row, down)
        if floats:
            plain = _unpredicted_floats(plain[: rows * row], rows, dtype, samples)
        place[:] = page.decode(plain, index)[0][0, : height - top, : width - left]
    return values


SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_WHITE_IS_ZERO, _RGB, _PALETTE, _LUMA_CHROMA = 0, 2, 3, 6
_OPACITY = ((1,), (2,))  # what the channels beside grey may be
_CHUNKY = 1
_LARGE_TILE = 2**22  # pixels; a small image may lie in one large tile
_NOT_A_PAGE_OF_ITS_OWN = 0b101  # a reduced copy, or a mask, of another page
_GDAL_NODATA = 42113
_WRITTEN: dict[str, Any] = {"photometric": "minisblack", "metadata": None, "software": False}
# what tifffile logs about damage is raised here
logging.getLogger("tifffile").addHandler(logging.NullHandler())


def decode_tiff(data: bytes) -> Stored:
    """Return the numbers of a single-channel TIFF file, as they are stored; of several pages the first."""
    with _first_page(data) as (file, page):
        if page.samplesperpixel != 1 or page.photometric == _PALETTE:
            what = "a palette" if page.photometric == _PALETTE else f"{page.samplesperpixel} channels"
            raise InputError(f"is a colour image ({what}); {COLOUR_REMEDY}")
        values = native(_pixels(page, data)[..., 0])
        if values.dtype.kind == "b" and page.photometric == _WHITE_IS_ZERO:  # bits are a mask, as it is shown
            values = ~values
        return Stored(values, "tiff", nodata=_nodata(page), note=_note(file), text=page.description)


def picture(data: bytes) -> NDArray[Any]:
    """Return the pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    with _first_page(data) as (file, page):
        if _note(file):
            raise InputError("holds several pages; save the view that is meant as a file of its own")
        # tifffile turns the luma and chroma of JPEG into RGB
        as_rgb = page.photometric == _RGB or (page.photometric, page.compression) == (_LUMA_CHROMA, _JPEG)
        colour = as_rgb and page.samplesperpixel >= 3
        grey = page.samplesperpixel == 1 or (page.samplesperpixel == 2 and page.extrasamples in _OPACITY)
        if not (colour or grey) or page.photometric == _PALETTE:
            raise InputError("is neither a grey nor an RGB TIFF")
        pixels = _pixels(page, data)
        if pixels.dtype not in (np.uint8, np.uint16):
            raise InputError(f"holds {pixels.dtype} numbers; a camera image has 8 or 16 bits a channel")
        return native(pixels[..., 2::-1] if colour else pixels[..., 0])


def encode_tiff(values: NDArray[Any], nodata: tuple[float, ...] = (), description: str = "") -> bytes:
    """Return a single-page TIFF file; not compressed, so that its bytes depend on no library.

    `description` goes to the tag of that name, in ASCII.
    """
    import tifffile

    tags = [(_GDAL_NODATA, "s", 0, f"{nodata[0]:.17g}", True)] if nodata else []
    buffer = io.BytesIO()
    tifffile.imwrite(buffer, values, description=description or None, extratags=tags, **_WRITTEN)
    return buffer.getvalue()


@contextlib.contextmanager
def _first_page(data: bytes) -> Iterator[tuple[Any, Any]]:
    """Yield the file and its first page; whatever the tags make one stumble over becomes an InputError."""
    import tifffile  # only those who have TIFF files wait for it

    try:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            yield file, file.pages[0]
    except InputError:
        raise
    except Exception:  # noqa: BLE001 (tifffile has no one error for damaged tags)
        raise InputError("is a damaged or truncated TIFF") from None


def _pixels(page: Any, data: bytes) -> NDArray[Any]:
    """Return the numbers of one page; shape (H, W, channels)."""
    width, height, samples = int(page.imagewidth), int(page.imagelength), int(page.samplesperpixel)
    if int(page.imagedepth) != 1:
        raise InputError(f"is a volume of {page.imagedepth} slices, not a 2-D image")
    if page.dtype is None or page.dtype.kind not in "biuf":
        raise InputError("its pixels are no real numbers")
    _require_size(page, width, height, data)
    across, down = _part_size(page)
    chunky = samples == 1 or page.planarconfig == _CHUNKY
    planes = 1 if chunky else samples
    parts = -(-width // across) * -(-height // down) * planes
    if len(page.dataoffsets) != parts:
        raise InputError(f"is a damaged TIFF: {len(page.dataoffsets)} parts, not {parts}")
    shape = (planes, height, width, samples // planes)
    how = f"compression {int(page.compression)}, {page.bitspersample} bits a number"
    try:
        with decoding():
            if int(page.compression) in _MAX_EXPANSION:
                values = _decoded_parts(page, shape, (down, across), data)
            else:  # rare ones, and rare bit depths, may need imagecodecs
                page.nodata = _EMPTY
                values = page.asarray().reshape(shape)
    except DamagedPartError as error:
        raise InputError(f"is a damaged TIFF: its compressed data are wrong ({error})") from None
    except Exception as error:  # noqa: BLE001 (of tifffile, imagecodecs, OpenCV or NumPy)
        missing = isinstance(error, ImportError) or "imagecodecs" in str(error)
        hint = ": pip install imagecodecs" if missing else ""
        raise InputError(f"its pixels cannot be decoded ({how}){hint}") from None
    return values[0] if chunky else np.moveaxis(values[..., 0], 0, -1)


def _part_size(page: Any) -> tuple[int, int]:
    """Columns and rows of a strip or tile, pixels."""
    if not page.is_tiled:
        return int(page.imagewidth), min(int(page.rowsperstrip), int(page.imagelength))
    across, down = int(page.tilewidth), int(page.tilelength)
    if across * down > 2 * page.imagewidth * page.imagelength + _LARGE_TILE:
        size = f"{page.imagewidth} x {page.imagelength}"
        raise InputError(f"is a damaged TIFF: tiles of {across} x {down} for {size} pixels")
    return across, down


def _require_size(page: Any, width: int, height: int, data: bytes) -> None:
    """Refuse parts beyond the file's end, and sizes that the bytes cannot hold."""
    stored = sum(page.databytecounts)
    for offset, count in zip(page.dataoffsets, page.databytecounts, strict=True):
        if offset + count > len(data):
            raise InputError(f"is truncated: its pixels end at byte {offset + count} of {len(data)}")
    samples = int(page.samplesperpixel)
    require_decoded_fits(width, height, samples * page.dtype.itemsize, len(data))
    if not all(page.databytecounts):
        return  # a sparse file: parts without a place hold no data [GDAL]
    needed = width * height * samples * int(page.bitspersample) // 8
    if needed > _MAX_EXPANSION.get(int(page.compression), needed) * stored:
        raise InputError(f"its header claims {width} x {height} pixels, more than {stored} bytes can hold")


def _nodata(page: Any) -> tuple[float, ...]:
    """GDAL's no-data tag, a number as text."""
    try:
        return (float(str(page.tags.valueof(_GDAL_NODATA, "")).strip("\0 ")),)
    except ValueError:
        return ()


def _note(file: Any) -> str:
    """Return what to tell a user who gave several pages."""
    with contextlib.suppress(IndexError):  # there is but one
        if not int(file.pages[1].subfiletype) & _NOT_A_PAGE_OF_ITS_OWN:
            return "holds several pages; the first is read"
    return ""
