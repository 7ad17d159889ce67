"""What a map file holds; NPY and NPZ files, and portable float maps.

[http://www.pauldebevec.com/Research/HDR/PFM/]
"""

import contextlib
import io
import math
import re
import zipfile
import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.bounded import MOST_EXPANSION, MOST_SMALL, most_unpacked

# A compressed file may claim any size in a few bytes. What it would take is counted before memory is taken:
# as disparities in float32, or in the file's own numbers where these are larger. What is computed from a map
# takes up to fifteen times as much (with every image), so that a file of 1 MB never takes 1 GB
_FLOAT32 = 4
_MOST = 2**29  # bytes: 134 million pixels

COLOUR_REMEDY = (
    "a disparity map has one channel: its numbers, unpacked, can be saved as NPY; "
    "photographs are given by --left and --right"
)


@dataclass(frozen=True)
class Stored:
    """The numbers of a map file, as they are stored.

    Attributes
    ----------
    values : ndarray, shape (H, W)
        A real dtype in native byte order, C-contiguous; may be read-only.
    format : str
        "png", "tiff", "npy", "npz", "pfm", "exr", or "rgb" for numbers in the three channels of a PNG.
    nodata : tuple of float
        The stored values that the file itself says mean no data (GDAL's tag).
    note : str
        What a user should know about how the file was read, or "".
    text : str
        What rollcli wrote beside the numbers (PNG text chunk, TIFF description), or "".
    """

    values: NDArray[Any]
    format: str
    nodata: tuple[float, ...] = ()
    note: str = ""
    text: str = ""


def require_map_shape(shape: tuple[int, ...]) -> None:
    """Refuse anything that is not (H, W) with at least one pixel."""
    if len(shape) != 2:
        colours = len(shape) == 3 and shape[2] in (3, 4)
        hint = "; photographs are given as image files, by --left and --right" if colours else ""
        raise InputError(f"is a {len(shape)}-D array of shape {shape}; a disparity map is 2-D (H, W){hint}")
    if 0 in shape:
        raise InputError(f"has no pixels (shape {shape})")


def require_bytes(what: str, needed: int, there: int) -> None:
    """Refuse a file that has fewer bytes than `what` ("3 x 2 pixels need")."""
    if there < needed:
        raise InputError(f"is truncated: {what} {needed} bytes, {there} are there")


def require_decoded_fits(
    width: int, height: int, pixel_bytes: int, stored: int, *, mask: bool = False
) -> None:
    """Refuse an image without pixels, or of more memory than any map takes or its file can be worth.

    Parameters
    ----------
    width, height : int
        As the header claims, pixels.
    pixel_bytes : int
        That the decoder takes for each.
    stored : int
        The size of the file, bytes.
    mask : bool
        Nothing is computed from it: it may stand for as much as any file, and masks compress best of all.
    """
    if width < 1 or height < 1:
        raise InputError(f"has no pixels ({width} x {height})")
    needed = width * height * (pixel_bytes if mask else max(pixel_bytes, _FLOAT32))
    limit = _MOST if mask else min(_MOST, max(MOST_SMALL, MOST_EXPANSION * stored))
    hint = "; save it uncompressed" if needed <= _MOST else ""
    if needed > limit:
        raise InputError(
            f"its header claims {width} x {height} pixels, {-(-needed // 2**20)} MB once decoded; "
            f"from {stored} bytes up to {limit >> 20} MB are read{hint}"
        )


def native(values: NDArray[Any]) -> NDArray[Any]:
    """Make C-contiguous, in this machine's byte order."""
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))


MAGIC = b"\x93NUMPY"
MAGIC_NPZ = b"PK\x03\x04"
_NAMED = "disparity.npy"  # the array of an NPZ that is taken where there are several
_MAX_HEADER = 10_000
# Not ast.literal_eval, as NumPy has it: that warns on the terminal, and bounds neither time nor memory
_ENTRIES = (
    re.compile(r"""['"]descr['"]\s*:\s*('[ -&(-~]*'|"[ !#-~]*"|\[)"""),
    re.compile(r"""['"]fortran_order['"]\s*:\s*(True|False)\b"""),
    re.compile(r"""['"]shape['"]\s*:\s*\(((?:\s*\d{1,18}L?\s*,)*(?:\s*\d{1,18}L?)?)\s*\)"""),
)
_REAL = re.compile(r"[<>|=]?[biuf]\d+")
_UNREAL = {"O": "Python objects (a pickle, which is never loaded)", "c": "complex numbers", "[": "records"}


def decode_npy(data: bytes) -> Stored:
    """Return the array of an .npy file: real numbers or booleans, shape (H, W), any byte and axis order.

    (1, H, W), (1, 1, H, W) and (H, W, 1), as networks write them, are (H, W).
    """
    dtype, fortran, shape, start = check_npy(data, len(data))
    values = np.frombuffer(data, dtype, count=math.prod(shape), offset=start)
    return Stored(native(values.reshape(shape, order="F" if fortran else "C")), "npy")


