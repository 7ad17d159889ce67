"""Pictures of other programs: JPEG, BMP, PGM and PPM, those that hold both views, and maps in them.

Such maps have their numbers in three channels of a PNG, or are OpenEXR.
"""

import os
import re
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, OutputError
from rollcli.files.codecs import png
from rollcli.files.codecs.arrays import Stored, native, require_decoded_fits
from rollcli.files.codecs.png import PICTURE_FLAGS, decoded_by_opencv

_BMP = b"BM"
LOSSLESS = (_BMP, b"P2", b"P3", b"P5", b"P6")  # P2 and P3: numbers as text
SIGNATURES = (b"\xff\xd8\xff", *LOSSLESS)
_FRAME_HEADERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_WITHOUT_LENGTH = frozenset((0x00, 0x01, *range(0xD0, 0xDA)))
# many webcams write a few bytes more between the last row and the end of the image
_HARMLESS = re.compile("extraneous bytes before marker 0xd9")
_BASE = 255  # of FoundationStereo's digits: (R * 255^2 + G * 255 + B) / 1000 is the disparity in pixels
MAGIC_EXR = b"\x76\x2f\x31\x01"
_WINDOW = b"dataWindow\0box2i\0\x10\0\0\0"


def decode_picture(data: bytes) -> NDArray[Any]:
    """Return the pixels of a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16."""
    if data.startswith(_BMP) and any(data[30:34]):  # its run lengths may claim any size
        raise InputError("is an unusual BMP; those without compression are read")
    if not data.startswith(LOSSLESS):
        _require_whole_jpeg(data)
    pixels, printed = decoded_by_opencv(data, PICTURE_FLAGS)
    if pixels is None:
        raise InputError("is a damaged or truncated image")
    if complaint := _complaint(printed):
        raise InputError(f"is a damaged JPEG: {complaint}")
    return pixels


def _require_whole_jpeg(data: bytes) -> None:
    """Refuse a JPEG without a frame header or an end, and one that is too large [ITU-T T.81, annex B]."""
    if data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda"):  # no end of image after the last start of scan
        raise InputError("is a truncated JPEG")
    position = 2
    while 0 <= (position := data.find(b"\xff", position)) < len(data) - 9:
        if data[position + 1] == 0xFF:  # fill bytes may stand before a marker
            position += 1
            continue
        marker, length = data[position + 1], int.from_bytes(data[position + 2 : position + 4], "big")
        if marker in _FRAME_HEADERS:
            height, width = (int.from_bytes(data[at : at + 2], "big") for at in (position + 5, position + 7))
            require_decoded_fits(width, height, data[position + 9], len(data))
            return
        position += 2 + (length if marker not in _WITHOUT_LENGTH else 0)
    raise InputError("is a damaged JPEG: it has no frame header")


def _complaint(printed: str) -> str:
    """Return what libjpeg says is wrong; empty for lines of OpenCV's own, and for what harms no pixel."""
    for line in printed.splitlines():
        if line.strip() and not line.startswith("[") and not _HARMLESS.search(line):
            return " ".join(line.removeprefix("Corrupt JPEG data:").split())
    return ""


def half_size(width: int, height: int, layout: str, name: str) -> tuple[int, int]:
    """Return width and height of each of the two views in an image, px.

    Raises
    ------
    InputError
        The image cannot be halved.
    """
    side, what = (width, "wide") if layout == "left-right" else (height, "high")
    if side % 2:
        raise InputError(
            f"{name}: is {side} px {what}, which cannot be halved into two views: cut it to an even number"
        )
    return (width // 2, height) if layout == "left-right" else (width, height // 2)


def views_of(image: NDArray[Any], layout: str, name: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Split an image that holds both views into the left and the right one.

    Parameters
    ----------
    image : ndarray, shape (H, W) or (H, W, 3)
    layout : {"left-right", "top-bottom"}
        Where they are; the upper one is the left view.
    name : str
        What errors call it.

    Raises
    ------
    InputError
        It cannot be halved.
    """
    width, height = half_size(image.shape[1], image.shape[0], layout, name)
    one, other = image[:height, :width], image[-height:, -width:]
    return np.ascontiguousarray(one), np.ascontiguousarray(other)


def decode_rgb(data: bytes) -> Stored:
    """Return the whole numbers that FoundationStereo writes to the channels of an 8-bit PNG, shape (H, W).

    Raises
    ------
    InputError
        It is no such PNG.
    """
    pixels = png.picture(data) if data.startswith(png.SIGNATURE) else np.empty(0)
    if pixels.ndim != 3 or pixels.dtype != np.uint8:
        raise InputError("is no RGB PNG of 8 bits, which --encoding foundationstereo reads")
    blue, green, red = (pixels[..., each].astype(np.uint32) for each in range(3))
    return Stored((red * _BASE + green) * _BASE + blue, "rgb")


def encode_rgb(values: NDArray[Any]) -> bytes:
    """Return a PNG of whole numbers in three channels, as `decode_rgb` reads it."""
    red = np.minimum(values // _BASE**2, _BASE)  # 255, as in a white pixel, is a digit too
    rest = values - red * _BASE**2
    green = np.minimum(rest // _BASE, _BASE)
    return bytes(cv2.imencode(".png", np.dstack([rest - green * _BASE, green, red]).astype(np.uint8))[1])


def decode_exr(data: bytes) -> Stored:
    """Return the numbers of an OpenEXR file of one channel, where OpenCV was built to read it; shape (H, W).

    Raises
    ------
    InputError
        It is damaged or has several channels, or this OpenCV reads no EXR.
    """
    at = data.find(_WINDOW, 0, 2**16) + len(_WINDOW)
    if at < len(_WINDOW) or at + 16 > len(data):
        raise InputError("is a damaged EXR: its size cannot be read")
    left, top, right, bottom = np.frombuffer(data, "<i4", 4, at).tolist()
    require_decoded_fits(right - left + 1, bottom - top + 1, 12, len(data))
    os.environ.setdefault("OPENCV_IO_ENABLE_OPENEXR", "1")  # OpenCV looks at it when it reads the first EXR
    pixels, _ = decoded_by_opencv(data, cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise InputError("is damaged, or this OpenCV reads no EXR; save it as TIFF, float32")
    if pixels.ndim == 3 and (pixels == pixels[..., :1]).all():
        pixels = pixels[..., 0]
    if pixels.ndim != 2:
        raise InputError(f"is an EXR of {pixels.shape[2]} channels; a disparity map has one")
    return Stored(native(pixels), "exr")


def encode_exr(values: NDArray[Any]) -> bytes:
    """Return an OpenEXR file of float32 values, where OpenCV was built to write it."""
    try:
        return bytes(cv2.imencode(".exr", values.astype(np.float32, copy=False))[1])
    except cv2.error:
        raise OutputError("this OpenCV writes no EXR: write TIFF or NPY instead") from None
