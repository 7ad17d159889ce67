"""Map and image files to arrays and back, through bytes.

Bytes, because OpenCV's own file functions fail on non-ASCII names on Windows and print what they dislike.
What a file is, its first bytes say; its name's ending decides nothing.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, about
from rollcli.estimator.moments import usable_of
from rollcli.files.codecs import arrays, pictures, png, tiff
from rollcli.files.codecs.arrays import Stored as Stored
from rollcli.files.containers import is_archive, members, shown
from rollcli.files.storage import read_bytes, read_frame
from rollcli.messages import listed

_GREY = (np.uint8, np.uint16)  # of camera images


class MapFormat(NamedTuple):
    """A kind of map file.

    Attributes
    ----------
    signatures : tuple of bytes
        What its files begin with.
    decode : callable
        From bytes to `Stored`; its errors do not name the file.
    encode : callable
        From an array (H, W), the values that mean no data, and a text, to bytes.
    """

    signatures: tuple[bytes, ...]
    decode: Callable[[bytes], Stored]
    encode: Callable[[NDArray[Any], tuple[float, ...], str], bytes]


# a new format: a file in `codecs`, a line here, and its ending in `search`, which loads no decoder
MAP_FORMATS = {
    "png": MapFormat((png.SIGNATURE,), png.decode_png, lambda values, _, text: png.encode_png(values, text)),
    "tiff": MapFormat(tiff.SIGNATURES, tiff.decode_tiff, tiff.encode_tiff),
    "npy": MapFormat((arrays.MAGIC,), arrays.decode_npy, lambda values, *_: arrays.encode_npy(values)),
    "pfm": MapFormat(arrays.MAGICS, arrays.decode_pfm, lambda values, *_: arrays.encode_pfm(values)),
    "npz": MapFormat((arrays.MAGIC_NPZ,), arrays.decode_npz, lambda values, *_: arrays.encode_npz(values)),
    "exr": MapFormat(
        (pictures.MAGIC_EXR,), pictures.decode_exr, lambda values, *_: pictures.encode_exr(values)
    ),
    # told by --encoding alone: to all others such a PNG is a photograph
    "rgb": MapFormat((), pictures.decode_rgb, lambda values, *_: pictures.encode_rgb(values)),
}


def read_stored(path: str | Path, name: str | None = None, *, rgb: bool = False) -> Stored:
    """Read a disparity map file: the numbers as they are stored; see `decode_stored`.

    `rgb`: they are in the three channels of a PNG, as FoundationStereo writes them.
    """
    name = name or str(path)
    if is_archive(str(path)):  # of one that can be read, each member is a frame
        inside = listed(name + shown(each.removeprefix(str(path))) for each, _ in members(str(path)))
        raise InputError(f"{name}: is an archive; name one of its maps: {inside}")
    if rgb:
        data = read_bytes(path, name)
        with about(name):
            return pictures.decode_rgb(data)
    found = read_frame(path, name, begins=_check_beginning)
    if isinstance(found, bytes):
        return decode_stored(found, name)
    with about(name):
        arrays.require_map_shape(found.shape)  # of a recording
    return Stored(found, "npy")


def decode_stored(data: bytes, name: str) -> Stored:
    """Decode a map file of any readable format.

    Parameters
    ----------
    data : bytes
        A whole PNG, TIFF, NPY, NPZ, PFM or EXR file.
    name : str
        What error messages call it.

    Returns
    -------
    Stored
        values of shape (H, W), not yet pixels: see `encodings.to_disparity`.

    Raises
    ------
    InputError
        Not such a file, truncated, damaged, not single-channel, or with no real numbers.
    """
    with about(name):
        stored = _format_of(data).decode(data)
        if stored.values.dtype.kind == "b":
            raise InputError("holds true and false: that is a mask, not a disparity map")
    return replace(stored, note=stored.note and f"{name} {stored.note}")


def encode_stored(values: NDArray[Any], form: str, nodata: tuple[float, ...] = (), text: str = "") -> bytes:
    """Encode numbers as a map file.

    Parameters
    ----------
    values : ndarray, shape (H, W)
        PNG holds uint8 and uint16, PFM float32, TIFF and NPY any real dtype.
    form : str
        "png", "tiff", "npy", "npz", "pfm", "exr" or "rgb".
    nodata : tuple of float
        The stored values that mean no data; written as GDAL's tag to a TIFF.
    text : str
        ASCII that PNG and TIFF keep beside the numbers, and `decode_stored` returns; NPY and PFM cannot.

    Raises
    ------
    OutputError
        This OpenCV writes no EXR.
    """
    return MAP_FORMATS[form].encode(values, nodata, text)


def read_image(path: str | Path, name: str | None = None) -> NDArray[Any]:
    """Read a camera image; errors call it `name`, by default its path. See `decode_image`."""
    name = name or str(path)
    data = read_frame(path, name)
    if isinstance(data, bytes):
        return decode_image(data, name)
    if data.dtype not in _GREY:  # of a recording
        raise InputError(f"{name}: holds {data.dtype}; a camera image is uint8 or uint16")
    return data


def decode_image(data: bytes, name: str) -> NDArray[Any]:
    """Decode a camera image: grey (H, W) or BGR (H, W, 3), uint8 or uint16.

    Raises
    ------
    InputError
        No such image, truncated, damaged, or of other numbers.
    """
    with about(name):
        if data.startswith(png.SIGNATURE):
            return png.picture(data)
        if data.startswith(arrays.MAGIC) and arrays.check_npy(data, len(data))[0] in _GREY:
            return arrays.decode_npy(data).values
        if data.startswith(tiff.SIGNATURES):
            return tiff.picture(data)
        if data.startswith(pictures.SIGNATURES):
            return pictures.decode_picture(data)
        raise InputError("is no PNG, JPEG, TIFF, BMP, PGM or PPM file, as camera images are")


def decode_mask(data: bytes, name: str) -> NDArray[np.bool_]:
    """Decode a mask, from a map or a lossless picture: True where a pixel may be used; shape (H, W).

    It has a colour that is not zero, and in a PNG is not fully transparent.

    Raises
    ------
    InputError
        Truncated, damaged, a JPEG, or a TIFF of several pages.
    """
    with about(name):
        if data.startswith(png.SIGNATURE):
            pixels = png.decode_mask(data)
        elif data.startswith(pictures.LOSSLESS):
            pixels = pictures.decode_picture(data)
        elif data.startswith(pictures.SIGNATURES):
            raise InputError("is a JPEG, whose black is not all 0: save the mask as PNG")
        else:
            stored = _format_of(data).decode(data)
            if stored.note:  # another page may be the one that is meant
                raise InputError("holds several pages; save the mask that is meant as a file of its own")
            pixels = stored.values
    return usable_of(pixels if pixels.ndim == 2 else pixels.max(axis=2))


def _check_beginning(head: bytes, size: int, name: str) -> None:
    """Refuse a file that is no map by its first bytes: the rest of it need not be read."""
    with about(name):
        if head.startswith(arrays.MAGIC):
            arrays.check_npy(head, size)
        elif head.startswith(arrays.MAGICS):
            arrays.check_pfm(head, size)
        else:
            _format_of(head)


def _format_of(data: bytes) -> MapFormat:
    """Return the format of a map file by its first bytes; refuse what is none."""
    for each in MAP_FORMATS.values():
        if data.startswith(each.signatures):
            return each
    hint = "; photographs are given by --left and --right" if data.startswith(pictures.SIGNATURES) else ""
    raise InputError(f"is no PNG, TIFF, NPY, NPZ, PFM or EXR file, as disparity maps are{hint}")
