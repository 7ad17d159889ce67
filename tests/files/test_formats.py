"""Map files are read as they are stored, whatever they are called; what cannot be read is named."""

import os

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError, OutputError, UsageError
from rollcli.files.formats import encode_stored
from rollcli.files.storage import read_bytes
from tests.binary_files import disparity_map, make_npy, make_png, make_tiff, png_file
from tests.files.codecs.test_png import NOISY, WRONG
from tests.run_cli import python


def test_numbers_that_a_format_cannot_hold_are_refused():
    for form, kind in (("png", "f4"), ("png", "i2"), ("pfm", "f8"), ("pfm", "u1")):
        with pytest.raises(OutputError, match="write TIFF or NPY instead"):
            encode_stored(np.ones((2, 2), kind), form)
    with pytest.raises(UsageError, match="jpg: unknown map format"):
        encode_stored(np.ones((2, 2)), "jpg")


def test_paths_that_are_no_files_are_named(tmp_path):
    dangling = tmp_path / "dangling.png"
    dangling.symlink_to(tmp_path / "gone.png")
    loop = tmp_path / "loop.png"
    loop.symlink_to(loop)

    for path, reason in (
        (tmp_path, "is a folder, not a file"),
        (tmp_path / "none.png", "no such file"),
        (dangling, "is a link to nothing"),
        (loop, "cannot be read"),
        (tmp_path / ("x" * 300), "cannot be read"),
        ("a\0b.png", "cannot be read"),
    ):
        with pytest.raises(InputError, match=reason):
            read_bytes(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_named_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")

    with pytest.raises(InputError, match="is not a regular file"):
        read_bytes(tmp_path / "pipe.png")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_named(tmp_path):
    path = tmp_path / "map.png"
    path.write_bytes(b"x")
    path.chmod(0)

    with pytest.raises(InputError, match=r"map.png: cannot be read: permission denied"):
        read_bytes(path)


IMAGE = np.random.default_rng(0).integers(0, 256, (20, 30, 3), dtype=np.uint8)


def test_nothing_is_printed_about_damaged_files(tmp_path):
    """OpenCV, libpng, tifffile and NumPy are silent in a worker."""
    values = disparity_map().astype(np.float32)
    tiff = make_tiff(values, "lzw", rows_per_strip=5, pages=2)
    wholes = {
        "a.tif": tiff,
        "b.npy": make_npy(values),
        "c.bmp": cv2.imencode(".bmp", IMAGE)[1].tobytes(),
        "d.ppm": cv2.imencode(".ppm", IMAGE)[1].tobytes(),
        "e.png": make_png((values * 256).astype(np.uint16)),
    }
    for number, data in enumerate([*NOISY, *(png_file(*chunks) for chunks in WRONG.values())]):
        (tmp_path / f"{number}.png").write_bytes(data)
    for name, whole in wholes.items():
        for length in range(5, len(whole), len(whole) // 20):
            (tmp_path / f"{length}{name}").write_bytes(whole[:length])
            (tmp_path / f"{length}x{name}").write_bytes(whole[:length] + b"\xff\0\xff" + whole[length + 3 :])
    script = (
        "import sys, pathlib\n"
        "from rollcli.errors import InputError\n"
        "from rollcli.files.codecs.png import silence_decoders\n"
        "from rollcli.files.formats import read_image, read_stored\n"
        "silence_decoders()\n"
        "for path in pathlib.Path(sys.argv[1]).iterdir():\n"
        "    for read in (read_image, read_stored):\n"
        "        try:\n"
        "            read(path)\n"
        "        except InputError:\n"
        "            print('refused')\n"
    )

    done = python(script, tmp_path, check=True)

    assert done.stderr == ""
    assert done.stdout.count("refused") > 80
