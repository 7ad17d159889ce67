"""PNG [ISO/IEC 15948] through OpenCV, which is shown only files that are whole.

libpng writes its complaints straight to the terminal, and a header may claim any size. So the chunks are
walked first: signature, lengths, checksums and the size that the compressed data can reach.
"""

import struct
import zlib
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, OutputError
from rollcli.files.stored import PICTURE_FLAGS, require_pixels_fit

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, COLOUR, PALETTE, GREY_ALPHA, COLOUR_ALPHA = 0, 2, 3, 4, 6
_CHANNELS = {GREY: 1, COLOUR: 3, PALETTE: 1, GREY_ALPHA: 2, COLOUR_ALPHA: 4}
_DEPTHS = {
    GREY: (1, 2, 4, 8, 16),
    PALETTE: (1, 2, 4, 8),
    COLOUR: (8, 16),
    GREY_ALPHA: (8, 16),
    COLOUR_ALPHA: (8, 16),
}
# what decides the pixels; the rest (colour profiles, times, texts, orientation) only makes libpng complain
_DECISIVE = {b"IHDR", b"PLTE", b"IDAT", b"IEND"}
_MAX_INFLATION = 1032  # deflate cannot expand further
_SMALL = 1 << 16


class _Header(NamedTuple):
    width: int
    height: int
    depth: int
    colour: int
    compression: int
    filtering: int
    interlace: int


def grey_values(data: bytes, name: str) -> NDArray[Any]:
    """The values of a single-channel PNG as they are stored; shape (H, W), uint8 or uint16.

    A palette of greys stands for its greys; fully transparent pixels hold no data and become 0.
    """
    header, pixels = _decode(data, name, cv2.IMREAD_UNCHANGED)
    if header.colour == GREY:
        # OpenCV spreads 1, 2 and 4 bits over 0..255
        return pixels if header.depth >= 8 else pixels // (255 // (2**header.depth - 1))
    if header.colour == GREY_ALPHA:
        return np.where(pixels[..., -1] > 0, pixels[..., 0], 0).astype(pixels.dtype)
    grey: NDArray[Any] = pixels[..., 0]
    if header.colour == PALETTE and bool((pixels == grey[..., None]).all()):
        return np.ascontiguousarray(grey)
    what = "a palette" if header.colour == PALETTE else f"{_CHANNELS[header.colour]} channels"
    raise InputError(f"{name}: is a colour image ({what}); a disparity map has one channel")


def picture(data: bytes, name: str) -> NDArray[Any]:
    """The pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    return _decode(data, name, PICTURE_FLAGS)[1]


def encode_png(values: NDArray[Any]) -> bytes:
    """A PNG file of (H, W) or BGR (H, W, 3) values, uint8 or uint16."""
    if values.dtype not in (np.uint8, np.uint16):
        raise OutputError(f"a PNG holds uint8 or uint16, not {values.dtype}: write TIFF or NPY instead")
    return bytes(cv2.imencode(".png", values)[1])


def _decode(data: bytes, name: str, flags: int) -> tuple[_Header, NDArray[Any]]:
    header, checked = _checked(data, name)
    pixels = cv2.imdecode(np.frombuffer(checked, np.uint8), flags)
    if pixels is None:
        raise InputError(f"{name}: is a damaged PNG: its pixel data are wrong")
    return header, pixels


def _checked(data: bytes, name: str) -> tuple[_Header, bytes]:
    """The header, and a file of only the chunks that decide the pixels; InputError if it is not whole."""
    view, position, kept, compressed = memoryview(data), len(SIGNATURE), [memoryview(SIGNATURE)], 0
    kind = header = None
    while kind != b"IEND":
        if position + 12 > len(data):
            raise InputError(f"{name}: is a truncated PNG: it ends after {len(data)} bytes")
        length = int.from_bytes(view[position : position + 4], "big")
        kind = data[position + 4 : position + 8]
        end = position + 12 + length
        if end > len(data):
            raise InputError(f"{name}: is a truncated PNG: it ends after {len(data)} bytes")
        if zlib.crc32(view[position + 4 : end - 4]) != int.from_bytes(view[end - 4 : end], "big"):
            raise InputError(f"{name}: is a damaged PNG: wrong checksum {position} bytes in")
        if header is None:
            header = _parse_header(kind, data[position + 8 : end - 4], name)
        if kind in _DECISIVE:
            kept.append(view[position:end])
        compressed += length if kind == b"IDAT" else 0
        position = end
    assert header is not None
    _require_size(header, compressed, name)
    return header, b"".join(kept)


def _parse_header(kind: bytes, body: bytes, name: str) -> _Header:
    if kind != b"IHDR" or len(body) != 13:
        raise InputError(f"{name}: is a damaged PNG: it does not start with a header")
    header = _Header(*struct.unpack(">IIBBBBB", body))
    if header.depth not in _DEPTHS.get(header.colour, ()) or header.interlace > 1:
        raise InputError(f"{name}: is a damaged PNG: its header makes no sense")
    if header.width == 0 or header.height == 0:
        raise InputError(f"{name}: has no pixels ({header.width} x {header.height})")
    require_pixels_fit(header.width, header.height, name)
    return header


def _require_size(header: _Header, compressed: int, name: str) -> None:
    needed = header.width * header.height * header.depth * _CHANNELS[header.colour] // 8
    if needed > _MAX_INFLATION * compressed:
        raise InputError(
            f"{name}: its header claims {header.width} x {header.height} pixels, "
            f"more than {compressed} bytes of PNG data can hold"
        )
