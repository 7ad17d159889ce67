"""With the extra `fast` files read the same, number for number and word for word, only faster."""

import zlib
from itertools import cycle
from random import Random
from unittest.mock import patch

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs import png
from rollcli.files.formats import decode_image, decode_mask, decode_stored
from tests.binary_files import disparity_map, png_file, png_header
from tests.fuzz.corpus import corpus
from tests.fuzz.mutations import at_random, every_region, with_repairs

FILES = {name: data for name, data in corpus().items() if name.endswith(".png") and name != "large.png"}
DEEP = (disparity_map(37, 53) * 256).astype(np.uint16)


def outcome(data):
    """What each way to read a file gives: its numbers, or what is wrong."""
    found = []
    for decode in (decode_stored, decode_image, decode_mask):
        try:
            values = decode(data, "x")
        except InputError as error:
            found.append(str(error))
            continue
        values = getattr(values, "values", values)
        found.append((values.dtype.str, values.shape, values.tobytes()))
    return found


def plain(data):
    """The outcome of a file that OpenCV alone reads."""
    with patch.object(png, "decode_grey", lambda *_: None):
        return outcome(data)


@pytest.fixture(params=["imagecodecs", "nothing"])
def installed(request, monkeypatch):
    """What of the extra `fast` is there, one after the other."""
    if request.param == "nothing":
        monkeypatch.setattr(png, "imagecodecs", lambda: None)
    else:
        pytest.importorskip("imagecodecs", reason="the extra fast is not installed")
    return request.param


def grey_file(width, height, packed, depth=16):
    return png_file(png_header(width, height, depth), (b"IDAT", packed), (b"IEND", b""))


def filtered(values, filters):
    """Filter rows as PNG does [ISO/IEC 15948, 9.2], byte by byte."""
    size = values.itemsize
    pixels = values.astype(f">u{size}").view(np.uint8).astype(int)
    before = np.zeros_like(pixels[0])
    rows = []
    for row, kind in zip(pixels, cycle(filters)):
        left, corner = (np.concatenate([[0] * size, each[:-size]]) for each in (row, before))
        nearest = [
            min((a, b, c), key=lambda each, p=a + b - c: abs(p - each))
            for a, b, c in zip(left, before, corner, strict=True)
        ]
        predicted = [0, left, before, (left + before) // 2, np.array(nearest)][kind]
        rows.append(bytes([kind]) + ((row - predicted) % 256).astype(np.uint8).tobytes())
        before = row
    return b"".join(rows)


@pytest.mark.parametrize("filters", [[0], [1], [2], [3], [4], [0, 1], [1, 4, 0, 3, 2], [1] * 30 + [4]])
@pytest.mark.parametrize("shape", [(37, 53), (1, 1), (1, 200), (200, 1), (60, 700)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_rows_of_every_filter_read_as_opencv_reads_them(installed, kind, shape, filters):
    values = np.random.default_rng(1).integers(0, np.iinfo(kind).max, shape, dtype=kind, endpoint=True)
    packed, depth = zlib.compress(filtered(values, filters)), 8 * values.itemsize
    file = grey_file(*shape[::-1], packed, depth)
    np.testing.assert_array_equal(cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED), values)

    found = png.decode_grey(packed, *shape[::-1], depth)  # not by OpenCV

    assert (found is None) == (max(filters[: shape[0]]) > 1)
    if found is not None:
        assert (found.dtype, found.flags.c_contiguous, found.flags.writeable) == (kind, True, True)
        np.testing.assert_array_equal(found, values)
    np.testing.assert_array_equal(decode_stored(file, "x").values, values)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_what_opencv_writes_needs_no_opencv_to_be_read(installed, monkeypatch, kind):
    values = np.tile(DEEP, (5, 5)).astype(kind)
    file = cv2.imencode(".png", values)[1].tobytes()
    monkeypatch.setattr(png.cv2, "imdecode", None)
    np.testing.assert_array_equal(decode_stored(file, "x").values, values)


PLAIN = filtered(DEEP, [1])
PACKED = zlib.compress(PLAIN)
NO_SUCH_FILTER = zlib.compress(b"\5" + PLAIN[1:])


@pytest.mark.parametrize(
    "packed",
    [
        PACKED[: len(PACKED) // 2],
        PACKED[:-1] + bytes([PACKED[-1] ^ 1]),
        PACKED[:-4],
        PACKED + b"more",
        PACKED + PACKED[-4:],
        PACKED + b"more" + PACKED[-4:],
        zlib.compress(PLAIN + b"\0"),
        zlib.compress(PLAIN[:-1]),
        b"\x77" + PACKED[1:],
        b"\x18\x19" + PACKED[2:],  # a window of 512 bytes, and references that go further back
        NO_SUCH_FILTER,
        zlib.compress(PLAIN[:-107] + b"\5" + PLAIN[-106:]),
        b"",
    ],
)
def test_data_that_are_not_just_the_rows_are_left_to_opencv(installed, packed):
    height, width = DEEP.shape
    assert png.decode_grey(packed, width, height, 16) is None
    file = grey_file(width, height, packed)
    assert outcome(file) == plain(file)


@pytest.mark.parametrize("name", FILES)
def test_every_file_of_the_fuzzer_reads_the_same_without_extras(installed, name):
    assert outcome(FILES[name]) == plain(FILES[name])


@pytest.mark.parametrize("name", ["8.png", "16.png"])
def test_broken_files_read_the_same_without_extras(installed, name):
    random = Random(0)
    broken = [*list(every_region(FILES[name]))[::7], *(at_random(FILES[name], random) for _ in range(40))]

    for data in (each for file in broken for each in with_repairs(file)):
        assert outcome(data) == plain(data)
