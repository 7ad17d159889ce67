"""NPY, PFM, BMP and Netpbm files are read without their pickles, and without belief in their headers."""

import struct

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.formats import decode_image, decode_stored
from tests.binary_files import disparity_map, make_npy
from tests.run_cli import error_of

REAL = ("u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8", "g")


@pytest.mark.parametrize("fortran", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", REAL)
def test_every_real_type_and_order_is_read(kind, order, fortran):
    values = np.asarray(disparity_map(), order="F" if fortran else "C").astype(
        np.dtype(kind).newbyteorder(order)
    )

    stored = decode_stored(make_npy(values), "map.npy")

    assert stored.values.dtype == np.dtype(kind)
    assert stored.values.dtype.isnative
    assert stored.values.flags.c_contiguous
    np.testing.assert_array_equal(stored.values, values)


GREYS = bytes(number for grey in range(256) for number in (grey, grey, grey, 0))


def bmp(width, height, bits, body, *, size=40, packing=0, between=b""):
    """A bitmap; a header of 40 bytes is BITMAPINFOHEADER, of 108 version 4, of 124 version 5."""
    palette = GREYS if bits == 8 else b""
    start = 14 + size + len(palette) + len(between)
    header = struct.pack("<IiiHHIIiiII", size, width, height, 1, bits, packing, len(body), 0, 0, 0, 0)
    file = struct.pack("<2sIHHI", b"BM", start + len(body), 0, 0, start)
    return file + header.ljust(size, b"\0") + palette + between + body


def rows_of(pixels):
    """Rows of 4, 8, ... bytes each, from the bottom up."""
    return b"".join(row.tobytes() + bytes(-row.nbytes % 4) for row in pixels[::-1])


def refusal(data):
    return error_of(InputError, decode_image, data, "x")


@pytest.mark.parametrize("size", [40, 108, 124])
@pytest.mark.parametrize("width", range(1, 9))
@pytest.mark.parametrize("bits", [8, 24, 32])
def test_bitmaps_are_read_from_the_bottom_up_or_from_the_top_down(bits, width, size):
    shape = (3, width) if bits == 8 else (3, width, bits // 8)
    pixels = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    expected = pixels if bits == 8 else pixels[..., :3]

    upwards = bmp(width, 3, bits, rows_of(pixels), size=size)
    downwards = bmp(width, -3, bits, rows_of(pixels[::-1]), size=size, between=b"gap.")

    for data in (upwards, downwards, upwards + b"more"):
        np.testing.assert_array_equal(decode_image(data, "x"), expected)
    for data in (upwards, downwards):
        assert refusal(data[:-1]) == "x: is a damaged or truncated image"


def test_a_compressed_bitmap_is_refused_whatever_it_claims():
    assert refusal(bmp(30000, 30000, 8, b"\0\1", packing=1)).startswith("x: is an unusual BMP")
