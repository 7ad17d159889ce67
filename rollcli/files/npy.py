"""NumPy's .npy format, without its pickles [numpy.lib.format].

The header is read here, not by `np.load`: its size claims are checked against the bytes that are there
before memory is taken, and old headers raise no warnings.
"""

import ast
import io
import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.stored import require_map_shape

MAGIC = b"\x93NUMPY"
_MAX_HEADER = 10_000
_REAL = re.compile(r"[<>|=]?[biuf]\d+")


def decode_npy(data: bytes, name: str) -> NDArray[Any]:
    """The array of an .npy file: real numbers or booleans, shape (H, W), any byte and axis order."""
    dtype, fortran, shape, start = _header(data, name)
    require_map_shape(shape, name)
    count = math.prod(shape)
    needed, there = count * dtype.itemsize, len(data) - start
    if there < needed:
        raise InputError(
            f"{name}: is truncated: shape {shape} of {dtype} needs {needed} bytes, {there} are there"
        )
    values = np.frombuffer(data, dtype, count=count, offset=start)
    return values.reshape(shape, order="F" if fortran else "C")


def encode_npy(values: NDArray[Any]) -> bytes:
    """An .npy file of the array."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(values), allow_pickle=False)
    return buffer.getvalue()


def _header(data: bytes, name: str) -> tuple[np.dtype[Any], bool, tuple[int, ...], int]:
    """dtype, Fortran order, shape, and where the numbers start."""
    width = 2 if data[6:7] == b"\x01" else 4
    start = 8 + width + int.from_bytes(data[8 : 8 + width], "little")
    if len(data) < 8 + width or start > len(data):
        raise InputError(f"{name}: is truncated within its NPY header")
    text = data[8 + width : start].decode("latin-1")
    try:
        if len(text) > _MAX_HEADER:
            raise ValueError("header too long")
        header = ast.literal_eval(re.sub(r"(\d)L\b", r"\1", text.strip()))  # Python 2 wrote (375L, 1242L)
        descr, fortran, shape = header["descr"], header["fortran_order"], header["shape"]
        if not all(type(side) is int and side >= 0 for side in shape):
            raise ValueError("bad shape")
    except (ValueError, TypeError, KeyError, SyntaxError, RecursionError, MemoryError):
        raise InputError(f"{name}: its NPY header cannot be read") from None
    return _real_dtype(descr, name), bool(fortran), tuple(shape), start


def _real_dtype(descr: object, name: str) -> np.dtype[Any]:
    """The dtype when it holds real numbers; objects, records, complex numbers, text are refused."""
    if isinstance(descr, str) and _REAL.fullmatch(descr):
        try:
            return np.dtype(descr)
        except TypeError:
            pass
    kind = {"O": "Python objects (a pickle, which is never loaded)", "c": "complex numbers"}
    what = (
        kind.get(descr.lstrip("<>|=")[:1], f"data of type {descr[:40]}")
        if isinstance(descr, str)
        else "records"
    )
    raise InputError(f"{name}: holds {what}; a disparity map is a 2-D array of real numbers")
