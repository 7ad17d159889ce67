"""PNG [ISO/IEC 15948]: a fast path for grey of 8 and 16 bits, OpenCV for the rest; files must be whole."""

import contextlib
import os
import struct
import tempfile
import zlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.codecs.arrays import COLOUR_REMEDY, Stored, require_decoded_fits

# a camera image as it lies in the file, grey or BGR: turning it by its EXIF tag would break rectification
PICTURE_FLAGS = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
_MOST = 4000  # bytes of it that are looked at
_sink: int | None = None


def silence_decoders() -> None:
    """Let nothing that `decoding` surrounds reach the terminal, from now on.

    For processes that work on frames and on nothing else: what another thread says meanwhile is taken too.
    """
    global _sink
    if _sink is None:
        try:
            with tempfile.TemporaryFile() as file:
                _sink = os.dup(file.fileno())
        except OSError:  # no room for temporary files: the verdict is lost, and the terminal stays clean
            _sink = os.open(os.devnull, os.O_RDWR)


@contextlib.contextmanager
def decoding() -> Iterator[list[str]]:
    """Turn stderr, as C libraries know it, away for a moment; nothing at all where nobody asked for it.

    Once that is over, the list holds what was printed; it stays empty when `silence_decoders` was not called.
    """
    printed = list[str]()
    try:
        terminal = None if _sink is None else os.dup(2)
    except OSError:  # stderr is closed: nothing can be printed
        terminal = None
    if _sink is None or terminal is None:
        yield printed
        return
    os.dup2(_sink, 2)
    try:
        yield printed
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)
        printed.append(_taken(_sink))


def _taken(sink: int) -> str:
    """Return what was printed into the file, which is empty again after that."""
    if not os.lseek(sink, 0, os.SEEK_CUR):
        return ""
    os.lseek(sink, 0, os.SEEK_SET)
    text = os.read(sink, _MOST).decode("utf-8", "replace")
    os.lseek(sink, 0, os.SEEK_SET)
    os.truncate(sink, 0)
    return text


def decoded_by_opencv(data: bytes, flags: int) -> tuple[NDArray[Any] | None, str]:
    """Return the pixels of a file, None where OpenCV refuses it; and what it or its libraries printed."""
    pixels = None
    with decoding() as printed, contextlib.suppress(cv2.error):  # a size beyond OpenCV's limits
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    return pixels, "".join(printed)


_SUB = 1
_FIRST_ROWS = 4  # tell of most files that have others; to unpack the whole takes a fifth of OpenCV's time
_FULL_WINDOW = b"\x78"  # of less OpenCV's zlib minds references that go further back; other decoders do not
# Bytes after a stream that are looked for; more would have to end in its checksum. To look through the whole
# stream takes a fortieth of OpenCV's time
_MOST_AFTER = 1 << 16


@lru_cache(maxsize=1)
def imagecodecs() -> Any:
    """Return the package, of the extra `fast`, or None where it is not installed."""
    try:
        import imagecodecs as package
    except ImportError:
        return None
    return package


def decode_grey(packed: bytes, width: int, height: int, depth: int) -> NDArray[Any] | None:
    """Decode the pixel data of a grey PNG of 8 or 16 bits that is not interlaced, as OpenCV writes it.

    Parameters
    ----------
    packed : bytes
        The rows, as a zlib stream.
    width, height, depth : int
        Pixels, and bits of each.

    Returns
    -------
    ndarray of uint8 or uint16, shape (H, W), or None
        None for rows of other filters than None and Sub, and where something is wrong: then the verdict of
        OpenCV counts.
    """
    if not packed.startswith(_FULL_WINDOW):
        return None
    size = depth // 8
    row = 1 + size * width  # the filter, then the bytes of each pixel
    try:
        first = zlib.decompressobj().decompress(packed, _FIRST_ROWS * row)
        if max(first[::row], default=0) > _SUB:
            return None
        plain = _inflated(packed, height * row)
    except (zlib.error, RuntimeError, ValueError):  # those of imagecodecs are RuntimeErrors
        return None
    if plain is None or plain[::row].max() > _SUB:
        return None
    # a pixel's bytes are the sums, modulo 256, of those up to it; the high one comes first
    rows = plain.reshape(height, row)
    differences = rows[:, 1:].reshape(height, width, size)[..., ::-1]
    sums = np.empty(differences.shape, np.uint8)
    codecs = imagecodecs()
    add_up = np.add.accumulate if codecs is None else codecs.delta_decode
    add_up(differences, axis=1, out=sums)
    unfiltered = rows[:, 0] != _SUB
    if unfiltered.any():
        sums[unfiltered] = differences[unfiltered]
    pixels: NDArray[Any] = sums.view(f"<u{size}")[..., 0].astype(f"u{size}", copy=False)
    return pixels


