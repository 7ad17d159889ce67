"""TIFF: tifffile reads the tags, the pixels are decoded by `tiff_parts` [TIFF 6.0].

Every file is checked before memory is taken, and comes out the same whatever is installed.
"""

import io
import logging
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.codecs.mute_stderr import decoding
from rollcli.files.codecs.raw_map import COLOUR_REMEDY, Stored, native, require_decoded_fits
from rollcli.files.codecs.tiff_parts import check_parts, decode_parts
from rollcli.files.codecs.unpack import MAX_EXPANSION, DamagedPartError

SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_RGB, _PALETTE = 2, 3
_CHUNKY = 1
_LARGE_TILE = 2**22  # pixels; a small image may lie in one large tile
_NOT_A_PAGE_OF_ITS_OWN = 0b101  # a reduced copy, or a mask, of another page
_GDAL_NODATA = 42113
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

    def decode(file: Any, page: Any) -> Stored:
        if page.samplesperpixel != 1 or page.photometric == _PALETTE:
            what = "a palette" if page.photometric == _PALETTE else f"{page.samplesperpixel} channels"
            raise InputError(f"{name}: is a colour image ({what}); {COLOUR_REMEDY}")
        values = _pixels(page, data, name)[..., 0]
        return Stored(native(values), "tiff", nodata=_nodata(page), note=_note(file, name))

    decoded: Stored = _with_first_page(data, name, decode)
    return decoded


def picture(data: bytes, name: str) -> NDArray[Any]:
    """Return the pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""

    def decode(_: Any, page: Any) -> NDArray[Any]:
        colour = page.photometric == _RGB and page.samplesperpixel >= 3
        if not (colour or page.samplesperpixel == 1) or page.photometric == _PALETTE:
            raise InputError(f"{name}: is neither a grey nor an RGB TIFF")
        pixels = _pixels(page, data, name)
        if pixels.dtype not in (np.uint8, np.uint16):
            raise InputError(
                f"{name}: holds {pixels.dtype} numbers; a camera image has 8 or 16 bits a channel"
            )
        return native(pixels[..., 2::-1] if colour else pixels[..., 0])

    pixels: NDArray[Any] = _with_first_page(data, name, decode)
    return pixels


def encode_tiff(values: NDArray[Any], nodata: tuple[float, ...] = ()) -> bytes:
    """Return a single-page TIFF file; not compressed, so that its bytes depend on no library."""
    import tifffile

    tags = [(_GDAL_NODATA, "s", 0, f"{nodata[0]:.17g}", True)] if nodata else []
    buffer = io.BytesIO()
    tifffile.imwrite(
        buffer,
        values,
        photometric="minisblack",
        metadata=None,
        software=False,
        extratags=tags,
    )
    return buffer.getvalue()


def _with_first_page(data: bytes, name: str, decode: Any) -> Any:
    """decode(file, page) of the first page; whatever the tags make it stumble over becomes an InputError."""
    import tifffile  # only those who have TIFF files wait for it

    try:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            return decode(file, file.pages[0])
    except (tifffile.TiffFileError, *_DAMAGE):
        raise InputError(f"{name}: is a damaged or truncated TIFF") from None


def _pixels(page: Any, data: bytes, name: str) -> NDArray[Any]:
    """Return the numbers of one page; shape (H, W, channels)."""
    width, height, samples = int(page.imagewidth), int(page.imagelength), int(page.samplesperpixel)
    if width == 0 or height == 0:
        raise InputError(f"{name}: has no pixels ({width} x {height})")
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


def _note(file: Any, name: str) -> str:
    """Return what to tell a user who gave several pages."""
    try:
        second = file.pages[1]
    except IndexError:
        return ""
    if int(second.subfiletype) & _NOT_A_PAGE_OF_ITS_OWN:
        return ""
    return f"{name} holds several pages; the first is read"