def check_npy(head: bytes, size: int) -> tuple[np.dtype[Any], bool, tuple[int, ...], int]:
    """Refuse an array that is no map by its header, of a file of so many bytes.

    Returns
    -------
    tuple
        dtype, Fortran order, shape (H, W), and where the numbers start.
    """
    width = 2 if head[6:7] == b"\x01" else 4
    start = 8 + width + int.from_bytes(head[8 : 8 + width], "little")
    if len(head) < 8 + width or start > len(head):
        raise InputError("is truncated within its NPY header")
    text = head[8 + width : start][:_MAX_HEADER].decode("latin-1")
    descr, order, sides = (pattern.search(text) for pattern in _ENTRIES)
    if descr is None or order is None or sides is None:
        raise InputError("its NPY header cannot be read")
    shape = tuple(int(side) for side in re.findall(r"\d+", sides[1]))
    dtype = _real_dtype(descr[1])
    while len(shape) > 2 and 1 in (shape[0], shape[-1]):  # the numbers lie as those of (H, W) do
        shape = shape[1:] if shape[0] == 1 else shape[:-1]
    require_map_shape(shape)
    needed = math.prod(shape) * dtype.itemsize
    require_bytes(f"shape {shape} of {dtype} needs", needed, size - start)
    require_decoded_fits(shape[1], shape[0], dtype.itemsize, size)
    return dtype, order[1] == "True", shape, start


def encode_npy(values: NDArray[Any]) -> bytes:
    """Return an .npy file of the array."""
    values, buffer = np.ascontiguousarray(values), io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, np.lib.format.header_data_from_array_1_0(values))
    return b"".join([buffer.getvalue(), values.data])  # write_array copies the numbers twice


def decode_npz(data: bytes) -> Stored:
    """Return the one array of an .npz file, or of several the one named disparity; see `decode_npy`."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            held = {each.filename: each for each in archive.infolist() if each.filename.endswith(".npy")}
            chosen = held.get(_NAMED) or (next(iter(held.values())) if len(held) == 1 else None)
            if chosen is None:
                names = ", ".join(each.removesuffix(".npy") for each in list(held)[:5]) or "none"
                raise InputError(f"an NPZ map holds one array, or one of the name disparity; here: {names}")
            most = most_unpacked(chosen.compress_size)
            with archive.open(chosen) as file:
                array = file.read(most + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError, OSError):
        raise InputError("is a damaged ZIP or NPZ archive") from None
    if len(array) > most:
        raise InputError(f"its array has more than {most >> 20} MB once unpacked; save it uncompressed")
    if not array.startswith(MAGIC):
        raise InputError(f"is a ZIP archive whose {chosen.filename} is no array")
    return replace(decode_npy(array), format="npz")


def encode_npz(values: NDArray[Any]) -> bytes:
    """Return an .npz file with the array as disparity."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(_NAMED), encode_npy(values), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def _real_dtype(descr: str) -> np.dtype[Any]:
    """Return the dtype when it holds real numbers; objects, records, complex numbers, text are refused."""
    if _REAL.fullmatch(descr[1:-1]):
        with contextlib.suppress(TypeError):
            return np.dtype(descr[1:-1])
    kind = descr.lstrip("'\"<>|=")[:1]
    what = _UNREAL.get(kind, f"data of type {descr[1:-1][:40]}")
    raise InputError(f"holds {what}; a disparity map is a 2-D array of real numbers")


MAGICS = (b"Pf", b"PF")
_GAP = rb"(?:\s|#[^\n]*\n)+"
_FLOAT = rb"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)"
_HEADER = re.compile(rb"P([fF])" + 2 * (_GAP + rb"(\d{1,9})") + _GAP + _FLOAT + rb"[ \t]*\r?\n")


def decode_pfm(data: bytes) -> Stored:
    """Return the float32 values of a single-channel PFM file, top row first."""
    order, width, height, start = check_pfm(data, len(data))
    rows = np.frombuffer(data, order, count=width * height, offset=start).reshape(height, width)
    return Stored(native(rows[::-1]), "pfm")  # PFM stores the bottom row first


def check_pfm(data: bytes, size: int) -> tuple[str, int, int, int]:
    """Refuse what is no map by its header, of a file of so many bytes.

    Returns
    -------
    tuple
        The dtype of the numbers, width, height, and where the numbers start.
    """
    header = _HEADER.match(data, 0, min(len(data), 1000))
    if header is None or float(header[4]) == 0:
        raise InputError("its PFM header cannot be read (expected: Pf, width height, scale)")
    if header[1] == b"F":
        raise InputError("is a colour PFM (PF); a disparity map has one channel (Pf)")
    width, height = int(header[2]), int(header[3])
    needed = 4 * width * height
    require_bytes(f"{width} x {height} pixels need", needed, size - header.end())
    require_decoded_fits(width, height, 4, size)
    return "<f4" if header[4].startswith(b"-") else ">f4", width, height, header.end()


def encode_pfm(values: NDArray[Any]) -> bytes:
    """Return a little-endian single-channel PFM file of float32 values."""
    height, width = values.shape
    return b"Pf\n%d %d\n-1.0\n" % (width, height) + values[::-1].astype("<f4").tobytes()