def _inflated(packed: bytes, size: int) -> NDArray[np.uint8] | None:
    """Undo Deflate; None unless this is one whole stream, and stands for so many bytes.

    Python's zlib takes half as long again as libdeflate of imagecodecs, and two thirds of OpenCV's time.
    """
    codecs = imagecodecs()
    plain: NDArray[np.uint8]
    if codecs is None:
        stream = zlib.decompressobj()
        plain = np.frombuffer(stream.decompress(packed, size + 1), np.uint8)
        is_whole = stream.eof and not stream.unused_data
    else:
        plain = codecs.deflate_decode(packed, out=np.empty(size, np.uint8))
        checksum = codecs.deflate_adler32(plain).to_bytes(4, "big")
        # libdeflate does not tell where the stream ends; its checksum does, if it is at the end alone
        is_whole = packed.endswith(checksum) and packed.rfind(checksum, -_MOST_AFTER, -1) < 0
    return plain if is_whole and len(plain) == size else None


SIGNATURE = b"\x89PNG\r\n\x1a\n"
_GREY, _COLOUR, _PALETTE, _GREY_ALPHA, _COLOUR_ALPHA = 0, 2, 3, 4, 6
_CHANNELS = {_GREY: 1, _COLOUR: 3, _PALETTE: 1, _GREY_ALPHA: 2, _COLOUR_ALPHA: 4}
_DEPTHS = {**dict.fromkeys(_CHANNELS, (8, 16)), _GREY: (1, 2, 4, 8, 16), _PALETTE: (1, 2, 4, 8)}
_TEXT_KEY = b"rollcli\0"
_MAX_SIDE = 1_000_000  # libpng's own limit
_MAX_EXPANSION = 1032  # of Deflate


class _Header(NamedTuple):
    width: int
    height: int
    depth: int
    colour: int
    compression: int
    filtering: int
    interlace: int


def decode_png(data: bytes) -> Stored:
    """Return the numbers of a single-channel PNG as they are stored, uint8 or uint16, and rollcli's text.

    A palette of greys stands for its greys; fully transparent pixels hold no data and become 0.
    """
    header, bodies, pixels = _decoded(data, cv2.IMREAD_UNCHANGED)
    if header.colour == _GREY:
        _clear_hole(header, bodies, pixels)
        if header.depth < 8:
            pixels //= _spread(header)
    elif header.colour in (_COLOUR, _COLOUR_ALPHA):
        raise InputError(f"is a colour image ({_CHANNELS[header.colour]} channels); {COLOUR_REMEDY}")
    else:
        grey = np.ascontiguousarray(pixels[..., 0])
        if header.colour == _PALETTE and (pixels[..., :3] != grey[..., None]).any():
            raise InputError(f"is a colour image (a palette); {COLOUR_REMEDY}")
        if header.colour == _GREY_ALPHA or bodies.get(b"tRNS"):
            grey[pixels[..., -1] == 0] = 0
        pixels = grey
    return Stored(pixels, "png", text=bodies.get(_TEXT_KEY, b"").decode("latin-1"))


