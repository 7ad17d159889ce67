"""TIFF files of every usual kind, layout and compression are read, with or without imagecodecs."""

import re
import struct
from importlib.util import find_spec

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.formats import decode_image, decode_mask, decode_stored
from tests.binary_files import disparity_map, flipped, make_tiff, tiff_by_tifffile, tiff_of_bits, with_fields
from tests.recorded import made
from tests.run_cli import error_of

KINDS = ("u1", "u2", "i2", "f2", "f4", "f8")


def values_of(kind):
    return (disparity_map() * (1 if kind in ("u1", "f2") else 256)).astype(kind)


PACKED_BY = ["lzw", "deflate", "packbits"]
COMPRESSIONS = ["none", *PACKED_BY]


@pytest.mark.parametrize("compression", PACKED_BY)
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("kind", "predictor"), [*[(k, 2) for k in KINDS], *[(k, 3) for k in KINDS if "f" in k]]
)
def test_predictors_are_undone(kind, predictor, order, compression):
    values = values_of(kind)

    stored = decode_stored(make_tiff(values, compression, order, predictor), "map.tif")

    np.testing.assert_array_equal(stored.values, values)


def test_colour_complex_and_palette_images_are_no_maps():
    colour = np.zeros((5, 7, 3), np.uint8)

    with pytest.raises(InputError, match=r"^a.tif: is a colour image \(3 channels\)"):
        decode_stored(make_tiff(colour, photometric=2), "a.tif")
    with pytest.raises(InputError, match="palette"):
        decode_stored(make_tiff(colour[..., 0], photometric=3), "a.tif")
    with pytest.raises(InputError, match="no real numbers"):
        decode_stored(make_tiff(colour[..., 0].astype("c8")), "a.tif")


TILES, HUGE = {"tile": (64, 64)}, {256: (53, 1_000_000), 257: (37, 1_000_000)}
LIES = [
    *((each, {}, HUGE, "its header claims 1000000 x 1000000 pixels") for each in COMPRESSIONS),
    *((each, TILES, HUGE, "its header claims 1000000 x 1000000 pixels") for each in COMPRESSIONS),
    *((each, {}, {257: (37, 57), 278: (37, 57)}, "is a damaged TIFF|its header") for each in COMPRESSIONS),
    ("deflate", {}, {257: (37, 30), 278: (37, 30)}, "its compressed data are wrong"),
    ("deflate", TILES, {322: (64, 2**31)}, "tiles of"),
    ("none", {"rows_per_strip": 10}, {278: (10, 5)}, "is a damaged TIFF: 4 parts, not 8"),
    ("none", {"tile": (16, 32)}, {322: (32, 16)}, "is a damaged TIFF: 6 parts, not 12"),
]


@pytest.mark.parametrize(("compression", "layout", "lies", "reason"), LIES)
def test_a_size_that_is_not_that_of_the_parts_is_refused(compression, layout, lies, reason):
    lying = with_fields(make_tiff(values_of("u2"), compression, **layout), lies)

    with pytest.raises(InputError, match=rf"^map.tif: .*({reason})"):
        decode_stored(lying, "map.tif")


@pytest.mark.skipif(bool(find_spec("imagecodecs")), reason="imagecodecs is installed here")
def test_compressions_of_another_package_name_it():
    file = with_fields(make_tiff(values_of("u2"), "deflate"), {259: (8, 50000)})

    said = error_of(InputError, decode_stored, file, "map.tif")
    assert "cannot be decoded (compression 50000, 16 bits a number): pip install imagecodecs" in said


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("nodata", [None, "7", "-40000", "1e300", "nan"])
def test_parts_that_a_sparse_file_leaves_out_hold_no_data(compression, nodata):
    values = values_of("i2")
    stored = decode_stored(make_tiff(values, compression, tile=(16, 32), nodata=nodata, sparse=(1, 2)), "x")

    values[:16, 32:] = 0
    values[16:32, :32] = 0
    np.testing.assert_array_equal(stored.values, values)


