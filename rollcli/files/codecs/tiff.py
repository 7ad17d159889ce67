"""TIFF [TIFF 6.0]: tifffile reads the tags; the pixels are decoded strip by strip."""

import contextlib
import io
import logging
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.codecs.png import decoding
from rollcli.files.codecs.raw_map import (
    COLOUR_REMEDY,
    Stored,
    imagecodecs,
    native,
    require_decoded_fits,
    require_pixels,
)

_CLEAR, _END, _FIRST = 256, 257, 258
_TABLE = 4096

# The width of a code depends on its place after the last clear alone: the table grows by one entry a code
_PLACES = np.arange(_TABLE - _FIRST + 2)
_WIDTHS = 9 + (_PLACES >= 254) + (_PLACES >= 766) + (_PLACES >= 1790)
_OFFSETS = np.concatenate([[0], np.cumsum(_WIDTHS)])


class DamagedPartError(ValueError):
    """The bytes of a strip or tile are not its pixels."""


def decode_lzw(packed: bytes, most: int) -> bytes:
    """Unpack what the bytes stand for, but no more than `most` bytes.

    Raises
    ------
    DamagedPartError
        A code that cannot occur.
    """
    codes, parents = _codes(packed)
    literal = codes < _CLEAR
    lengths, roots = _chains(np.where(literal, np.arange(len(codes), dtype=np.int32), parents), ~literal)
    used = int(np.searchsorted(np.cumsum(lengths, dtype=np.int64), most)) + 1
    # a string is its parent's plus the first letter of what followed the parent
    followers = np.where(literal, 0, parents + 1)
    letters = np.where(literal, codes, codes[roots[followers]]).astype(np.uint8)
    return _spelled(letters, parents, lengths[:used])[:most].tobytes()


def _codes(packed: bytes) -> tuple[NDArray[Any], NDArray[Any]]:
    """Find all codes but clear and end, and for each the position of the code that its string extends."""
    bits = 8 * len(packed)
    padded = np.frombuffer(packed + bytes(3), np.uint8).astype(np.int32)
    window = padded[:-2] << 16 | padded[1:-1] << 8 | padded[2:]
    blocks, parents, done, position = [], [], 0, 0
    while position + 9 <= bits:
        fits = int(np.searchsorted(_OFFSETS, bits - position, side="right")) - 1
        starts = position + _OFFSETS[:fits]
        widths = _WIDTHS[:fits]
        codes = (window[starts >> 3] >> (24 - (starts & 7) - widths)) & ((1 << widths) - 1)
        stops = np.flatnonzero((codes == _CLEAR) | (codes == _END))
        if len(stops) == 0 and fits == len(_WIDTHS):
            raise DamagedPartError("table overflow")
        count = int(stops[0]) if len(stops) else fits
        block = codes[:count].astype(np.int32)
        if np.any(block >= _FIRST + _PLACES[:count]):
            raise DamagedPartError("code not in the table")
        blocks.append(block)
        parents.append(block - _FIRST + done)
        done += count
        if not len(stops) or codes[count] == _END:
            break
        position = int(starts[count]) + int(widths[count])
        if len(blocks) > 64 + len(packed) // 128:
            raise DamagedPartError("too many tables")  # each costs the same time, however short it is
    if done == 0:
        raise DamagedPartError("no data")
    return np.concatenate(blocks), np.concatenate(parents)


