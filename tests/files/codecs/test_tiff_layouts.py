"""Layouts of TIFF that few programs write: as its specification has them, or as tifffile writes them."""

import io
import struct

import numpy as np
import pytest
import tifffile

from rollcli.errors import InputError
from rollcli.files.codecs.tiff import picture
from rollcli.files.formats import decode_stored
from tests.binary_files import disparity_map, make_tiff

COLOURS = np.random.default_rng(0).integers(0, 256, (20, 30, 4), dtype=np.uint8)
VALUES = disparity_map().astype(np.uint16)


def written(values, **options):
    file = io.BytesIO()
    tifffile.imwrite(file, values, metadata=None, **options)
    return file.getvalue()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"compression": "zlib"},
        {"compression": "zlib", "predictor": 2},
        {"tile": (16, 16)},
        {"rowsperstrip": 7},
    ],
    ids=str,
)
@pytest.mark.parametrize("planes", ["contig", "separate"])
def test_colours_lie_side_by_side_or_in_a_plane_each(kind, layout, planes):
    rgb = COLOURS[..., :3].astype(kind) * np.array(np.iinfo(kind).max // 255, kind)
    stored = rgb if planes == "contig" else np.moveaxis(rgb, -1, 0)

    found = picture(written(stored, photometric="rgb", planarconfig=planes, **layout), "x")

    assert found.dtype == kind
    np.testing.assert_array_equal(found, rgb[..., ::-1])


def test_what_is_neither_grey_nor_three_colours_is_no_camera_image():
    for pixels, photometric in ((COLOURS[..., :2], 1), (COLOURS[..., 0], 3), (COLOURS[..., :3], 6)):
        with pytest.raises(InputError, match="x: is neither a grey nor an RGB TIFF"):
            picture(make_tiff(pixels, photometric=photometric), "x")


# TIFF 6.0, NewSubfileType: bit 0 is a reduced copy, bit 1 a page of many, bit 2 a mask of another image
@pytest.mark.parametrize(("kind", "is_said"), [(0, True), (1, False), (2, True), (4, False), (5, False)])
def test_a_second_page_is_said_unless_it_belongs_to_the_first(kind, is_said):
    stored = decode_stored(make_tiff(VALUES, pages=2, page_kind=kind), "map.tif")

    assert stored.note == ("map.tif holds several pages; the first is read" if is_said else "")


def with_field(file, tag, kind, was, new):
    """Replace a number of the only page."""
    form = {3: "<HHIHH", 4: "<HHII"}[kind]
    fill = (0,) if kind == 3 else ()
    before, after = (struct.pack(form, tag, kind, 1, number, *fill) for number in (was, new))
    assert before in file
    return file.replace(before, after)


def test_a_page_has_as_many_parts_as_its_size_asks_for():
    strips = make_tiff(VALUES, rows_per_strip=10)
    with pytest.raises(InputError, match="x: is a damaged TIFF: 4 parts, not 8"):
        decode_stored(with_field(strips, 278, 4, 10, 5), "x")
    tiles = make_tiff(VALUES, tile=(16, 32))
    with pytest.raises(InputError, match="x: is a damaged TIFF: 6 parts, not 12"):
        decode_stored(with_field(tiles, 322, 4, 32, 16), "x")


def test_a_volume_is_no_map():
    slices = with_field(make_tiff(VALUES), 254, 4, 0, 0).replace(
        struct.pack("<HHIHH", 317, 3, 1, 1, 0), struct.pack("<HHII", 32997, 4, 1, 3)
    )
    with pytest.raises(InputError, match="x: is a volume of 3 slices, not a 2-D image"):
        decode_stored(slices, "x")


def test_pixels_end_where_the_file_ends_or_the_end_is_named():
    whole = written(VALUES)  # its pixels come last
    np.testing.assert_array_equal(decode_stored(whole, "x").values, VALUES)
    with pytest.raises(
        InputError, match=f"x: is truncated: its pixels end at byte {len(whole)} of {len(whole) - 1}$"
    ):
        decode_stored(whole[:-1], "x")


# the most that one byte can stand for: in LZW 12 bits name at most 4,098 letters, in PackBits two bytes 128;
# of Deflate zlib's documentation says it
@pytest.mark.parametrize(("compression", "fold"), [("lzw", 2732), ("deflate", 1032), ("packbits", 64)])
def test_a_header_claims_at_most_what_its_bytes_can_stand_for(compression, fold):
    honest = make_tiff(np.zeros((1, 8), np.uint8), compression)
    place = honest.index(struct.pack("<HHI", 279, 4, 1)) + 8
    packed = int.from_bytes(honest[place : place + 4], "little")
    for width, refusal in (
        (fold * packed, "its compressed data are wrong"),
        (fold * packed + 1, f"claims {fold * packed + 1} x 1 pixels, more than {packed} bytes can hold"),
    ):
        with pytest.raises(InputError, match=refusal):
            decode_stored(with_field(honest, 256, 4, 8, width), "x")
