"""Calibration files of every format, real and hostile."""

import time
import tracemalloc
from dataclasses import replace

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError, RollcliError
from rollcli.rig.calibration import CalibrationOptions
from rollcli.rig.read_calibration import parse_calibration
from rollcli.run.find import calibration_finder, read_calibration
from tests.rig import calibration_files as samples
from tests.rig.calibration_files import Rig

RIG = Rig()
SKEWED = Rig(
    fx=2262.52, fy=2265.3017905988554, cx=1096.98, cy=513.137, baseline=0.209313, width=2048, height=1024
)
OFFSET = Rig(doffs=31.25)


def parse(*texts, **options):
    files = [(f"calib{number}", text.encode()) for number, text in enumerate(texts)]
    return parse_calibration(files, CalibrationOptions(**options))


def numbers(calibration):
    return [getattr(calibration, name) for name in ("fx", "fy", "cx", "cy", "baseline", "doffs")]


def refusal(*texts, **options):
    with pytest.raises(RollcliError) as caught:
        parse(*texts, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("form", samples.WHOLE)
@pytest.mark.parametrize("rig", [RIG, SKEWED, OFFSET], ids=["square", "not-square", "doffs"])
def test_one_rig_written_in_every_format_is_one_calibration(form, rig):
    if rig.fx != rig.fy and form == "opencv-yaml":
        pytest.skip("Q has one focal length: a FileStorage of stereoRectify cannot hold two")
    text = samples.written(form, rig)
    found = parse(text)
    assert parse(text.replace("\n", "\r\n")) == found
    doffs = 0.0 if form in samples.WITHOUT_DOFFS else rig.doffs
    truth = [rig.fx, rig.fy, rig.cx, rig.cy, rig.baseline, doffs]
    assert numbers(found) == pytest.approx(truth, rel=1e-12, abs=1e-9)
    size = (rig.width, rig.height) if form in samples.WITH_SIZE else (None, None)
    assert (found.width, found.height) == size


CAMERAS = [np.array([[500.0, 0, cx], [0, 500, 240], [0, 0, 1]]) for cx in (320, 330)]


def rectified(path, shift, names):
    """The results of stereoRectify, and the text of a file that has those of these names."""
    found = {"R": np.eye(3), "T": shift}
    left, right = CAMERAS
    found["R1"], found["R2"], found["P1"], found["P2"], found["Q"], *_ = cv2.stereoRectify(
        left, np.zeros(5), right, np.zeros(5), (640, 480), found["R"], shift, flags=0
    )
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name in names:
        storage.write(name, found[name])
    storage.release()
    return found, path.read_text()


@pytest.mark.parametrize("lacking", [0, 1])
def test_the_size_of_a_ros_pair_is_that_of_the_file_that_states_one(lacking):
    texts = [samples.ros(RIG, right=each) for each in (False, True)]
    whole = parse(*texts)
    texts[lacking] = texts[lacking].partition("\n")[2].partition("\n")[2]
    assert parse(*texts) == whole
    assert (whole.width, whole.height) == (RIG.width, RIG.height)


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
@pytest.mark.parametrize("names", [("R", "T", "P1", "P2", "Q"), ("P1", "P2"), ("Q",)], ids="-".join)
def test_what_opencv_itself_writes_is_read_and_swapped_cameras_are_told(tmp_path, names, ending):
    path, shift = tmp_path / f"extrinsics.{ending}", np.array([[-RIG.baseline], [0.001], [-0.002]])
    results, text = rectified(path, shift, names)
    found, p1, p2 = parse(text), results["P1"], results["P2"]
    # the rectified rows run along the baseline, whose length rectification keeps
    expected = [p1[0, 0], p1[1, 1], p1[0, 2], p1[1, 2], np.linalg.norm(shift), p2[0, 2] - p1[0, 2]]
    assert numbers(found) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert "taken for metres" in found.notes[0]
    assert "its right camera stands left of its left one" in refusal(rectified(path, -shift, names)[1])


def test_what_opencv_appends_to_a_file_is_read(tmp_path):
    whole, parts = tmp_path / "whole.yml", tmp_path / "parts.yml"
    results, text = rectified(whole, np.array([[-RIG.baseline], [0], [0]]), ("P1", "P2"))
    for name in ("P1", "P2"):
        storage = cv2.FileStorage(str(parts), cv2.FILE_STORAGE_APPEND)
        storage.write(name, results[name])
        storage.release()
    assert parts.read_text().count("---") == 2
    assert parse(parts.read_text()) == parse(text)


def test_bytes_that_are_no_text_and_large_files_are_refused(tmp_path):
    for data, reason in ((b"P0: \xff\xfe\x00", "is not text"), (b" " * (1 << 20 | 1), "up to 1 MB")):
        (tmp_path / "c").write_bytes(data)
        with pytest.raises(InputError, match=reason):
            read_calibration(tmp_path / "c")
    find = calibration_finder(CalibrationOptions(calib=(str(tmp_path),)))
    for name in ("c_1", "c_2"):  # of a thousand frames it is read once
        with pytest.raises(InputError, match="up to 1 MB"):
            find(name)
        (tmp_path / "c").write_text(ROS_HEAD)


ROS_HEAD = "projection_matrix:\n"
HOSTILE = {
    "anchors without end": ROS_HEAD
    + "  a: &a [x, x]\n"
    + "".join(f"  b{n}: &b{n} [*a, *a]\n" for n in range(99)),
    "an object": ROS_HEAD + "  data: !!python/object/apply:os.system ['echo ran > ran']\n",
    "an object in brackets": ROS_HEAD + "  data: [!!python/object/apply:os.system ['echo ran > ran']]\n",
    "brackets": ROS_HEAD + "  data: " + "[" * 100_000 + "]" * 100_000 + "\n",
    "braces": ROS_HEAD + "  data: " + "{a: " * 100_000 + "}" * 100_000 + "\n",
    "dashes": ROS_HEAD + "- " * 100_000 + "1\n",
    "indents": ROS_HEAD + "".join(" " * n + "a:\n" for n in range(1, 1400)),
    "an open bracket": ROS_HEAD + "  data: [1, 2\n" * 20_000,
    "spaces": ROS_HEAD + "  data" + " " * 90_000 + "x\n",
    "spaces in brackets": ROS_HEAD + "  data: [1" + " " * 90_000 + ", 2]\n",
    "digits": ROS_HEAD + "  data: [" + "7" * 5000 + "]\n",
    "quotes": ROS_HEAD + "  data: ['" + '"' * 100_000 + "\n",
    "deep JSON": '{"intrinsic": {"u0": ' + "[" * 100_000 + "]" * 100_000 + "}}",
    "JSON digits": '{"intrinsic": {"fx": ' + "7" * 5000 + ', "u0": 1}}',
    "deep XML": "<opencv_storage><P1 >" + "<a>" * 100_000,
    "XML entities": '<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;">]>'
    "<opencv_storage><P1 >&c;</P1></opencv_storage>",
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_file_is_refused_without_running_code_or_filling_memory(what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tracemalloc.start()
    refusal(HOSTILE[what])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 64 << 20
    assert not list(tmp_path.iterdir())


WHITE = 1 << 17  # characters: a reader that takes the square of their number takes minutes
STARTS = {
    "KITTI": "P0: 1\nP1: x{}x",
    "KITTI's key": "P0: 1\n{}x",
    "DrivingStereo": "P_rect_101:{}x",
    "Middlebury": "cam0=[1]\ndoffs{}= 1{}x",
    "ORB-SLAM": "Camera.bf: 1\na{}",
    "ROS": "projection_matrix: [1]{}x",
    "OpenCV": "%YAML:1.0\nP1: !!opencv-matrix{}x",
    "OpenCV's XML": "<opencv_storage><P1 >{}",
    "OpenCV's JSON": '{{"P1": "opencv-matrix"{}',
    "Cityscapes": '{{"intrinsic": {{"u0": 1}}{}',
    "Kalibr": "cam1:\n  T_cn_cnm1: 1{}x",
    "ZED": "[LEFT_CAM_HD]\n[STEREO]\nBaseline{}x",
    "none": "{}",
}


@pytest.mark.parametrize("white", [" ", "\n", "\t", "\r\n", "\n ", "P1 ", "P1: ", "[STEREO]\n"], ids=repr)
@pytest.mark.parametrize("form", STARTS)
def test_white_space_and_repeated_keys_take_a_time_in_proportion_to_their_number(form, white):
    text = STARTS[form].replace("{}", white * (WHITE // len(white))).replace("{{", "{").replace("}}", "}")
    before = time.process_time()
    refusal(text)
    assert time.process_time() - before < 3


def test_a_baseline_that_a_file_lacks_is_added_to_what_it_says():
    text = samples.written("middlebury", OFFSET)
    found = parse(text.replace("baseline=", "was="), baseline=OFFSET.baseline)
    assert replace(found, source="calib0") == parse(text)


def test_a_focal_length_beside_a_file_leaves_the_shape_of_its_pixels():
    half = parse(samples.written("kitti-benchmark", SKEWED), focal=SKEWED.fx / 2)
    assert (half.fx, half.fy) == pytest.approx((SKEWED.fx / 2, SKEWED.fy / 2), rel=1e-12)