def _chains(parents: NDArray[Any], depth: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the length of each chain of parents, and its root: each round doubles how far it sees."""
    depth = depth.astype(np.int32)
    while np.any(further := depth[parents]):
        depth = depth + further
        parents = parents[parents]
    return depth + 1, parents


def _spelled(letters: NDArray[np.uint8], parents: NDArray[Any], lengths: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the strings one after the other, each written from its last letter to its first."""
    ends = np.cumsum(lengths, dtype=np.int64)
    text = np.empty(int(ends[-1]), np.uint8)
    current: NDArray[Any] = np.arange(len(lengths), dtype=np.int32)
    place = ends - 1
    left = lengths
    while len(current):
        text[place] = letters[current]
        going = left > 1
        current, place, left = parents[current[going]], place[going] - 1, left[going] - 1
    return text


_NONE, _LZW, _DEFLATE, _OLD_DEFLATE, _PACKBITS = 1, 5, 8, 32946, 32773
# how many bytes one byte can stand for
MAX_EXPANSION = {_NONE: 1, _LZW: 2732, _DEFLATE: 1032, _OLD_DEFLATE: 1032, _PACKBITS: 64}
_PADDING = 1  # bytes after uncompressed data: parts begin at even places


def unpacked(compression: int, packed: bytes, size: int, most: int) -> bytes:
    """Unpack a strip or tile.

    Parameters
    ----------
    compression : int
        A key of `MAX_EXPANSION`.
    packed : bytes
    size : int
        Bytes that its pixels take.
    most : int
        Bytes that it may stand for: a short last strip may be filled up.

    Raises
    ------
    DamagedPartError
        Fewer or more bytes, or a wrong checksum.
    """
    plain = _fast(compression, packed, most)
    if plain is not None and len(plain) in (size, most):
        return plain
    try:
        plain = _UNPACK[compression](packed, most + 1)
    except zlib.error as error:
        raise DamagedPartError(str(error)) from None
    if len(plain) < size:
        raise DamagedPartError(f"{len(plain)} of {size} bytes")
    if len(plain) > most + (_PADDING if compression == _NONE else 0):
        raise DamagedPartError(f"more than {size} bytes")
    return plain


def _fast(compression: int, packed: bytes, most: int) -> bytes | None:
    """Unpack by imagecodecs; None where it is not installed or finds something wrong."""
    if compression in (_NONE, _LZW) or (codecs := imagecodecs()) is None:
        return None  # its LZW decoder crashes on damaged data
    decode = codecs.packbits_decode if compression == _PACKBITS else codecs.deflate_decode
    try:
        plain: bytes = decode(packed, out=most + 1)
    except (RuntimeError, ValueError):  # its errors are RuntimeErrors
        return None
    return plain


def _inflated(packed: bytes, most: int) -> bytes:
    """Undo Deflate, and hold the data against the checksum at their end."""
    inflater = zlib.decompressobj()
    plain = inflater.decompress(packed, most)
    if not inflater.eof and len(plain) < most:
        raise DamagedPartError(f"they end after {len(plain)} bytes")
    return plain


def _unpacked_bits(packed: bytes, most: int) -> bytes:
    """Undo PackBits: runs of copies and runs of repeats."""
    plain, position = bytearray(), 0
    while position < len(packed) and len(plain) < most:
        head = packed[position]
        if head < 128:
            plain += packed[position + 1 : position + 2 + head]
            position += 2 + head
        else:
            plain += packed[position + 1 : position + 2] * (257 - head if head > 128 else 0)
            position += 2 if head > 128 else 1
    return bytes(plain)


_UNPACK: dict[int, Callable[[bytes, int], bytes]] = {
    _NONE: lambda packed, _: packed,
    _LZW: decode_lzw,
    _DEFLATE: _inflated,
    _OLD_DEFLATE: _inflated,
    _PACKBITS: _unpacked_bits,
}


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


SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_RGB, _PALETTE = 2, 3
_CHUNKY = 1
_LARGE_TILE = 2**22  # pixels; a small image may lie in one large tile
_NOT_A_PAGE_OF_ITS_OWN = 0b101  # a reduced copy, or a mask, of another page
_GDAL_NODATA = 42113
_DESCRIPTION = 270
# how tifffile fails on damaged tags: it has no one error for that
_DAMAGE = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RuntimeError,
    MemoryError,
    ImportError,
    struct.error,
    zlib.error,
)
# what tifffile logs about damage is raised here
logging.getLogger("tifffile").addHandler(logging.NullHandler())


def decode_tiff(data: bytes, name: str) -> Stored:
    """Return the numbers of a single-channel TIFF file, as they are stored; of several pages the first."""
    with _first_page(data, name) as (file, page):
        if page.samplesperpixel != 1 or page.photometric == _PALETTE:
            what = "a palette" if page.photometric == _PALETTE else f"{page.samplesperpixel} channels"
            raise InputError(f"{name}: is a colour image ({what}); {COLOUR_REMEDY}")
        values = native(_pixels(page, data, name)[..., 0])
        return Stored(values, "tiff", nodata=_nodata(page), note=_note(file, name), text=_text(page))


