"""A small file never takes much memory, whatever it claims, and large maps are read up to a stated size."""

import sys
import zlib
from functools import partial

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs import arrays
from rollcli.files.formats import decode_image, decode_stored
from tests.binary_files import make_npy, make_png, make_tiff, png_file, png_header, tiff_of_bits
from tests.recorded import made
from tests.run_cli import python

GIB = 2**30
# a process counts the memory of the one that starts it, as of a test that had much: a small one is in between
PEAK = """import subprocess, sys; from resource import RUSAGE_CHILDREN, getrusage
status = subprocess.call([sys.executable, *sys.argv[1:]])
print(status, getrusage(RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)"""


def png_of(width, height, depth, colour=0, palette=b""):
    """A PNG whose rows are all alike, made without the memory that reading it would take."""
    packer, channels = zlib.compressobj(9), {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    row = b"\0" + b"\x55" * ((width * depth * channels + 7) // 8)
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    colours = [(b"PLTE", palette)] if palette else []
    return png_file(png_header(width, height, depth, colour), *colours, (b"IDAT", data), (b"IEND", b""))


def tiff_of(width, height, bits):
    """A Deflate TIFF of few bits a pixel, which are all 0."""
    return tiff_of_bits(np.zeros((height, width * bits // 8), np.uint8), "deflate", bits, rows_per_strip=64)


BOMBS = {
    "grey1.png": lambda: png_of(12_000, 12_000, 1),
    "grey8.png": lambda: png_of(6_000, 6_000, 8),
    "palette.png": lambda: png_of(9_000, 9_000, 1, 3, bytes([9, 9, 9, 20, 20, 20])),
    "colour.png": lambda: png_of(3_000, 3_000, 16, 6),
    "bits1.tif": lambda: tiff_of(12_000, 12_800, 1),
    "bits4.tif": lambda: tiff_of(12_000, 6_400, 4),
    "bits8.tif": lambda: tiff_of(6_000, 6_400, 8),
}


@pytest.mark.parametrize("name", BOMBS)
def test_what_a_small_file_claims_to_hold_is_counted_before_memory_is_taken(name):
    data = BOMBS[name]()
    assert len(data) < 2**20

    for decode in (decode_stored, decode_image):
        with pytest.raises(InputError, match=r"^x: (its header claims .* MB once decoded|is neither)"):
            decode(data, "x")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is counted in other units elsewhere")
def test_small_files_at_the_limit_take_less_than_a_gigabyte(tmp_path):
    maps = tmp_path / "maps"
    maps.mkdir()
    for name, data in {
        "1.png": png_of(3800, 2200, 1),
        "16.png": png_of(3800, 2200, 16),
        "palette.png": png_of(3800, 2200, 8, 3, bytes([9, 9, 9]) * 256),
        "8.tif": tiff_of(3800, 2176, 8),
        "f8.tif": make_tiff(np.zeros((2000, 2000)), "deflate"),
    }.items():
        (maps / name).write_bytes(data)
        assert len(data) < 2**20
    line = ("estimate", "maps", "-q", "-o", "rolls.csv", "-j", "1")

    found = python(PEAK, "-m", "rollcli", *line, cwd=tmp_path, check=True)
    status, peak = map(int, found.stderr.split()[-2:])

    assert status == 3
    assert len((tmp_path / "rolls.csv").read_text().splitlines()) == 6
    assert "once decoded" not in (tmp_path / "rolls.csv").read_text()
    assert peak * 1024 < GIB


def _pixels(kind, *channels):
    return np.zeros((7, 13, *channels), kind)


GREYS = bytes(3 * 256)
# 13 x 7 pixels, and the bytes that one of them takes once decoded: at least the four of a disparity
COUNTED = {
    "grey1.png": (decode_stored, lambda: make_png(_pixels("u1"), 1), 4),
    "grey16.png": (decode_stored, lambda: make_png(_pixels("u2"), 16), 4),
    "palette.png": (decode_stored, lambda: make_png(_pixels("u1"), 8, 3, palette=GREYS), 4),
    "opacity16.png": (decode_stored, lambda: make_png(_pixels("u2", 2), 16, 4), 4),
    "colour8.png": (decode_image, lambda: make_png(_pixels("u1", 3), 8, 2), 4),
    "colour16.png": (decode_image, lambda: make_png(_pixels("u2", 3), 16, 2), 6),
    "all16.png": (decode_image, lambda: make_png(_pixels("u2", 4), 16, 6), 8),
    "u1.tif": (decode_stored, lambda: make_tiff(_pixels("u1")), 4),
    "f4.tif": (decode_stored, lambda: make_tiff(_pixels("f4"), "lzw"), 4),
    "f8.tif": (decode_stored, lambda: make_tiff(_pixels("f8"), "deflate"), 8),
    "colour8.tif": (decode_image, lambda: make_tiff(_pixels("u1", 3), photometric=2), 4),
    "colour16.tif": (decode_image, lambda: make_tiff(_pixels("u2", 3), photometric=2), 6),
    "f8.npy": (decode_stored, lambda: make_npy(_pixels("f8")), 8),
    "grey.jpg": (decode_image, lambda: cv2.imencode(".jpg", _pixels("u1"))[1].tobytes(), 4),
    "colour.jpg": (decode_image, lambda: cv2.imencode(".jpg", _pixels("u1", 3))[1].tobytes(), 4),
}


@pytest.mark.parametrize("name", COUNTED)
def test_a_file_is_read_up_to_the_limit_and_no_further(monkeypatch, name):
    decode, make, pixel_bytes = COUNTED[name]
    data, needed = make(), 13 * 7 * pixel_bytes
    monkeypatch.setattr(arrays, "MOST_SMALL", 0)

    monkeypatch.setattr(arrays, "_MOST", needed)
    monkeypatch.setattr(arrays, "MOST_EXPANSION", 2 * needed)
    found = decode(data, "x")
    assert (found.values if decode is decode_stored else found).shape[:2] == (7, 13)
    monkeypatch.setattr(arrays, "_MOST", needed - 1)
    with pytest.raises(
        InputError, match=r"^x: its header claims 13 x 7 pixels, 1 MB once decoded; from \d+ bytes up"
    ):
        decode(data, "x")


claim = partial(made, arrays.require_decoded_fits)  # what is said of it; None where it is believed


# as the README of the package has it: 134 million pixels, 67 million of float64; of a file of few bytes 8
# million, and then 48 bytes for each of its own
@pytest.mark.parametrize(
    ("pixel_bytes", "most", "always"), [(1, 2**27, 2**23), (4, 2**27, 2**23), (8, 2**26, 2**22)]
)
def test_the_limits_are_those_that_the_readme_states(pixel_bytes, most, always):
    assert claim(most, 1, pixel_bytes, 2**40) is claim(always, 1, pixel_bytes, 1) is None
    assert claim(most + 1, 1, pixel_bytes, 2**40) == (
        f"its header claims {most + 1} x 1 pixels, 513 MB once decoded; "
        f"from {2**40} bytes up to 512 MB are read"
    )
    assert claim(1, always + 1, pixel_bytes, 1) == (
        f"its header claims 1 x {always + 1} pixels, 33 MB once decoded; "
        "from 1 bytes up to 32 MB are read; save it uncompressed"
    )
    pixels = 12 * 10**6 * 4 // max(pixel_bytes, 4)
    assert claim(pixels, 1, pixel_bytes, 10**6) is None
    assert claim(pixels + 1, 1, pixel_bytes, 10**6).endswith("; save it uncompressed")
    assert claim(most, 1, pixel_bytes, 2**29 // 48).endswith("; save it uncompressed")
