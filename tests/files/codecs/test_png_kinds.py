"""Every kind of PNG that ISO/IEC 15948 has is read, and no other; pixels are those that were written."""

import struct
import zlib

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.png import picture
from rollcli.files.formats import decode_stored
from tests.binary_files import make_png, png_file, png_header, png_rows

# its table 11.1: the bit depths of grey, colour, palette, grey with opacity, colour with opacity
DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
GREYS = bytes(np.repeat(np.arange(256, dtype=np.uint8), 3))
END = (b"IEND", b"")


def numbers(depth, *shape):
    kind = np.uint16 if depth == 16 else np.uint8
    return np.random.default_rng(0).integers(0, 2**depth, shape).astype(kind)


@pytest.mark.parametrize("interlace", [False, True])
@pytest.mark.parametrize("depth", DEPTHS[2])
@pytest.mark.parametrize("colour", [2, 6])
def test_colours_of_a_camera_image_are_read_in_the_order_of_opencv(colour, depth, interlace):
    pixels = numbers(depth, 13, 9, CHANNELS[colour])
    found = picture(make_png(pixels, depth, colour, interlace), "x")
    np.testing.assert_array_equal(found, pixels[..., 2::-1])


@pytest.mark.parametrize("depth", DEPTHS[3])
def test_palettes_of_greys_are_read_in_every_depth(depth):
    values = numbers(depth, 13, 9)
    file = make_png(values, depth, colour=3, palette=GREYS[: 3 * 2**depth])
    np.testing.assert_array_equal(decode_stored(file, "x").values, values)


@pytest.mark.parametrize("depth", [1, 16])
def test_interlaced_images_of_any_size_are_read(depth):
    for height in range(1, 18):
        for width in range(1, 18):
            values = numbers(depth, height, width)
            file = make_png(values, depth, interlace=True)
            np.testing.assert_array_equal(decode_stored(file, "x").values, values)


def refusal(*chunks):
    with pytest.raises(InputError) as caught:
        picture(png_file(*chunks), "x")
    return str(caught.value)


@pytest.mark.parametrize("colour", range(9))
def test_a_depth_that_a_kind_does_not_have_is_refused_and_every_other_is_not(colour):
    for depth in range(18):
        said = refusal(png_header(5, 3, depth, colour), (b"IDAT", b""), END)
        makes_sense = depth in DEPTHS.get(colour, ())
        assert ("its header makes no sense" in said) != makes_sense, (colour, depth)


@pytest.mark.parametrize("place", [10, 11, 12], ids=["compression", "filtering", "interlace"])
def test_methods_that_no_standard_has_are_refused(place):
    kind, body = png_header(5, 3)
    unknown = body[:place] + bytes([2]) + body[place + 1 :]
    assert refusal((kind, unknown), (b"IDAT", b""), END) == "x: is a damaged PNG: its header makes no sense"


