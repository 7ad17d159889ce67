"""TIFF files of every usual kind are read, with or without imagecodecs."""

import struct
from importlib.util import find_spec

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.tiff import picture
from rollcli.files.formats import decode_mask, decode_stored, encode_stored
from tests.binary_files import disparity_map, make_tiff

KINDS = ("u1", "u2", "i2", "f2", "f4", "f8")


def values_of(kind):
    return (disparity_map() * (1 if kind in ("u1", "f2") else 256)).astype(kind)


@pytest.mark.parametrize("compression", ["none", "lzw", "deflate", "old-deflate", "packbits"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_type_compression_and_byte_order_is_read(kind, order, compression):
    values = values_of(kind)

    stored = decode_stored(make_tiff(values, compression, order, rows_per_strip=10), "map.tif")

    assert stored.values.dtype == np.dtype(kind)
    np.testing.assert_array_equal(stored.values, values)


@pytest.mark.parametrize("compression", ["lzw", "deflate", "packbits"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("kind", "predictor"), [*[(k, 2) for k in KINDS], *[(k, 3) for k in KINDS if "f" in k]]
)
def test_predictors_are_undone(kind, predictor, order, compression):
    values = values_of(kind)

    stored = decode_stored(make_tiff(values, compression, order, predictor), "map.tif")

    np.testing.assert_array_equal(stored.values, values)


@pytest.mark.parametrize("compression", ["none", "lzw"])
@pytest.mark.parametrize(
    "layout", [{"tile": (16, 16)}, {"tile": (64, 64)}, {"rows_per_strip": 1}, {"big": True}]
)
def test_tiles_strips_and_bigtiff_are_read(layout, compression):
    values = values_of("f4")

    stored = decode_stored(make_tiff(values, compression, ">", **layout), "map.tif")

    np.testing.assert_array_equal(stored.values, values)


def test_the_nodata_tag_comes_with_the_values():
    assert decode_stored(make_tiff(values_of("f4"), nodata="-3.4028234663852886e+38"), "x").nodata == (
        pytest.approx(-3.4028234663852886e38),
    )
    assert decode_stored(make_tiff(values_of("f4"), nodata="none "), "x").nodata == ()


def test_the_nodata_tag_is_written_back():
    stored = decode_stored(encode_stored(values_of("f4"), "tiff", nodata=(9999.0,)), "x")

    assert stored.nodata == (9999.0,)


def test_writing_a_tiff_twice_gives_the_same_bytes():
    assert encode_stored(values_of("f4"), "tiff") == encode_stored(values_of("f4"), "tiff")


def test_of_several_pages_the_first_is_read_and_that_is_said():
    stored = decode_stored(make_tiff(values_of("f4"), pages=3), "map.tif")

    np.testing.assert_array_equal(stored.values, values_of("f4"))
    assert "map.tif" in stored.note
    assert "several pages" in stored.note


def test_overviews_are_no_pages_of_their_own():
    assert decode_stored(make_tiff(values_of("f4"), pages=3, page_kind=1), "map.tif").note == ""


def test_colour_complex_and_palette_images_are_no_maps():
    colour = np.zeros((5, 7, 3), np.uint8)

    with pytest.raises(InputError, match=r"^a.tif: is a colour image \(3 channels\)"):
        decode_stored(make_tiff(colour, photometric=2), "a.tif")
    with pytest.raises(InputError, match="palette"):
        decode_stored(make_tiff(colour[..., 0], photometric=3), "a.tif")
    with pytest.raises(InputError, match="no real numbers"):
        decode_stored(make_tiff(colour[..., 0].astype("c8")), "a.tif")


@pytest.mark.parametrize("compression", ["none", "lzw", "deflate", "packbits"])
def test_a_truncated_file_is_refused_wherever_it_ends(compression):
    whole = make_tiff(values_of("u2"), compression, rows_per_strip=10)

    for length in range(4, len(whole), 97):
        with pytest.raises(InputError, match=r"^map.tif: "):
            decode_stored(whole[:length], "map.tif")


@pytest.mark.parametrize("compression", ["none", "lzw", "deflate", "packbits"])
def test_fewer_rows_than_the_header_says_are_refused(compression):
    file = make_tiff(values_of("u2")[:20], compression)
    for tag in (257, 278):
        file = file.replace(struct.pack("<HHII", tag, 4, 1, 20), struct.pack("<HHII", tag, 4, 1, 37))

    with pytest.raises(InputError, match=r"map.tif: (is a damaged TIFF|its header claims)"):
        decode_stored(file, "map.tif")


@pytest.mark.parametrize("compression", ["lzw", "deflate"])
def test_damaged_compressed_data_are_refused(compression):
    file = bytearray(make_tiff(values_of("u2"), compression))
    file[500:520] = b"\xff" * 20

    with pytest.raises(InputError, match=r"damaged TIFF: its compressed data are wrong"):
        decode_stored(bytes(file), "map.tif")


@pytest.mark.parametrize("compression", ["none", "lzw", "deflate", "packbits"])
@pytest.mark.parametrize("layout", [{}, {"tile": (64, 64)}])
def test_a_size_that_the_bytes_cannot_hold_is_refused(compression, layout):
    honest = make_tiff(values_of("u2"), compression, **layout)
    lying = honest.replace(
        struct.pack("<HHII", 256, 4, 1, 53), struct.pack("<HHII", 256, 4, 1, 1_000_000)
    ).replace(struct.pack("<HHII", 257, 4, 1, 37), struct.pack("<HHII", 257, 4, 1, 1_000_000))
    assert lying != honest

    with pytest.raises(InputError, match="header claims 1000000 x 1000000 pixels"):
        decode_stored(lying, "map.tif")


def test_a_tile_much_larger_than_the_image_is_refused():
    honest = make_tiff(values_of("u2"), "deflate", tile=(64, 64))
    lying = honest.replace(struct.pack("<HHII", 322, 4, 1, 64), struct.pack("<HHII", 322, 4, 1, 2**31))

    with pytest.raises(InputError, match="tiles of"):
        decode_stored(lying, "map.tif")


def test_camera_images_are_read_in_grey_and_in_colour():
    grey = values_of("u2")
    rgb = np.random.default_rng(0).integers(0, 255, (20, 30, 3), dtype=np.uint8)

    np.testing.assert_array_equal(picture(make_tiff(grey, "lzw"), "x"), grey)
    np.testing.assert_array_equal(
        picture(make_tiff(rgb, "lzw", predictor=2, photometric=2), "x"), rgb[..., ::-1]
    )
    with pytest.raises(InputError, match="holds float32 numbers"):
        picture(make_tiff(values_of("f4")), "x")


@pytest.mark.skipif(bool(find_spec("imagecodecs")), reason="imagecodecs is installed here")
def test_compressions_of_another_package_name_it():
    field = struct.pack("<HHIHH", 259, 3, 1, 8, 0)
    file = make_tiff(values_of("u2"), "deflate").replace(field, struct.pack("<HHIHH", 259, 3, 1, 50000, 0))

    with pytest.raises(
        InputError,
        match=r"cannot be decoded \(compression 50000, 16 bits a number\): pip install imagecodecs",
    ):
        decode_stored(file, "map.tif")


@pytest.mark.parametrize("compression", ["none", "lzw", "deflate", "packbits"])
@pytest.mark.parametrize(("nodata", "expected"), [(None, 0), ("-1", -1), ("1e300", 0), ("nan", 0)])
def test_parts_that_a_sparse_file_leaves_out_hold_no_data(compression, nodata, expected):
    values = values_of("i2")
    stored = decode_stored(make_tiff(values, compression, tile=(16, 32), nodata=nodata, sparse=(1, 2)), "x")

    values[:16, 32:] = expected
    values[16:32, :32] = expected
    np.testing.assert_array_equal(stored.values, values)


def test_the_last_strip_may_be_filled_up():
    values = values_of("u2")
    filled = make_tiff(np.vstack([values, values[:3]]), "deflate", rows_per_strip=10)
    shorter = filled.replace(struct.pack("<HHII", 257, 4, 1, 40), struct.pack("<HHII", 257, 4, 1, 37))
    assert shorter != filled

    np.testing.assert_array_equal(decode_stored(shorter, "x").values, values)


@pytest.mark.parametrize("compression", ["lzw", "deflate", "packbits"])
def test_a_part_that_holds_more_than_its_pixels_is_refused(compression):
    values = values_of("u2")
    whole = make_tiff(values, compression)
    fewer = whole.replace(struct.pack("<HHII", 257, 4, 1, 37), struct.pack("<HHII", 257, 4, 1, 30))
    fewer = fewer.replace(struct.pack("<HHII", 278, 4, 1, 37), struct.pack("<HHII", 278, 4, 1, 30))

    with pytest.raises(InputError, match="its compressed data are wrong"):
        decode_stored(fewer, "map.tif")


def tiff_of_bits(rows, compression):
    """A mask of 56 random bits a row, in one strip."""
    bits = np.packbits(np.random.default_rng(0).integers(0, 2, (rows, 56), dtype=np.uint8), axis=1)
    field = struct.pack("<HHII", 256, 4, 1, 7)
    whole = make_tiff(bits, compression).replace(field, struct.pack("<HHII", 256, 4, 1, 56))
    return whole.replace(struct.pack("<HHIHH", 258, 3, 1, 8, 0), struct.pack("<HHIHH", 258, 3, 1, 1, 0))


def test_deflated_bits_are_held_against_their_checksum_too():
    whole = tiff_of_bits(37, "deflate")
    expected = picture_or_mask(whole)

    start, end = data_of(whole)
    for bit in range(8 * start, 8 * end, 5):
        assert picture_or_mask(flipped(whole, bit)) in (None, expected)


def picture_or_mask(data):
    """The bytes of a mask; None if it is refused."""
    try:
        return decode_mask(data, "x").tobytes()
    except InputError:
        return None


def data_of(tiff):
    """Where the only strip of a little-endian TIFF lies."""
    start = tiff.index(struct.pack("<HHI", 273, 4, 1)) + 8
    count = tiff.index(struct.pack("<HHI", 279, 4, 1)) + 8
    first = int.from_bytes(tiff[start : start + 4], "little")
    return first, first + int.from_bytes(tiff[count : count + 4], "little")


def flipped(data, bit):
    broken = bytearray(data)
    broken[bit // 8] ^= 1 << bit % 8
    return bytes(broken)


@pytest.mark.parametrize(("kind", "predictor"), [("u2", 1), ("u2", 2), ("f4", 3)])
def test_every_flipped_bit_of_deflated_pixels_is_refused_or_changes_nothing(kind, predictor):
    whole = make_tiff(values_of(kind)[:11, :17], "deflate", predictor=predictor)
    expected = decode_stored(whole, "x").values.tobytes()
    start, end = data_of(whole)
    refused = 0

    for bit in range(8 * start, 8 * end):
        try:
            assert decode_stored(flipped(whole, bit), "x").values.tobytes() == expected
        except InputError:
            refused += 1

    assert refused > (end - start) * 7