def picture(data: bytes, name: str) -> NDArray[Any]:
    """Return the pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    with _first_page(data, name) as (_, page):
        colour = page.photometric == _RGB and page.samplesperpixel >= 3
        if not (colour or page.samplesperpixel == 1) or page.photometric == _PALETTE:
            raise InputError(f"{name}: is neither a grey nor an RGB TIFF")
        pixels = _pixels(page, data, name)
        if pixels.dtype not in (np.uint8, np.uint16):
            raise InputError(
                f"{name}: holds {pixels.dtype} numbers; a camera image has 8 or 16 bits a channel"
            )
        return native(pixels[..., 2::-1] if colour else pixels[..., 0])


def encode_tiff(values: NDArray[Any], nodata: tuple[float, ...] = (), description: str = "") -> bytes:
    """Return a single-page TIFF file; not compressed, so that its bytes depend on no library.

    `description` goes to the tag of that name, in ASCII.
    """
    import tifffile

    tags = [(_GDAL_NODATA, "s", 0, f"{nodata[0]:.17g}", True)] if nodata else []
    buffer = io.BytesIO()
    tifffile.imwrite(
        buffer,
        values,
        photometric="minisblack",
        metadata=None,
        description=description or None,
        software=False,
        extratags=tags,
    )
    return buffer.getvalue()


@contextlib.contextmanager
def _first_page(data: bytes, name: str) -> Iterator[tuple[Any, Any]]:
    """Yield the file and its first page; whatever the tags make one stumble over becomes an InputError."""
    import tifffile  # only those who have TIFF files wait for it

    try:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            yield file, file.pages[0]
    except (tifffile.TiffFileError, *_DAMAGE):
        raise InputError(f"{name}: is a damaged or truncated TIFF") from None


def _pixels(page: Any, data: bytes, name: str) -> NDArray[Any]:
    """Return the numbers of one page; shape (H, W, channels)."""
    width, height, samples = int(page.imagewidth), int(page.imagelength), int(page.samplesperpixel)
    require_pixels(width, height, name)
    if int(page.imagedepth) != 1:
        raise InputError(f"{name}: is a volume of {page.imagedepth} slices, not a 2-D image")
    if page.dtype is None or page.dtype.kind not in "biuf":
        raise InputError(f"{name}: its pixels are no real numbers")
    _require_size(page, width * height * samples, data, name)
    across, down = _part_size(page, name)
    chunky = samples == 1 or page.planarconfig == _CHUNKY
    parts = -(-width // across) * -(-height // down) * (1 if chunky else samples)
    if len(page.dataoffsets) != parts:
        raise InputError(f"{name}: is a damaged TIFF: {len(page.dataoffsets)} parts, not {parts}")
    known = int(page.compression) in MAX_EXPANSION and int(page.fillorder) == 1
    try:
        if known and chunky and int(page.bitspersample) in (8, 16, 32, 64):
            empty = next(iter(_nodata(page)), 0.0)
            return decode_parts(page, (height, width, samples), (down, across), data, empty)
        if known:
            check_parts(page, (down, across, samples if chunky else 1), data)
    except DamagedPartError as error:
        raise InputError(f"{name}: is a damaged TIFF: its compressed data are wrong ({error})") from None
    values = _decoded_by_tifffile(page, name)
    if chunky:
        return values.reshape(height, width, samples)
    return np.moveaxis(values.reshape(samples, height, width), 0, -1)  # one plane a channel


def _part_size(page: Any, name: str) -> tuple[int, int]:
    """Columns and rows of a strip or tile, pixels."""
    if not page.is_tiled:
        return int(page.imagewidth), min(int(page.rowsperstrip), int(page.imagelength))
    across, down = int(page.tilewidth), int(page.tilelength)
    if across * down > 2 * page.imagewidth * page.imagelength + _LARGE_TILE:
        size = f"{page.imagewidth} x {page.imagelength}"
        raise InputError(f"{name}: is a damaged TIFF: tiles of {across} x {down} for {size} pixels")
    return across, down


def _require_size(page: Any, numbers: int, data: bytes, name: str) -> None:
    """Refuse parts beyond the file's end, and sizes that the bytes cannot hold."""
    stored = sum(page.databytecounts)
    for offset, count in zip(page.dataoffsets, page.databytecounts, strict=True):
        if offset + count > len(data):
            raise InputError(f"{name}: is truncated: its pixels end at byte {offset + count} of {len(data)}")
    width, height = int(page.imagewidth), int(page.imagelength)
    pixel_bytes = numbers // (width * height) * page.dtype.itemsize
    require_decoded_fits(width, height, pixel_bytes, len(data), name)
    if not all(page.databytecounts):
        return  # a sparse file: parts without a place hold no data [GDAL]
    needed = numbers * int(page.bitspersample) // 8
    if needed > MAX_EXPANSION.get(int(page.compression), needed) * stored:
        raise InputError(
            f"{name}: its header claims {width} x {height} pixels, more than {stored} bytes can hold"
        )


def _decoded_by_tifffile(page: Any, name: str) -> NDArray[Any]:
    """Rare compressions, bit depths and layouts, which may need imagecodecs."""
    try:
        with decoding():
            values: NDArray[Any] = page.asarray()
    except _DAMAGE as error:
        how = f"compression {int(page.compression)}, {page.bitspersample} bits a number"
        missing = isinstance(error, ImportError) or "imagecodecs" in str(error)
        hint = ": pip install imagecodecs" if missing else ""
        raise InputError(f"{name}: its pixels cannot be decoded ({how}){hint}") from None
    return values


def _nodata(page: Any) -> tuple[float, ...]:
    """GDAL's no-data tag, a number as text."""
    tag = page.tags.get(_GDAL_NODATA)
    try:
        return () if tag is None else (float(str(tag.value).strip("\0 ")),)
    except ValueError:
        return ()


def _text(page: Any) -> str:
    """Return the description."""
    tag = page.tags.get(_DESCRIPTION)
    return "" if tag is None else str(tag.value)


def _note(file: Any, name: str) -> str:
    """Return what to tell a user who gave several pages."""
    try:
        second = file.pages[1]
    except IndexError:
        return ""
    if int(second.subfiletype) & _NOT_A_PAGE_OF_ITS_OWN:
        return ""
    return f"{name} holds several pages; the first is read"
