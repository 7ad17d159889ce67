"""Map files are read as they are stored, whatever they are called; what cannot be read is named.

Among them are those of other programs: NPZ, RGB numbers, EXR.
"""

import io
import os
import re
import zipfile

import cv2
import numpy as np
import pytest

from rollcli import read_disparity
from rollcli.errors import InputError
from rollcli.files.formats import decode_stored, encode_stored
from rollcli.files.storage import read_bytes
from tests.binary_files import disparity_map, make_npy, make_npz, make_png, make_tiff, png_file
from tests.files.codecs.test_pictures import WORKER
from tests.files.codecs.test_png import NOISY, WRONG
from tests.run_cli import error_of, python, road_map, rollcli


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_paths_that_are_no_files_are_named(tmp_path):
    dangling = tmp_path / "dangling.png"
    dangling.symlink_to(tmp_path / "gone.png")
    loop = tmp_path / "loop.png"
    loop.symlink_to(loop)

    os.mkfifo(tmp_path / "pipe.png")  # is not waited for

    for path, reason in (
        (tmp_path, "is a folder, not a file"),
        (tmp_path / "none.png", "no such file"),
        (tmp_path / "pipe.png", "is not a regular file"),
        (dangling, "is a link to nothing"),
        (loop, "cannot be read: .+"),
        ("x" * 300, "cannot be read: file name too long"),
        ("a\0b.png", "cannot be read: .*embedded null .*"),  # Pythons word it their own way
    ):
        assert re.fullmatch(f"map.png: {reason}", error_of(InputError, read_bytes, path, "map.png"))


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

    done = python(WORKER, *tmp_path.iterdir(), check=True)

    assert done.stderr == ""
    assert done.stdout.count(f"{tmp_path}{os.sep}") > 80  # which refusals begin with


def test_an_npz_holds_one_array_or_one_of_the_name_disparity():
    values = disparity_map().astype(np.float32)
    for data in (
        make_npz(anything=values),
        make_npz(other=values[:2], disparity=values),
        encode_stored(values, "npz"),
    ):
        stored = decode_stored(data, "map")
        assert stored.format == "npz"
        np.testing.assert_array_equal(stored.values, values)
    with pytest.raises(InputError, match="one array, or one of the name disparity; here: a, b"):
        decode_stored(make_npz(a=values, b=values), "map")


def test_broken_and_hostile_npz_files_are_refused():
    values = disparity_map().astype(np.float32)
    whole = make_npz(disparity=values)
    for end in range(4, len(whole), 97):
        with pytest.raises(InputError, match="map: "):
            decode_stored(whole[:end], "map")
    with pytest.raises(InputError, match="more than 32 MB once unpacked"):
        decode_stored(make_npz(disparity=np.zeros((3000, 3000), np.float32)), "map")
    with pytest.raises(InputError, match="pickle, which is never loaded"):
        decode_stored(make_npz(disparity=np.array([{}])), "map")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("a.npy", b"no array")
    with pytest.raises(InputError, match=r"a\.npy is no array"):
        decode_stored(buffer.getvalue(), "map")


def foundation_stereo(disparity):
    """Encode as FoundationStereo's depth_uint8_encoding does, channel by channel."""
    numbers = np.rint(disparity * 1000).astype(np.int64)
    red, rest = np.divmod(numbers, 255 * 255)
    green, blue = np.divmod(rest, 255)
    return cv2.imencode(".png", np.dstack([blue, green, red]).astype(np.uint8))[1].tobytes()


def test_numbers_in_three_channels_are_read_and_written_back(tmp_path):
    disparity = road_map()
    disparity[0, 0] = 255.2 * 255**2 / 1000  # its first digit is as large as that of a white pixel
    (tmp_path / "a.png").write_bytes(foundation_stereo(disparity))
    found = read_disparity(*os.scandir(tmp_path), encoding="foundationstereo")
    np.testing.assert_allclose(found, np.where(disparity > 0, disparity, 0), atol=0.00051)
    given = ["--encoding", "foundationstereo"]
    assert rollcli("estimate", "a.png", *given, cwd=tmp_path).status == 0
    assert rollcli("derotate", "a.png", "--roll", "0", *given, "-o", "out", cwd=tmp_path).status == 0
    kept = read_disparity(tmp_path / "out/a.png", encoding="foundationstereo")
    np.testing.assert_allclose(kept, found, atol=1e-6)
    assert "photographs" in rollcli("estimate", "a.png", cwd=tmp_path).err
    cv2.imwrite(str(tmp_path / "grey.png"), np.ones((9, 9), np.uint8))
    assert "is no RGB PNG" in rollcli("estimate", "grey.png", *given, cwd=tmp_path).out


def test_an_exr_is_read_where_opencv_reads_it_and_else_a_line_says_what_to_do(monkeypatch):
    header = b"\x76\x2f\x31\x01\x02\0\0\0dataWindow\0box2i\0\x10\0\0\0"
    for corners, reason in (
        ((0, 0, 9, 9), "save it as TIFF"),
        ((5, 0, 0, 9), "no pixels"),
        ((0, 0, 2**30, 9), "MB once"),
    ):
        with pytest.raises(InputError, match=reason):
            decode_stored(header + np.array(corners, "<i4").tobytes() + bytes(100), "map")
    grey, whole = disparity_map().astype(np.float32), header + bytes(8) + b"\x09\0\0\0" * 2
    seen = iter([np.dstack([grey] * 3), np.dstack([grey, grey, 0 * grey])])
    monkeypatch.setattr("rollcli.files.codecs.pictures.decoded_by_opencv", lambda *_: (next(seen), None))
    np.testing.assert_array_equal(decode_stored(whole, "map").values, grey)  # as some write one channel
    with pytest.raises(InputError, match="is an EXR of 3 channels; a disparity map has one"):
        decode_stored(whole, "map")
    monkeypatch.undo()
    try:
        data = encode_stored(disparity_map().astype(np.float32), "exr")
    except Exception as error:  # noqa: BLE001 (as this OpenCV was built)
        pytest.skip(str(error))
    np.testing.assert_array_equal(decode_stored(data, "map").values, disparity_map().astype(np.float32))