def test_deflated_bits_are_held_against_their_checksum_too():
    bits = np.random.default_rng(0).integers(0, 2, (37, 56), dtype=np.uint8)
    whole = tiff_of_bits(np.packbits(bits, axis=1), "deflate")
    expected = picture_or_mask(whole)

    start, end = data_of(whole)
    for bit in range(8 * start, 8 * end, 5):
        assert picture_or_mask(flipped(whole, bit)) in (None, expected)


@pytest.mark.parametrize("zero_is", ["minisblack", "miniswhite"])
def test_a_mask_of_bits_is_what_is_shown_of_it(zero_is):
    file = tiff_by_tifffile(VALUES.mean() < VALUES, photometric=zero_is)
    shown = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(decode_mask(file, "x"), shown > 0)


def picture_or_mask(data):
    """The bytes of a mask; None if it is refused."""
    found = made(decode_mask, data, "x")
    return None if isinstance(found, str) else found.tobytes()


def data_of(tiff):
    """Where the only strip of a little-endian TIFF lies."""
    start = tiff.index(struct.pack("<HHI", 273, 4, 1)) + 8
    count = tiff.index(struct.pack("<HHI", 279, 4, 1)) + 8
    first = int.from_bytes(tiff[start : start + 4], "little")
    return first, first + int.from_bytes(tiff[count : count + 4], "little")


COLOURS = np.random.default_rng(0).integers(0, 256, (20, 30, 4), dtype=np.uint8)
VALUES = disparity_map().astype(np.uint16)


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

    found = decode_image(tiff_by_tifffile(stored, photometric="rgb", planarconfig=planes, **layout), "x")

    assert found.dtype == kind
    np.testing.assert_array_equal(found, rgb[..., ::-1])


@pytest.mark.parametrize(("extra", "is_read"), [(2, True), (1, True), (0, False), (None, False)])
def test_opacity_beside_greys_is_left_aside(extra, is_read):
    file = tiff_by_tifffile(COLOURS[..., :2], photometric=1, extrasamples=[extra or 0], planarconfig="contig")
    file = file if extra is not None else file.replace(b"\x52\1\3\0\1", b"\x53\1\3\0\1")  # no such tag
    seen = made(decode_image, file, "x")
    assert np.array_equal(seen, COLOURS[..., 0]) if is_read else "neither a grey nor an RGB TIFF" in seen


@pytest.mark.skipif(not find_spec("imagecodecs"), reason="imagecodecs is not installed here")
def test_luma_and_chroma_of_a_jpeg_are_colours():
    file = tiff_by_tifffile(cv2.resize(COLOURS[..., :3], (480, 320)), photometric="ycbcr", compression="jpeg")
    expected = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_allclose(decode_image(file, "x"), expected, atol=2)


# TIFF 6.0, NewSubfileType: bit 0 is a reduced copy, bit 1 a page of many, bit 2 a mask of another image
@pytest.mark.parametrize(("kind", "is_said"), [(0, True), (1, False), (2, True), (4, False), (5, False)])
def test_a_second_page_is_said_unless_it_belongs_to_the_first(kind, is_said):
    two = make_tiff(VALUES, pages=2, page_kind=kind)
    stored = decode_stored(two, "map.tif")

    assert stored.note == ("map.tif holds several pages; the first is read" if is_said else "")
    if is_said:  # a mask of the wrong page would leave out other pixels, without a trace
        with pytest.raises(InputError, match=r"mask\.tif: holds several pages; save the mask"):
            decode_mask(two, "mask.tif")
    else:
        assert decode_mask(two, "mask.tif").shape == VALUES.shape


def test_a_volume_is_no_map():
    slices = make_tiff(VALUES).replace(
        struct.pack("<HHIHH", 317, 3, 1, 1, 0), struct.pack("<HHII", 32997, 4, 1, 3)
    )
    with pytest.raises(InputError, match="x: is a volume of 3 slices, not a 2-D image"):
        decode_stored(slices, "x")


def test_pixels_end_where_the_file_ends_or_the_end_is_named():
    whole = tiff_by_tifffile(VALUES)  # its pixels come last
    np.testing.assert_array_equal(decode_stored(whole, "x").values, VALUES)
    said = f"x: is truncated: its pixels end at byte {len(whole)} of {len(whole) - 1}$"
    with pytest.raises(InputError, match=said):
        decode_stored(whole[:-1], "x")


