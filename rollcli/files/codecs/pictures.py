"""Camera images that are no maps: JPEG, BMP, PGM and PPM."""

import re
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.codecs.mute_stderr import decoding
from rollcli.files.codecs.raw_map import PICTURE_FLAGS, native, require_decoded_fits

LOSSLESS = (b"BM", b"P5", b"P6")
SIGNATURES = (b"\xff\xd8\xff", *LOSSLESS)
_GAP = rb"(?:\s|#[^\n]*\n)+"
_PNM = re.compile(rb"P([56])" + 2 * (_GAP + rb"(\d{1,9})") + _GAP + rb"(\d{1,5})\s")


def decode_picture(data: bytes, name: str) -> NDArray[Any]:
    """The pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    if data.startswith((b"P5", b"P6")):
        return _pnm(data, name)
    if data.startswith(b"BM"):
        _require_whole_bmp(data, name)
    elif data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda"):  # no end of image after the last start of scan
        raise InputError(f"{name}: is a truncated JPEG")
    try:
        with decoding():
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), PICTURE_FLAGS)
    except cv2.error:  # a size beyond OpenCV's limits
        pixels = None
    if pixels is None:
        raise InputError(f"{name}: is a damaged image")
    return pixels


def _pnm(data: bytes, name: str) -> NDArray[Any]:
    """Binary PGM and PPM [netpbm]; OpenCV would print what is wrong with one."""
    header = _PNM.match(data, 0, min(len(data), 2000))
    if header is None or not 0 < int(header[4]) < 65536:
        raise InputError(f"{name}: is a damaged PGM or PPM: its header cannot be read")
    width, height, channels = int(header[2]), int(header[3]), 3 if header[1] == b"6" else 1
    dtype = np.dtype("u1" if int(header[4]) < 256 else ">u2")
    needed, there = width * height * channels * dtype.itemsize, len(data) - header.end()
    if needed == 0:
        raise InputError(f"{name}: has no pixels ({width} x {height})")
    if there < needed:
        raise InputError(
            f"{name}: is truncated: {width} x {height} pixels need {needed} bytes, {there} are there"
        )
    pixels = np.frombuffer(data, dtype, width * height * channels, header.end()).reshape(
        height, width, channels
    )
    return native(pixels[..., ::-1] if channels == 3 else pixels[..., 0])


def _require_whole_bmp(data: bytes, name: str) -> None:
    """OpenCV would print what is wrong with one."""
    start, size, width, height, bits, packing = (
        int.from_bytes(data[first : first + count], "little", signed=first in (18, 22))
        for first, count in ((10, 4), (14, 4), (18, 4), (22, 4), (28, 2), (30, 4))
    )
    if (
        len(data) < 54
        or not 40 <= size < 200
        or width <= 0
        or height == 0
        or packing != 0
        or bits not in (8, 24, 32)
    ):
        raise InputError(
            f"{name}: is a damaged or an unusual BMP; 8, 24 and 32 bits without compression are read"
        )
    needed = (width * bits + 31) // 32 * 4 * abs(height)
    require_decoded_fits(needed, f"its header claims {width} x {abs(height)} pixels", name)
    if start + needed > len(data):
        raise InputError(f"{name}: is truncated: {width} x {abs(height)} pixels end at byte {start + needed}")
