"""NPY, PFM, BMP and Netpbm files are read without their pickles, and without belief in their headers."""

import struct

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.pictures import decode_picture
from rollcli.files.formats import decode_stored, encode_stored
from tests.binary_files import disparity_map, make_npy, npy_header

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


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_every_version_of_the_format_is_read(version):
    values = disparity_map()

    np.testing.assert_array_equal(decode_stored(make_npy(values, version=version), "x").values, values)


def test_a_truncated_file_is_refused_wherever_it_ends():
    whole = make_npy(disparity_map())

    for length in range(6, len(whole), 101):
        with pytest.raises(InputError, match=r"^map.npy: is truncated"):
            decode_stored(whole[:length], "map.npy")


@pytest.mark.parametrize(
    "header",
    [
        "",
        "{",
        "(" * 5000,
        "{'descr': '<f4'}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': 5}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-1, -1)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (True, 2.0)}",
        "__import__('os').system('true')",
        f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({10**300}, 1)}}",
        " " * 20_000 + "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1)}",
        "[1, 2]",
        "'\0'",
        "1" * 5000,
    ],
)
def test_a_header_without_sense_is_refused(header):
    with pytest.raises(InputError, match=r"^map.npy: its NPY header cannot be read"):
        decode_stored(npy_header(header) + bytes(100), "map.npy")


def test_what_is_written_has_the_bottom_row_first():
    file = encode_stored(np.array([[1, 2], [3, 4]], np.float32), "pfm")

    assert file == b"Pf\n2 2\n-1.0\n" + np.array([3, 4, 1, 2], "<f4").tobytes()


@pytest.mark.parametrize("file", [b"Pf" + b" " * 5000, b"Pf\n" + b"9" * 5000])
def test_a_header_of_pfm_that_was_made_to_harm_is_refused(file):
    with pytest.raises(InputError, match=r"^map.pfm: its PFM header cannot be read"):
        decode_stored(file, "map.pfm")


GREYS = bytes(number for grey in range(256) for number in (grey, grey, grey, 0))


def bmp(width, height, bits, body, *, size=40, packing=0, between=b""):
    """A bitmap; a header of 40 bytes is BITMAPINFOHEADER, of 108 version 4, of 124 version 5."""
    palette = GREYS if bits == 8 else b""
    start = 14 + size + len(palette) + len(between)
    header = struct.pack("<IiiHHIIiiII", size, width, height, 1, bits, packing, len(body), 0, 0, 0, 0)
    file = struct.pack("<2sIHHI", b"BM", start + len(body), 0, 0, start)
    return file + header.ljust(size, b"\0") + palette + between + body


def rows_of(pixels, bits):
    """Rows of 4, 8, ... bytes each, from the bottom up."""
    body = b""
    for row in pixels[::-1]:
        plain = row.tobytes()
        body += plain + bytes(-len(plain) % 4)
    return body


def refusal(data):
    with pytest.raises(InputError) as caught:
        decode_picture(data, "x")
    return str(caught.value)


@pytest.mark.parametrize("size", [40, 108, 124])
@pytest.mark.parametrize("width", range(1, 9))
@pytest.mark.parametrize("bits", [8, 24, 32])
def test_bitmaps_are_read_from_the_bottom_up_or_from_the_top_down(bits, width, size):
    shape = (3, width) if bits == 8 else (3, width, bits // 8)
    pixels = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    expected = pixels if bits == 8 else pixels[..., :3]

    upwards = bmp(width, 3, bits, rows_of(pixels, bits), size=size)
    downwards = bmp(width, -3, bits, rows_of(pixels[::-1], bits), size=size, between=b"gap.")

    for data in (upwards, downwards, upwards + b"more"):
        np.testing.assert_array_equal(decode_picture(data, "x"), expected)
    for data, tall in ((upwards, 3), (downwards, 3)):
        said = refusal(data[:-1])
        assert said == f"x: is truncated: {width} x {tall} pixels end at byte {len(data)}"


@pytest.mark.parametrize(
    "wrong",
    [
        {"size": 12},
        {"size": 39},
        {"size": 200},
        {"width": 0},
        {"width": -3},
        {"height": 0},
        {"packing": 1},
        {"packing": 3},
        *({"bits": bits} for bits in (0, 1, 4, 7, 9, 16, 23, 25, 31, 33, 64)),
    ],
    ids=str,
)
def test_a_bitmap_of_another_kind_is_refused(wrong):
    given = {"width": 3, "height": 2, "bits": 24, "size": 40, "packing": 0} | wrong
    start = 14 + given["size"]
    head = struct.pack("<2sIHHI", b"BM", 0, 0, 0, start)
    body = struct.pack(
        "<IiiHHI", *(given[key] for key in ("size", "width", "height")), 1, given["bits"], given["packing"]
    )
    said = refusal(head + body + bytes(500))
    assert said == "x: is a damaged or an unusual BMP; 8, 24 and 32 bits without compression are read"


def test_a_bitmap_has_54_bytes_before_its_pixels():
    for length in range(2, 54):
        assert "is a damaged or an unusual BMP" in refusal(bmp(1, 1, 24, bytes(4))[:length])
    assert refusal(bmp(1, 1, 24, b"")) == "x: is truncated: 1 x 1 pixels end at byte 58"


def test_a_header_of_netpbm_of_comments_alone_is_refused():
    assert refusal(b"P5\n" + b"# " * 5000) == "x: is a damaged PGM or PPM: its header cannot be read"