# the most that one byte can stand for: in LZW 12 bits name at most 4,098 letters, in PackBits two bytes 128;
# of Deflate zlib's documentation says it
@pytest.mark.parametrize(("compression", "fold"), [("lzw", 2732), ("deflate", 1032), ("packbits", 64)])
def test_a_header_claims_at_most_what_its_bytes_can_stand_for(compression, fold):
    honest = make_tiff(np.zeros((1, 8), np.uint8), compression)
    start, end = data_of(honest)
    packed = end - start
    for width, refusal in (
        (fold * packed, "its compressed data are wrong"),
        (fold * packed + 1, f"claims {fold * packed + 1} x 1 pixels, more than {packed} bytes can hold"),
    ):
        with pytest.raises(InputError, match=refusal):
            decode_stored(with_fields(honest, {256: (8, width)}), "x")


# of Apple's Technical Note TN1023
PACKED = bytes.fromhex("FE AA 02 80 00 2A FD AA 03 80 00 2A 22 F7 AA")
PLAIN = bytes.fromhex("AA AA AA 80 00 2A AA AA AA AA 80 00 2A 22") + 10 * b"\xaa"


@pytest.mark.parametrize("idle", [b"", b"\x80", b"\x80\x80\x80"], ids=len)
def test_packbits_are_those_of_its_maker_and_a_head_of_128_stands_for_nothing(idle):
    pixels = np.frombuffer(PLAIN, np.uint8)[None]
    packed, file = idle + PACKED[:6] + idle + PACKED[6:] + idle, make_tiff(pixels, "packbits")
    start, end = data_of(file)
    file = with_fields(file, {273: (start, len(file)), 279: (end - start, len(packed))}) + packed

    np.testing.assert_array_equal(decode_stored(file, "x").values, pixels)


def old_lzw(data):
    """LZW with the lowest bit first, a code of 9 bits for each of a few bytes."""
    codes = [256, *data, 257]
    bits = sum(code << 9 * place for place, code in enumerate(codes))
    return bits.to_bytes(-(-9 * len(codes) // 8), "little")


@pytest.mark.parametrize("compression", [*PACKED_BY, "old lzw"])
@pytest.mark.parametrize("repeats", [1, 4])
@pytest.mark.parametrize("shape", [(8, 8), (8, 9), (9, 8), (9, 9), (1, 9), (9, 1), (1, 1)])
def test_data_of_any_size_are_read_and_refused_wherever_they_are_cut(shape, repeats, compression):
    values = (np.arange(shape[0] * shape[1], dtype=np.uint8) // repeats).reshape(shape)
    file = make_tiff(values, compression.removeprefix("old "))
    start, end = data_of(file)
    packed = old_lzw(values.tobytes()) if "old" in compression else file[start:end]

    for size in range(1, len(packed) + 1):
        cut = with_fields(file, {273: (start, len(file)), 279: (end - start, size)}) + packed[:size]
        refusal = None
        try:
            np.testing.assert_array_equal(decode_stored(cut, "x").values, values)
        except InputError as error:
            refusal = str(error)
        # LZW has a last code that stands for no bytes
        assert size < len(packed) if refusal else size >= len(packed) - 2
        wrong = "its compressed data are wrong|more than .* bytes can hold"
        assert refusal is None or re.search(wrong, refusal)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_bits_may_come_lowest_first(compression):
    values = values_of("u2")
    file = make_tiff(values, compression)
    start, end = data_of(file)
    mirrored = bytes(int(f"{byte:08b}"[::-1], 2) for byte in file[start:end])
    # FillOrder takes the place of NewSubfileType, which is 0 there
    tag = struct.pack("<HHIHxx", 266, 3, 1, 2)
    file = (file[:start] + mirrored + file[end:]).replace(struct.pack("<HHII", 254, 4, 1, 0), tag)

    np.testing.assert_array_equal(decode_stored(file, "x").values, values)