# libpng's PNG_USER_WIDTH_MAX and PNG_USER_HEIGHT_MAX
@pytest.mark.parametrize("turned", [False, True])
def test_a_side_has_at_most_a_million_pixels(turned):
    def parts(side):
        size, rows = ((1, side), bytes(2 * side)) if turned else ((side, 1), bytes(1 + -(-side // 8)))
        return png_header(*size, 1), (b"IDAT", zlib.compress(rows)), END

    shape = (1_000_000, 1) if turned else (1, 1_000_000)
    assert picture(png_file(*parts(1_000_000)), "x").shape == shape
    assert refusal(*parts(1_000_001)) == "x: is a damaged PNG: its header makes no sense"


def test_a_header_has_13_bytes():
    kind, body = png_header(5, 3)
    for wrong in (body[:12], body + b"\0"):
        said = refusal((kind, wrong), (b"IDAT", b""), END)
        assert said == f"x: is a damaged PNG: its header has {len(wrong)} bytes, not 13"


# Deflate makes of one byte 1,032 at most, as zlib's documentation says
def test_a_header_claims_at_most_what_deflate_can_stand_for():
    data = [(b"IDAT", bytes(60)), (b"IDAT", bytes(40)), END]
    assert "do not match" in refusal(png_header(1032 * 100, 1, 8), *data)
    said = refusal(png_header(1032 * 100 + 1, 1, 8), *data)
    assert said == "x: its header claims 103201 x 1 pixels, more than 100 bytes can hold"


def test_a_file_is_truncated_wherever_it_ends():
    whole = make_png(numbers(8, 3, 5), 8)
    for length in range(8, len(whole)):
        with pytest.raises(InputError) as caught:
            picture(whole[:length], "x")
        assert str(caught.value) == f"x: is a truncated PNG: it ends after {length} bytes"


def test_a_wrong_checksum_is_placed():
    whole = make_png(numbers(8, 3, 5), 8)
    second = whole.index(b"IDAT") - 4
    broken = whole[: second + 9] + bytes([whole[second + 9] ^ 1]) + whole[second + 10 :]
    with pytest.raises(InputError) as caught:
        picture(broken, "x")
    assert str(caught.value) == f"x: is a damaged PNG: wrong checksum {second} bytes in"


def test_a_row_of_an_interlaced_image_with_a_filter_that_does_not_exist_is_refused():
    values = numbers(8, 9, 9)
    whole = make_png(values, 8, interlace=True)
    place = whole.index(b"IDAT") + 4
    plain = bytearray(
        zlib.decompress(whole[place : place + int.from_bytes(whole[place - 8 : place - 4], "big")])
    )
    # 9 x 9: the seven passes in pixels, wide and high; before each row stands a byte
    starts, at = [], 0
    for wide, high in ((2, 2), (1, 2), (3, 1), (2, 3), (5, 2), (4, 5), (9, 4)):
        starts += range(at, at + high * (wide + 1), wide + 1)
        at += high * (wide + 1)
    assert at == len(plain)
    for start in starts:
        for filtering in (5, 255):
            wrong = plain[:start] + bytes([filtering]) + plain[start + 1 :]
            said = refusal(png_header(9, 9, 8, interlace=1), (b"IDAT", zlib.compress(bytes(wrong))), END)
            assert said == "x: is a damaged PNG: its pixel data do not match its header claims 9 x 9 pixels"


@pytest.mark.parametrize("depth", DEPTHS[3])
def test_a_palette_has_at_most_a_colour_for_each_number(depth):
    data = (b"IDAT", zlib.compress(png_rows(np.zeros((3, 5), np.uint8), depth)))
    header = png_header(5, 3, depth, colour=3)
    most = 3 * 2**depth
    for length in (0, 2, 4, most + 3):
        said = refusal(header, (b"PLTE", bytes(length)), data, END)
        assert said == "x: is a damaged PNG: its palette is missing or wrong"
    for length in (3, most):
        assert picture(png_file(header, (b"PLTE", bytes(length)), data, END), "x").shape[:2] == (3, 5)


def test_numbers_beyond_the_palette_are_black_and_further_opacities_are_left_out():
    values = np.array([[0, 1, 2, 3]], np.uint8)
    parts = [(b"PLTE", bytes([50] * 3 + [60] * 3)), (b"tRNS", bytes([255, 255, 255, 255, 0, 0]))]
    file = png_file(png_header(4, 1, 2, 3), *parts, (b"IDAT", zlib.compress(png_rows(values, 2))), END)
    assert decode_stored(file, "x").values.tolist() == [[50, 60, 0, 0]]


def test_a_palette_of_greys_and_one_colour_is_no_map():
    palette = bytearray(GREYS)
    palette[3 * 7 + 2] ^= 1
    values = np.arange(16, dtype=np.uint8).reshape(4, 4)
    with pytest.raises(InputError, match=r"^x: is a colour image \(a palette\)"):
        decode_stored(make_png(values, 8, 3, palette=bytes(palette)), "x")


def test_chunks_of_the_standard_are_read_over_and_unknown_ones_too_where_they_may_be():
    values = numbers(16, 3, 5)
    extra = [(b"gAMA", struct.pack(">I", 45455)), (b"teXt", b"any"), (b"xxXx", b"")]
    np.testing.assert_array_equal(decode_stored(make_png(values, extra=extra), "x").values, values)
    assert refusal(png_header(5, 3), (b"XxXx", b""), END) == "x: is no standard PNG: chunk 'XxXx' is unknown"
