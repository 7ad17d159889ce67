"""PFM files hold disparities as they are: the header's scale is no factor."""

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.formats import decode_stored, encode_stored
from tests.binary_files import disparity_map, make_pfm

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
