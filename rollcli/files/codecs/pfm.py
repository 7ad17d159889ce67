"""Portable float maps [http://www.pauldebevec.com/Research/HDR/PFM/], which stereo networks write.

Not OpenCV's reader: it divides by the header's scale, of which only the sign (the byte order) means anything
for disparity, and it refuses headers with trailing blanks.
"""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, OutputError
from rollcli.files.codecs.raw_map import require_decoded_fits

MAGICS = (b"Pf", b"PF")
_GAP = rb"(?:\s|#[^\n]*\n)+"
_FLOAT = rb"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)"
_HEADER = re.compile(rb"P([fF])" + 2 * (_GAP + rb"(\d{1,9})") + _GAP + _FLOAT + rb"[ \t]*\r?\n")


def decode_pfm(data: bytes, name: str) -> NDArray[Any]:
    """Return the float32 values of a single-channel PFM file, top row first."""
    header = _HEADER.match(data, 0, min(len(data), 1000))
    if header is None or float(header[4]) == 0:
        raise InputError(f"{name}: its PFM header cannot be read (expected: Pf, width height, scale)")
    if header[1] == b"F":
        raise InputError(f"{name}: is a colour PFM (PF); a disparity map has one channel (Pf)")
    width, height = int(header[2]), int(header[3])
    if width * height == 0:
        raise InputError(f"{name}: has no pixels ({width} x {height})")
    needed, there = 4 * width * height, len(data) - header.end()
    if there < needed:
        raise InputError(
            f"{name}: is truncated: {width} x {height} pixels need {needed} bytes, {there} are there"
        )
    require_decoded_fits(width, height, 4, len(data), name)
    order = "<f4" if header[4].startswith(b"-") else ">f4"
    rows = np.frombuffer(data, order, count=width * height, offset=header.end()).reshape(height, width)
    return rows[::-1]  # PFM stores the bottom row first


def encode_pfm(values: NDArray[Any]) -> bytes:
    """Return a little-endian single-channel PFM file of float32 values."""
    if values.dtype != np.float32:
        raise OutputError(f"a PFM holds float32, not {values.dtype}: write TIFF or NPY instead")
    height, width = values.shape
    return b"Pf\n%d %d\n-1.0\n" % (width, height) + values[::-1].astype("<f4").tobytes()
