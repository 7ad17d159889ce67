"""With the extras `fast` and `tiff` files read the same, number for number and word for word, only faster."""

import subprocess
import sys
import zlib
from random import Random

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs import fast_png, png, tiff_parts, unpack
from rollcli.files.formats import decode_image, decode_mask, decode_stored
from tests.binary_files import disparity_map, make_png, make_tiff, png_file, png_header, png_rows
from tests.fuzz.corpus import corpus
from tests.fuzz.mutations import at_random, every_region, with_repairs
from tests.run_cli import environment

FILES = {name: data for name, data in corpus().items() if name != "large.png"}
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


@pytest.fixture
def plain(monkeypatch):
    """A function that reads a file as it is read where no extra is installed."""

    def read(data):
        with monkeypatch.context() as patch:
            patch.setattr(png, "decode_grey16", lambda *_: None)
            for module in (unpack, tiff_parts):
                patch.setattr(module, "imagecodecs", lambda: None)
            return outcome(data)

    return read


@pytest.fixture
def wuffs():
    pytest.importorskip("pywuffs", reason="the extra fast is not installed")


@pytest.fixture
def imagecodecs():
    pytest.importorskip("imagecodecs", reason="the extra tiff is not installed")


@pytest.mark.parametrize("filtering", range(5))
@pytest.mark.parametrize("shape", [(37, 53), (1, 1), (1, 200), (200, 1)])
def test_wuffs_reads_what_opencv_reads(wuffs, shape, filtering):
    values = np.resize(DEEP, shape)
    options = [cv2.IMWRITE_PNG_FILTER, (8, 16, 32, 64, 128)[filtering]]
    file = cv2.imencode(".png", values, options)[1].tobytes()

    np.testing.assert_array_equal(fast_png.decode_grey16(file, shape[1], shape[0]), values)
    np.testing.assert_array_equal(decode_stored(file, "x").values, values)


def test_only_16_bits_of_grey_go_to_wuffs(wuffs, monkeypatch):
    asked = []
    monkeypatch.setattr(png, "decode_grey16", lambda *_: asked.append(1))

    for file in (make_png(DEEP), make_png(DEEP, interlace=True), make_png(DEEP % 256, 8)):
        decode_stored(file, "x")

    assert len(asked) == 1


def test_wuffs_reads_in_several_threads_at_once():
    pytest.importorskip("pywuffs", reason="the extra fast is not installed")
    script = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "import numpy as np\n"
        "from rollcli.files.formats import decode_stored\n"
        "from tests.binary_files import make_png\n"
        "values = np.random.default_rng(0).integers(0, 60000, (200, 300), dtype=np.uint16)\n"
        "file = make_png(values)\n"
        "with ThreadPoolExecutor(4) as pool:\n"
        "    read = pool.map(lambda _: decode_stored(file, 'x').values, range(400))\n"
        "    assert all(np.array_equal(each, values) for each in read)\n"
    )

    done = subprocess.run([sys.executable, "-c", script], env=environment(), check=False)

    assert done.returncode == 0


@pytest.mark.parametrize("damage", ["cut", "checksum"])
def test_half_an_image_of_wuffs_is_never_taken(wuffs, damage):
    packed = zlib.compress(png_rows(DEEP, 16))
    packed = packed[: len(packed) // 2] if damage == "cut" else packed[:-1] + bytes([packed[-1] ^ 1])
    file = png_file(png_header(53, 37), (b"IDAT", packed), (b"IEND", b""))

    assert fast_png.decode_grey16(file, 53, 37) is None
    with pytest.raises(InputError, match="damaged PNG"):
        decode_stored(file, "x")


@pytest.mark.parametrize("name", FILES)
def test_every_file_of_the_fuzzer_reads_the_same_without_extras(wuffs, imagecodecs, plain, name):
    assert outcome(FILES[name]) == plain(FILES[name])


@pytest.mark.parametrize("name", ["16.png", *(name for name in FILES if name.endswith(".tif"))])
def test_broken_files_read_the_same_without_extras(wuffs, imagecodecs, plain, name):
    random = Random(0)
    broken = [*list(every_region(FILES[name]))[::7], *(at_random(FILES[name], random) for _ in range(40))]

    for data in (each for file in broken for each in with_repairs(file)):
        assert outcome(data) == plain(data)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["f2", "f4", "f8"])
def test_imagecodecs_undoes_the_predictor_of_every_float(imagecodecs, plain, kind, order):
    file = make_tiff(disparity_map().astype(kind), "deflate", order, 3, rows_per_strip=10)

    assert outcome(file) == plain(file)
