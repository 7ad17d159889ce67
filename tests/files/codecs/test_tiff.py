"""TIFF files of every usual kind are read, with or without imagecodecs."""

import struct
from importlib.util import find_spec

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.tiff import picture
from rollcli.files.formats import decode_stored, encode_stored
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


def test_tiles_with_a_predictor_are_read():
    values = values_of("u2")

    stored = decode_stored(make_tiff(values, "lzw", "<", predictor=2, tile=(16, 32)), "map.tif")

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


@pytest.mark.parametrize("kind", ["i1", "u4", "i4"])
def test_whole_numbers_of_any_size_are_read(kind):
    values = disparity_map().astype(kind)

    np.testing.assert_array_equal(decode_stored(make_tiff(values, "lzw", ">", 2), "map.tif").values, values)
