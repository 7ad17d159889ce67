"""Maps in pictures of other programs: numbers in three channels of a PNG, and OpenEXR."""

import os
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, OutputError
from rollcli.files.codecs import png
from rollcli.files.codecs.raw_map import require_decoded_fits

_BASE = 255  # of FoundationStereo's digits: (R * 255^2 + G * 255 + B) / 1000 is the disparity in pixels
MAGIC_EXR = b"\x76\x2f\x31\x01"
_WINDOW = b"dataWindow\0box2i\0\x10\0\0\0"


def decode_rgb(data: bytes, name: str) -> NDArray[np.uint32]:
    """Return the whole numbers that FoundationStereo writes to the channels of an 8-bit PNG, shape (H, W).

    Raises
    ------
    InputError
        It is no such PNG.
    """
    pixels = png.picture(data, name) if data.startswith(png.SIGNATURE) else np.empty(0)
    if pixels.ndim != 3 or pixels.dtype != np.uint8:
        raise InputError(f"{name}: is no RGB PNG of 8 bits, which --encoding foundationstereo reads")
    blue, green, red = (pixels[..., each].astype(np.uint32) for each in range(3))
    numbers: NDArray[np.uint32] = (red * _BASE + green) * _BASE + blue
    return numbers


def encode_rgb(values: NDArray[Any]) -> bytes:
    """Return a PNG of whole numbers in three channels, as `decode_rgb` reads it.

    Raises
    ------
    OutputError
        A number needs a fourth digit.
    """
    if values.max(initial=0) >= _BASE**3:
        raise OutputError("disparities above 16581 px do not fit the channels of an RGB PNG")
    digits = [values % _BASE, values // _BASE % _BASE, values // _BASE**2]
    return bytes(cv2.imencode(".png", np.dstack(digits).astype(np.uint8))[1])


def decode_exr(data: bytes, name: str) -> NDArray[Any]:
    """Return the numbers of an OpenEXR file of one channel, where OpenCV was built to read it; shape (H, W).

    Raises
    ------
    InputError
        It is damaged or has several channels, or this OpenCV reads no EXR.
    """
    at = data.find(_WINDOW, 0, 2**16) + len(_WINDOW)
    if at < len(_WINDOW) or at + 16 > len(data):
        raise InputError(f"{name}: is a damaged EXR: its size cannot be read")
    left, top, right, bottom = np.frombuffer(data, "<i4", 4, at).tolist()
    if right < left or bottom < top:
        raise InputError(f"{name}: has no pixels")
    require_decoded_fits(right - left + 1, bottom - top + 1, 12, len(data), name)
    os.environ.setdefault("OPENCV_IO_ENABLE_OPENEXR", "1")  # OpenCV looks at it when it reads the first EXR
    try:
        with png.decoding():
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise InputError(f"{name}: is damaged, or this OpenCV reads no EXR; save it as TIFF, float32")
    if pixels.ndim == 3 and (pixels == pixels[..., :1]).all():
        pixels = pixels[..., 0]
    if pixels.ndim != 2:
        raise InputError(f"{name}: is an EXR of {pixels.shape[2]} channels; a disparity map has one")
    return pixels


def encode_exr(values: NDArray[Any]) -> bytes:
    """Return an OpenEXR file of float32 values, where OpenCV was built to write it."""
    try:
        return bytes(cv2.imencode(".exr", values.astype(np.float32, copy=False))[1])
    except cv2.error:
        raise OutputError("this OpenCV writes no EXR: write TIFF or NPY instead") from None