def picture(data: bytes) -> NDArray[Any]:
    """Return the pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    return _decoded(data, PICTURE_FLAGS)[-1]


def decode_mask(data: bytes) -> NDArray[Any]:
    """Return the pixels of a mask: grey (H, W) or BGR (H, W, 3), 0 where they are fully transparent."""
    header, bodies, pixels = _decoded(data, cv2.IMREAD_UNCHANGED, mask=True)
    if header.colour in (_GREY, _COLOUR):
        _clear_hole(header, bodies, pixels)
    return np.where(pixels[..., 3:] > 0, pixels[..., :3], 0) if pixels.shape[2:] == (4,) else pixels


def _spread(header: _Header) -> int:
    """Return by how much OpenCV spreads greys of few bits, over 0..255."""
    return 255 // (2**header.depth - 1) or 1


def _clear_hole(header: _Header, bodies: Mapping[bytes, bytes], pixels: NDArray[Any]) -> None:
    """Set the pixels of the grey or colour to 0 that tRNS makes transparent."""
    hole, channels = bodies.get(b"tRNS", b""), _CHANNELS[header.colour]
    if not hole:
        return
    each = len(hole) // channels
    transparent = np.ones(pixels.shape[:2], np.bool_)
    for place in range(channels):  # OpenCV has the red last
        value = int.from_bytes(hole[place * each : (place + 1) * each], "big")
        transparent &= np.atleast_3d(pixels)[..., channels - 1 - place] == _spread(header) * value
    pixels[transparent] = 0


def encode_png(values: NDArray[Any], text: str = "") -> bytes:
    """Return a PNG file of (H, W) or BGR (H, W, 3) values, uint8 or uint16, and an ASCII text beside them."""
    file = bytes(cv2.imencode(".png", values)[1])
    if not text:
        return file
    first = len(SIGNATURE) + 25  # the header, which must be first
    return file[:first] + _chunk(b"tEXt", _TEXT_KEY + text.encode("ascii")) + file[first:]


def _decoded(
    data: bytes, flags: int, *, mask: bool = False
) -> tuple[_Header, dict[bytes, bytes], NDArray[Any]]:
    """Return header, further bodies by their kinds, and pixels; InputError if the file is not whole."""
    header, bodies, image = _chunks(data)
    width, height, depth, colour = header[:4]
    packed = b"".join(chunk[8:-4] for chunk in image)
    # what OpenCV takes for a pixel; a palette's colours are spelled out, with their opacity
    pixel_bytes = 4 if colour == _PALETTE else _CHANNELS[colour] * (2 if depth == 16 else 1)
    require_decoded_fits(width, height, pixel_bytes, len(packed), mask=mask)
    if height * ((width * depth * _CHANNELS[colour] + 7) // 8) > _MAX_EXPANSION * len(packed):
        raise InputError(
            f"its header claims {width} x {height} pixels, more than {len(packed)} bytes can hold"
        )
    if colour == _GREY and depth >= 8 and not header.interlace:
        fast = decode_grey(packed, width, height, depth)
        if fast is not None:
            return header, bodies, fast
    # a file of nothing but what decides the pixels
    start = [SIGNATURE, _chunk(b"IHDR", struct.pack(">IIBBBBB", *header))]
    if colour == _PALETTE:
        palette, colours = bodies.get(b"PLTE", b""), 2**depth
        if not palette or len(palette) % 3 or len(palette) > 3 * colours:
            raise InputError("is a damaged PNG: its palette is missing or wrong")
        # with an entry for every number that a pixel can hold
        start.append(_chunk(b"PLTE", palette.ljust(3 * colours, b"\0")))
        if transparent := bodies.get(b"tRNS"):
            start.append(_chunk(b"tRNS", transparent[:colours]))
    pixels, printed = decoded_by_opencv(b"".join([*start, *image, _chunk(b"IEND", b"")]), flags)
    if pixels is None or "libpng" in printed:
        raise InputError("is a damaged PNG: its pixel data are wrong")
    return header, bodies, pixels


def _chunks(data: bytes) -> tuple[_Header, dict[bytes, bytes], list[memoryview]]:
    """Return what decides the pixels: the header, bodies of palette and transparency, and chunks of the data.

    Among the bodies is the text that rollcli wrote beside them.
    """
    view, position = memoryview(data), len(SIGNATURE)
    header, bodies, kind = None, dict[bytes, bytes](), b""
    image: list[memoryview] = []
    while kind != b"IEND":
        end = position + 12 + int.from_bytes(view[position : position + 4], "big")
        if end > len(data) or position + 12 > len(data):
            raise InputError(f"is a truncated PNG: it ends after {len(data)} bytes")
        if zlib.crc32(view[position + 4 : end - 4]) != int.from_bytes(view[end - 4 : end], "big"):
            raise InputError(f"is a damaged PNG: wrong checksum {position} bytes in")
        kind, body = data[position + 4 : position + 8], view[position + 8 : end - 4]
        if (header is None) != (kind == b"IHDR"):
            raise InputError("is a damaged PNG: its header is not first, or not alone")
        if kind == b"IDAT":
            image.append(view[position:end])
        elif kind == b"IHDR":
            header = _header(bytes(body))
        elif kind in (b"PLTE", b"tRNS"):
            bodies[kind] = bytes(body)
        elif kind == b"tEXt" and not image and body[: len(_TEXT_KEY)] == _TEXT_KEY:
            bodies.setdefault(_TEXT_KEY, bytes(body[len(_TEXT_KEY) :]))
        elif kind != b"IEND" and kind[:1].isupper():
            raise InputError(f"is no standard PNG: chunk {kind.decode('latin-1')!r} is unknown")
        position = end
    assert header is not None
    return header, bodies, image


def _header(body: bytes) -> _Header:
    if len(body) != 13:
        raise InputError(f"is a damaged PNG: its header has {len(body)} bytes, not 13")
    header = _Header(*struct.unpack(">IIBBBBB", body))
    sane = header.depth in _DEPTHS.get(header.colour, ()) and header.interlace <= 1
    if not sane or header.compression or header.filtering or max(header[:2]) > _MAX_SIDE:
        raise InputError("is a damaged PNG: its header makes no sense")
    return header


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
