"""16-bit grey PNG [ISO/IEC 15948] in less time than OpenCV takes.

Most of that time zlib inflates the data; libdeflate (imagecodecs) does it in less than half. Where each row
holds differences to the pixel on its left (the filter Sub), as in what OpenCV writes, running sums of
imagecodecs or NumPy give the pixels. Other filters are undone by wuffs, or by OpenCV, from blocks that need
no inflating.
"""

import struct
import zlib
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.files.codecs.extras import imagecodecs, png_decoders

_SUB, _LAST_FILTER = 1, 4
_FULL_WINDOW = b"\x78"  # of less OpenCV's zlib minds references that go further back; other decoders do not
_HEAD_SHARE = 32  # the part of the data that shows whether rows have other filters than Sub
# Bytes after a stream that are looked for; more would have to end in its checksum. To look through the whole
# stream takes a fortieth of OpenCV's time
_MOST_AFTER = 1 << 16
_LONGEST_BLOCK = 0xFFFF  # bytes of a stored block of Deflate
_BLOCK = 1 << 18  # bytes of rows that are summed at once: they stay in the cache

Rows = NDArray[np.uint8]
"""Filtered rows, shape (H, 1 + 2 W): the filter, then high and low byte of each pixel."""


def decode_grey16(
    packed: bytes, width: int, height: int, file_of: Callable[[bytes], bytes]
) -> NDArray[np.uint16] | None:
    """Decode the pixel data of a 16-bit grey PNG that is not interlaced.

    Parameters
    ----------
    packed : bytes
        The rows, as a zlib stream.
    width, height : int
    file_of : callable
        Makes the PNG file of this size that holds such a stream.

    Returns
    -------
    ndarray of uint16, shape (H, W), or None
        None where OpenCV is as fast, or where something is wrong: then its verdict counts.
    """
    if not packed.startswith(_FULL_WINDOW):
        return None
    if imagecodecs() is not None:
        rows = _inflated(packed, width, height)
        return None if rows is None else _unfiltered(rows, packed[-4:], file_of)
    if (make_decoder := png_decoders()) is not None:
        return _by_wuffs(make_decoder(), file_of(packed), width, height)
    rows = _inflated_sub(packed, width, height)
    return None if rows is None else _summed(rows)


def _inflated(packed: bytes, width: int, height: int) -> Rows | None:
    """Inflate by libdeflate; None unless the stream holds these rows, and nothing follows it."""
    rows = np.empty((height, 1 + 2 * width), np.uint8)
    try:
        plain = imagecodecs().deflate_decode(packed, out=rows.reshape(-1))
    except (RuntimeError, ValueError):  # its errors are RuntimeErrors
        return None
    checksum = imagecodecs().deflate_adler32(plain).to_bytes(4, "big")
    # libdeflate does not tell where the stream ends; its checksum does, if it is at the end and not before
    ends = packed.endswith(checksum) and packed.rfind(checksum, -_MOST_AFTER, -1) < 0
    return rows if len(plain) == rows.size and ends else None


def _inflated_sub(packed: bytes, width: int, height: int) -> Rows | None:
    """Inflate by zlib; None as soon as a row has a filter beside Sub, which OpenCV undoes as fast."""
    stride = 1 + 2 * width
    size, cut = height * stride, len(packed) // _HEAD_SHARE
    inflater = zlib.decompressobj()
    try:
        head = inflater.decompress(packed[:cut], size + 1)
        if head[::stride].translate(None, b"\0\1"):
            return None
        plain = head + inflater.decompress(packed[cut:], size + 1 - len(head))
    except zlib.error:
        return None
    if len(plain) != size or not inflater.eof or inflater.unused_data:
        return None
    rows = np.frombuffer(plain, np.uint8).reshape(height, stride)
    return rows if rows[:, 0].max() <= _SUB else None


def _unfiltered(rows: Rows, checksum: bytes, file_of: Callable[[bytes], bytes]) -> NDArray[np.uint16] | None:
    """Undo the filters: by sums, or by a decoder that is given the rows as a stream of stored blocks."""
    most = rows[:, 0].max()
    if most <= _SUB:
        return _summed(rows)
    if most > _LAST_FILTER:
        return None
    file = file_of(_stored(rows, checksum))
    if (make_decoder := png_decoders()) is not None:
        height, stride = rows.shape
        return _by_wuffs(make_decoder(), file, stride // 2, height)
    pixels = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED)
    return None if pixels is None else pixels.astype(np.uint16, copy=False)


def _summed(rows: Rows) -> NDArray[np.uint16]:
    """Undo the filters None and Sub: a pixel's bytes are the sums, modulo 256, of those up to it."""
    height, stride = rows.shape
    differences = rows[:, 1:].reshape(height, stride // 2, 2)
    if (codecs := imagecodecs()) is None:
        sums = _doubled(differences).view(">u2")
    else:
        bytewise = np.empty(differences.shape, np.uint8)
        codecs.delta_decode(differences[..., ::-1], axis=1, out=bytewise)
        sums = bytewise.view("<u2")
    pixels: NDArray[np.uint16] = sums[..., 0].astype(np.uint16, copy=False)
    plain = rows[:, 0] != _SUB
    if plain.any():
        pixels[plain] = rows[plain, 1:].view(">u2")
    return pixels


def _doubled(differences: Rows) -> Rows:
    """Return the running sums along rows of pixels, shape (H, W, 2): of 2 pixels, then of 4, of 8 and so on.

    This takes a fourth of the time of `np.add.accumulate`, which waits for each sum before the next one.
    """
    height, width, _ = differences.shape
    steps, rows = (width - 1).bit_length(), max(1, _BLOCK // (2 * width))
    sums, other = np.empty(differences.shape, np.uint8), np.empty((rows, width, 2), np.uint8)
    for top in range(0, height, rows):
        now, block = differences[top : top + rows], sums[top : top + rows]
        for step in range(steps):
            added, then = 1 << step, other[: len(block)] if (steps - step) % 2 == 0 else block
            then[:, :added] = now[:, :added]
            np.add(now[:, added:], now[:, :-added], out=then[:, added:])
            now = then
        if not steps:
            block[...] = now
    return sums


def _stored(rows: Rows, checksum: bytes) -> bytes:
    """Return a zlib stream [RFC 1950, 1951] of the rows as they are."""
    plain = rows.reshape(-1).data
    parts: list[bytes | memoryview] = [b"\x78\x01"]
    for start in range(0, len(plain), _LONGEST_BLOCK):
        block = plain[start : start + _LONGEST_BLOCK]
        last = start + len(block) == len(plain)
        parts += [struct.pack("<BHH", last, len(block), len(block) ^ 0xFFFF), block]
    return b"".join([*parts, checksum])


def _by_wuffs(decoder: Any, file: bytes, width: int, height: int) -> NDArray[np.uint16] | None:
    """Decode a file by a decoder of its own: one in two threads crashes. None where something is wrong."""
    result = decoder.decode(file)
    # what it has not reached is 0, and it says so here alone
    if result.error_message or (buffer := result.pixbuf).shape != (height, width, 2):
        return None
    pixels: NDArray[Any] = buffer.view("<u2")[..., 0]
    return np.ascontiguousarray(pixels, np.uint16)
