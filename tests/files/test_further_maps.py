"""Maps in the files that other programs write: NPZ, one axis more, RGB numbers, the other sign, EXR."""

import io
import zipfile

import cv2
import numpy as np
import pytest

from rollcli import read_disparity
from rollcli.errors import InputError
from rollcli.files.formats import decode_stored, encode_stored
from tests.binary_files import disparity_map
from tests.run_cli import road_map, rollcli


def npz(**arrays):
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def test_an_npz_holds_one_array_or_one_of_the_name_disparity():
    values = disparity_map().astype(np.float32)
    for data in (npz(anything=values), npz(other=values[:2], disparity=values), encode_stored(values, "npz")):
        stored = decode_stored(data, "map")
        assert stored.format == "npz"
        np.testing.assert_array_equal(stored.values, values)
    with pytest.raises(InputError, match="one array, or one of the name disparity; here: a, b"):
        decode_stored(npz(a=values, b=values), "map")


def test_broken_and_hostile_npz_files_are_refused():
    values = disparity_map().astype(np.float32)
    whole = npz(disparity=values)
    for end in range(4, len(whole), 97):
        with pytest.raises(InputError, match="map: "):
            decode_stored(whole[:end], "map")
    with pytest.raises(InputError, match="more than 32 MB once unpacked"):
        decode_stored(npz(disparity=np.zeros((3000, 3000), np.float32)), "map")
    with pytest.raises(InputError, match="pickle, which is never loaded"):
        decode_stored(npz(disparity=np.array([{}])), "map")
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
    (tmp_path / "a.png").write_bytes(foundation_stereo(disparity))
    found = read_disparity(tmp_path / "a.png", encoding="foundationstereo")
    np.testing.assert_allclose(found, np.where(disparity > 0, disparity, 0), atol=0.00051)
    given = ["--encoding", "foundationstereo"]
    assert rollcli("estimate", "a.png", *given, cwd=tmp_path).status == 0
    assert rollcli("derotate", "a.png", "--roll", "0", *given, "-o", "out", cwd=tmp_path).status == 0
    kept = read_disparity(tmp_path / "out/a.png", encoding="foundationstereo")
    np.testing.assert_allclose(kept, found, atol=1e-6)
    assert "photographs" in rollcli("estimate", "a.png", cwd=tmp_path).err
    cv2.imwrite(str(tmp_path / "grey.png"), np.ones((9, 9), np.uint8))
    assert "is no RGB PNG" in rollcli("estimate", "grey.png", *given, cwd=tmp_path).out


def test_an_exr_is_read_where_opencv_reads_it_and_else_a_line_says_what_to_do():
    header = b"\x76\x2f\x31\x01\x02\0\0\0dataWindow\0box2i\0\x10\0\0\0"
    for corners, reason in (
        ((0, 0, 9, 9), "save it as TIFF"),
        ((5, 0, 0, 9), "no pixels"),
        ((0, 0, 2**30, 9), "MB once"),
    ):
        with pytest.raises(InputError, match=reason):
            decode_stored(header + np.array(corners, "<i4").tobytes() + bytes(100), "map")
    try:
        data = encode_stored(disparity_map().astype(np.float32), "exr")
    except Exception as error:  # noqa: BLE001 (as this OpenCV was built)
        pytest.skip(str(error))
    np.testing.assert_array_equal(decode_stored(data, "map").values, disparity_map().astype(np.float32))
