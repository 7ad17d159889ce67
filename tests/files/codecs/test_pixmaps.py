"""Bitmaps of Windows and the maps of netpbm, written by hand as their makers describe them."""

import struct

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.pictures import decode_picture

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


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"P5\n3 2\n255\n\0\1\2\3\4\xff", [[0, 1, 2], [3, 4, 255]]),
        (b"P5\n3 2\n1\n\0\1\0\1\1\1", [[0, 1, 0], [1, 1, 1]]),
        (b"P5\n2 1\n256\n\1\0\0\5", [[256, 5]]),  # two bytes a number from 256 on, the higher one first
        (b"P5 2 1 65535\n\xff\xff\0\5", [[65535, 5]]),
        (b"P5\n# a comment\n2\t# another\n 1\n255 \x0a\x20", [[10, 32]]),
        (b"P6\n1 2\n255\n\1\2\3\4\5\6", [[[3, 2, 1]], [[6, 5, 4]]]),
        (b"P6\n1 1\n65535\n\1\2\3\4\5\6", [[[0x0506, 0x0304, 0x0102]]]),
    ],
)
def test_maps_of_netpbm_are_read(data, expected):
    wide = np.max(expected) > 255
    for file in (data, data + b"more"):
        found = decode_picture(file, "x")
        assert found.dtype == (np.uint16 if wide else np.uint8)
        assert found.tolist() == expected
        assert found.flags.c_contiguous
        assert found.dtype.isnative


@pytest.mark.parametrize(
    ("head", "needed"),
    [(b"P5\n3 2\n255\n", 6), (b"P5\n3 2\n256\n", 12), (b"P6\n3 2\n255\n", 18), (b"P6\n3 2\n999\n", 36)],
)
def test_a_map_of_netpbm_that_ends_early_is_refused(head, needed):
    assert decode_picture(head + bytes(needed), "x").shape[:2] == (2, 3)
    said = refusal(head + bytes(needed - 1))
    assert said == f"x: is truncated: 3 x 2 pixels need {needed} bytes, {needed - 1} are there"


@pytest.mark.parametrize(
    "head",
    [b"P5\n3 2\n0\n", b"P5\n3 2\n65536\n", b"P5\n3 2\n255", b"P5\n3 x\n255\n", b"P6", b"P5\n3 2\n-1\n"],
)
def test_a_header_of_netpbm_that_makes_no_sense_is_refused(head):
    data = head if head.endswith(b"255") else head + bytes(99)
    assert refusal(data) == "x: is a damaged PGM or PPM: its header cannot be read"


@pytest.mark.parametrize("size", [b"0 2", b"2 0"])
def test_a_map_of_netpbm_without_pixels_is_refused(size):
    said = refusal(b"P5\n" + size + b"\n255\n" + bytes(9))
    assert said == f"x: has no pixels ({' x '.join(size.decode().split())})"
