"""LZW as TIFF packs it [TIFF 6.0, section 13], in NumPy.

tifffile needs imagecodecs for it, and OpenCV fills the rest of a damaged image with nothing and says nothing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_CLEAR, _END, _FIRST = 256, 257, 258
_TABLE = 4096

# The width of a code depends on its place after the last clear alone: the table grows by one entry a code
_PLACES = np.arange(_TABLE - _FIRST + 2)
_WIDTHS = 9 + (_PLACES >= 254) + (_PLACES >= 766) + (_PLACES >= 1790)
_OFFSETS = np.concatenate([[0], np.cumsum(_WIDTHS)])


class LzwError(ValueError):
    """The bytes are no LZW data."""


def decode_lzw(packed: bytes, most: int) -> bytes:
    """Unpack what the bytes stand for, but no more than `most` bytes.

    Raises
    ------
    LzwError
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
            raise LzwError("table overflow")
        count = int(stops[0]) if len(stops) else fits
        block = codes[:count].astype(np.int32)
        if np.any(block >= _FIRST + _PLACES[:count]):
            raise LzwError("code not in the table")
        blocks.append(block)
        parents.append(block - _FIRST + done)
        done += count
        if not len(stops) or codes[count] == _END:
            break
        position = int(starts[count]) + int(widths[count])
        if len(blocks) > 64 + len(packed) // 128:
            raise LzwError("too many tables")  # each costs the same time, however short it is
    if done == 0:
        raise LzwError("no data")
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
