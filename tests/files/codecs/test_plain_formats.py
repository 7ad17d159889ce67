"""NPY, PFM, BMP and Netpbm files are read without their pickles, and without belief in their headers."""

import struct

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.pictures import decode_picture
from rollcli.files.formats import decode_mask, decode_stored, encode_stored
from tests.binary_files import disparity_map, make_npy, make_pfm, npy_header

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


def test_headers_of_python_2_are_read():
    header = npy_header("{'descr': '<f4', 'fortran_order': False, 'shape': (2L, 3L), }\n")

    np.testing.assert_array_equal(decode_stored(header + bytes(24), "x").values, np.zeros((2, 3), np.float32))


def test_truth_values_are_a_mask_and_no_map():
    mask = disparity_map() > 0

    np.testing.assert_array_equal(decode_mask(make_npy(mask), "mask.npy"), mask)
    with pytest.raises(InputError, match=r"map.npy: holds true and false: that is a mask"):
        decode_stored(make_npy(mask), "map.npy")


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.array([[None, {}]], dtype=object), "never loaded"),
        (np.zeros((2, 3), "M8[s]"), "data of type"),
        (np.ones((0, 5)), "no pixels"),
        (np.ones((5, 0)), "no pixels"),
    ],
)
def test_what_is_no_map_is_named(values, reason):
    with pytest.raises(InputError, match=rf"^map.npy: .*{reason}"):
        decode_stored(make_npy(np.asarray(values), allow_pickle=True), "map.npy")


def test_a_truncated_file_is_refused_wherever_it_ends():
    whole = make_npy(disparity_map())

    for length in range(6, len(whole), 101):
        with pytest.raises(InputError, match=r"^map.npy: is truncated"):
            decode_stored(whole[:length], "map.npy")


@pytest.mark.parametrize("shape", ["(1000000, 1000000)", f"({10**17}, {10**17})"])
def test_a_header_that_claims_too_much_is_refused(shape):
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}}}"

    with pytest.raises(InputError, match="is truncated: shape"):
        decode_stored(npy_header(header) + bytes(1000), "map.npy")


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


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ((2, 3, 3), "; photographs are given as image files, by --left and --right"),
        ((2, 3, 4), "; photographs are given as image files, by --left and --right"),
        ((2, 3, 2), ""),
        ((2, 3, 5), ""),
        ((2, 3, 4, 3), ""),
        ((3,), ""),
        ((), ""),
    ],
)
def test_an_array_of_colours_is_told_where_photographs_go(shape, said):
    with pytest.raises(InputError) as caught:
        decode_stored(make_npy(np.ones(shape)), "x")
    assert str(caught.value) == (
        f"x: is a {len(shape)}-D array of shape {shape}; a disparity map is 2-D (H, W){said}"
    )


@pytest.mark.parametrize(
    ("descr", "what"),
    [
        ("'|O'", "Python objects (a pickle, which is never loaded)"),
        ("'<c16'", "complex numbers"),
        ("[('a', '<f4')]", "records"),
        ("'<U3'", "data of type <U3"),
        ("'<f3'", "data of type <f3"),  # which does not exist
        ('"|S5"', "data of type |S5"),
        ("'" + "x" * 60 + "'", "data of type " + "x" * 40),
    ],
)
def test_what_an_array_holds_instead_is_named(descr, what):
    header = npy_header(f"{{'descr': {descr}, 'fortran_order': False, 'shape': (1, 1), }}\n")
    with pytest.raises(InputError) as caught:
        decode_stored(header + bytes(100), "x")
    assert str(caught.value) == f"x: holds {what}; a disparity map is a 2-D array of real numbers"


MAP = disparity_map().astype(np.float32)


@pytest.mark.parametrize("scale", ["-1", "1", "-1.0", "-0.00392157", "255", "-255.000", "1e-3"])
def test_only_the_sign_of_the_scale_means_anything(scale):
    np.testing.assert_array_equal(decode_stored(make_pfm(MAP, scale=scale), "map.pfm").values, MAP)


@pytest.mark.parametrize(
    "header",
    [
        "Pf\n{width} {height}\n{scale}\n",
        "Pf \n{width} {height} \n{scale}   \n",
        "Pf\n{width}\n{height}\n{scale}\n",
        "Pf\r\n{width} {height}\r\n{scale}\r\n",
        "Pf {width} {height} {scale}\n",
        "Pf\n# made by a camera\n{width} {height}\n{scale}\n",
    ],
)
def test_headers_as_programs_write_them_are_read(header):
    np.testing.assert_array_equal(decode_stored(make_pfm(MAP, header), "map.pfm").values, MAP)


def test_data_that_begin_like_a_line_end_stay_whole():
    values = np.frombuffer(b"\n\n\n\n\r\n\r\n", "<f4").reshape(1, 2)

    np.testing.assert_array_equal(decode_stored(make_pfm(values), "map.pfm").values, values)


def test_infinity_is_kept_as_it_is_stored():
    values = MAP.copy()
    values[0, 0] = np.inf

    assert decode_stored(make_pfm(values), "map.pfm").values[0, 0] == np.inf


def test_what_is_written_has_the_bottom_row_first():
    file = encode_stored(np.array([[1, 2], [3, 4]], np.float32), "pfm")

    assert file == b"Pf\n2 2\n-1.0\n" + np.array([3, 4, 1, 2], "<f4").tobytes()


@pytest.mark.parametrize(
    ("file", "reason"),
    [
        (b"PF\n1 1\n-1\n" + bytes(12), "colour PFM"),
        (b"Pf\n3 0\n-1\n", "no pixels"),
        (
            b"Pf\n1000000 1000000\n-1\n" + bytes(100),
            "truncated: 1000000 x 1000000 pixels need 4000000000000 bytes",
        ),
        (b"Pf\n-3 5\n-1\n", "header cannot be read"),
        (b"Pf\n3 5\nx\n", "header cannot be read"),
        (b"Pf\n3 5\n0\n" + bytes(60), "header cannot be read"),
        (b"Pf", "header cannot be read"),
        (b"Pf" + b" " * 5000, "header cannot be read"),
        (b"Pf\n" + b"9" * 5000, "header cannot be read"),
    ],
)
def test_what_cannot_be_a_map_is_named(file, reason):
    with pytest.raises(InputError, match=rf"^map.pfm: .*{reason}"):
        decode_stored(file, "map.pfm")


def test_a_truncated_file_is_refused():
    with pytest.raises(InputError, match=r"^map.pfm: is truncated"):
        decode_stored(make_pfm(MAP)[:-1], "map.pfm")


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
    [
        *(b"P5\n3 2\n0\n", b"P5\n3 2\n65536\n", b"P5\n3 2\n255", b"P5\n3 x\n255\n", b"P6", b"P5\n3 2\n-1\n"),
        b"P5\n" + b"# " * 5000,
    ],
)
def test_a_header_of_netpbm_that_makes_no_sense_is_refused(head):
    data = head if head.endswith(b"255") else head + bytes(99)
    assert refusal(data) == "x: is a damaged PGM or PPM: its header cannot be read"


@pytest.mark.parametrize("size", [b"0 2", b"2 0"])
def test_a_map_of_netpbm_without_pixels_is_refused(size):
    said = refusal(b"P5\n" + size + b"\n255\n" + bytes(9))
    assert said == f"x: has no pixels ({' x '.join(size.decode().split())})"
