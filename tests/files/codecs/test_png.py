"""PNG files of every kind of ISO/IEC 15948 are read, and no other; damaged ones are refused."""

import struct
import zlib

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs import png
from rollcli.files.formats import decode_image, decode_mask, decode_stored
from tests.binary_files import disparity_map, flipped, make_png, png_file, png_header, png_rows
from tests.run_cli import error_of


def values_of(depth, height=37, width=53):
    return (disparity_map(height, width) % 2**depth).astype(np.uint16 if depth == 16 else np.uint8)


def test_an_orientation_tag_does_not_turn_a_camera_image():
    turned = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    values = values_of(8)

    assert decode_image(make_png(values, 8, extra=[(b"eXIf", turned[6:])]), "x").shape == values.shape


# files that are wrong although each checksum is right: what libpng would print about
ROWS = png_rows(values_of(16), 16)
DATA = zlib.compress(ROWS)
END = (b"IEND", b"")
HEADER = png_header(53, 37)
WRONG = {
    "no data": [HEADER, END],
    "empty data": [HEADER, (b"IDAT", b""), END],
    "half the compressed data": [HEADER, (b"IDAT", DATA[: len(DATA) // 2]), END],
    "half the rows": [HEADER, (b"IDAT", zlib.compress(ROWS[: len(ROWS) // 2])), END],
    "too many rows": [HEADER, (b"IDAT", zlib.compress(ROWS + bytes(500))), END],
    "more after the data": [HEADER, (b"IDAT", DATA + b"more"), END],
    "wrong sum of the data": [HEADER, (b"IDAT", DATA[:-4] + b"abcd"), END],
    "no deflate data": [HEADER, (b"IDAT", b"x" * 500), END],
    "a filter that does not exist": [HEADER, (b"IDAT", zlib.compress(b"\x09" + ROWS[1:])), END],
    "no pixels": [png_header(0, 37), (b"IDAT", DATA), END],
    "two headers": [HEADER, HEADER, (b"IDAT", DATA), END],
    "a header at the end": [(b"IDAT", DATA), HEADER, END],
    "a short header": [(b"IHDR", bytes(5)), (b"IDAT", DATA), END],
    "an unknown critical chunk": [HEADER, (b"CgBI", b""), (b"IDAT", DATA), END],
}


@pytest.mark.parametrize("what", WRONG)
def test_a_file_that_is_wrong_behind_right_checksums_is_refused_by_a_worker(monkeypatch, what):
    monkeypatch.setattr(png, "_sink", None)
    png.silence_decoders()
    with pytest.raises(InputError, match=r"^map.png: "):
        decode_stored(png_file(*WRONG[what]), "map.png")


# what libpng complains of: broken notes beside the pixels, and an index beyond the palette
NOISY = [
    make_png(
        values_of(16),
        extra=[
            (b"iCCP", b"x\0\0" + zlib.compress(b"abc")),
            *((b"gAMA", bytes(4)), (b"tIME", bytes(3)), (b"PLTE", b"ab"), (b"cHRM", b"1")),
        ],
    ),
    png_file(png_header(2, 1, 8, 3), (b"PLTE", bytes(3)), (b"IDAT", zlib.compress(b"\0\7\7")), END),
]


@pytest.mark.parametrize("depth", [1, 2, 4, 8, 16])
def test_the_grey_that_stands_for_transparent_is_no_data(depth):
    values = np.arange(40).reshape(5, 8) % 2**depth
    hole = 3 % 2**depth
    file = make_png(values, depth, extra=[(b"tRNS", struct.pack(">H", hole))])

    expected = np.where(values == hole, 0, values)
    np.testing.assert_array_equal(decode_stored(file, "x").values, expected)
    np.testing.assert_array_equal(decode_mask(file, "x"), expected > 0)


@pytest.mark.parametrize("layout", [{}, {"interlace": True}])
def test_every_flipped_bit_is_refused_or_changes_nothing(layout):
    whole = make_png((disparity_map(11, 17) * 256).astype(np.uint16), **layout)
    expected = decode_stored(whole, "x").values.tobytes()
    refused = 0

    for bit in range(8 * len(whole)):
        try:
            assert decode_stored(flipped(whole, bit), "x").values.tobytes() == expected
        except InputError:
            refused += 1

    assert refused > 7 * len(whole)


# its table 11.1: the bit depths of grey, colour, palette, grey with opacity, colour with opacity
DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}


def numbers(depth, *shape):
    kind = np.uint16 if depth == 16 else np.uint8
    return np.random.default_rng(0).integers(0, 2**depth, shape).astype(kind)


@pytest.mark.parametrize("interlace", [False, True])
@pytest.mark.parametrize("depth", DEPTHS[2])
@pytest.mark.parametrize("colour", [2, 6])
def test_colours_of_a_camera_image_are_read_in_the_order_of_opencv(colour, depth, interlace):
    pixels = numbers(depth, 13, 9, CHANNELS[colour])
    found = decode_image(make_png(pixels, depth, colour, interlace), "x")
    np.testing.assert_array_equal(found, pixels[..., 2::-1])


@pytest.mark.parametrize("depth", [1, 16])
def test_interlaced_images_of_any_size_are_read(depth):
    for height in range(1, 18):
        for width in range(1, 18):
            values = numbers(depth, height, width)
            file = make_png(values, depth, interlace=True)
            np.testing.assert_array_equal(decode_stored(file, "x").values, values)


def refusal(*chunks):
    return error_of(InputError, decode_image, png_file(*chunks), "x")


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
    assert decode_image(png_file(*parts(1_000_000)), "x").shape == shape
    assert refusal(*parts(1_000_001)) == "x: is a damaged PNG: its header makes no sense"


# Deflate makes of one byte 1,032 at most, as zlib's documentation says
def test_a_header_claims_at_most_what_deflate_can_stand_for():
    data = [(b"IDAT", bytes(60)), (b"IDAT", bytes(40)), END]
    assert "its pixel data are wrong" in refusal(png_header(1032 * 100, 1, 8), *data)
    said = refusal(png_header(1032 * 100 + 1, 1, 8), *data)
    assert said == "x: its header claims 103201 x 1 pixels, more than 100 bytes can hold"


@pytest.mark.parametrize("depth", DEPTHS[3])
def test_a_palette_has_at_most_a_colour_for_each_number(depth):
    data = (b"IDAT", zlib.compress(png_rows(np.zeros((3, 5), np.uint8), depth)))
    header = png_header(5, 3, depth, colour=3)
    most = 3 * 2**depth
    for length in (0, 2, 4, most + 3):
        said = refusal(header, (b"PLTE", bytes(length)), data, END)
        assert said == "x: is a damaged PNG: its palette is missing or wrong"
    for length in (3, most):
        assert decode_image(png_file(header, (b"PLTE", bytes(length)), data, END), "x").shape[:2] == (3, 5)


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
            assert said == "x: is a damaged PNG: its pixel data are wrong"
