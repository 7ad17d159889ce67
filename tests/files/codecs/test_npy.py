"""NPY files are read without their pickles, and without belief in their headers."""

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.formats import decode_mask, decode_stored
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
        (np.ones((2, 3), complex), "complex numbers"),
        (np.array([[None, {}]], dtype=object), "never loaded"),
        (np.zeros((2, 3), [("a", "f4"), ("b", "i2")]), "records"),
        (np.array([["a", "b"]]), "data of type"),
        (np.zeros((2, 3), "M8[s]"), "data of type"),
        (np.ones((2, 3, 4)), r"3-D array of shape \(2, 3, 4\)"),
        (np.ones(5), "1-D array"),
        (np.float64(3), "0-D array"),
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


def test_a_type_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match="data of type <f3"):
        decode_stored(
            npy_header("{'descr': '<f3', 'fortran_order': False, 'shape': (1, 1)}") + bytes(9), "map.npy"
        )


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ((2, 3, 3), "; photographs are given as image files, by --left and --right"),
        ((2, 3, 4), "; photographs are given as image files, by --left and --right"),
        ((2, 3, 2), ""),
        ((2, 3, 5), ""),
        ((2, 3, 4, 3), ""),
        ((3,), ""),
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
        ('"|S5"', "data of type |S5"),
        ("'" + "x" * 60 + "'", "data of type " + "x" * 40),
    ],
)
def test_what_an_array_holds_instead_is_named(descr, what):
    header = npy_header(f"{{'descr': {descr}, 'fortran_order': False, 'shape': (1, 1), }}\n")
    with pytest.raises(InputError) as caught:
        decode_stored(header + bytes(100), "x")
    assert str(caught.value) == f"x: holds {what}; a disparity map is a 2-D array of real numbers"
