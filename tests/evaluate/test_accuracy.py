"""Errors of a result against known angles."""

import dataclasses
import math

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.evaluate.accuracy import assess, assess_heights
from rollcli.evaluate.run_accuracy import as_table
from rollcli.evaluate.truth import KnownPose, read_truth
from rollcli.files.results import Row


def rows(*angles, ci95=None, folder="maps/", ending=".png", status="ok"):
    """Rows frame1, frame2, ... with these angles; None is a row without one."""
    return [
        Row(
            f"{folder}frame{k}{ending}",
            status="error" if angle is None else status,
            roll_deg=angle,
            roll_ci95_deg=None if angle is None else ci95,
        )
        for k, angle in enumerate(angles, 1)
    ]


def truth(*degrees):
    return {f"frame{k}": KnownPose(math.radians(angle)) for k, angle in enumerate(degrees, 1)}


def write_truth(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_heights_are_compared_at_their_distances_where_all_that_takes_is_there(tmp_path):
    disparity = np.array([[20, 10, 10, 1, 0]] * 2, np.float32)  # 5, 10, 10 and 100 m ahead, and no road
    off = np.array([[0.25, -0.5, np.nan, 9, 9], [0.75, -0.5, -0.5, 9, 9]], np.float32)
    for name, values in (("made", off), ("truth/heights", 0 * disparity), ("truth/disparity", disparity)):
        (tmp_path / name).mkdir(parents=True)
        for frame in ("frame1", "frame2", "frame3")[: 2 if name == "truth/heights" else 3]:
            np.save(tmp_path / name / f"{frame}.npy", values)
    places = str(tmp_path / "made"), str(tmp_path / "truth")
    known = {f"frame{k}": KnownPose(0.0, focal_baseline=100.0) for k in (1, 2, 3)}
    first, second, third = rows(1, 1, 1, ending=".npy")  # the second has no metres, the third no truth
    of_metres = [dataclasses.replace(first, height_m=1.5), second, dataclasses.replace(third, height_m=1.5)]
    near, far = assess_heights(of_metres, known, *places)
    assert dataclasses.astuple(near) == pytest.approx((5, 1, 0.5, 0.725, 0.5))
    assert dataclasses.astuple(far) == pytest.approx((10, 1, 0.5, 0.5, -0.5))
    assert assess_heights(of_metres[1:], known, *places) is None
    np.save(tmp_path / "made" / "frame1.npy", off[:1])
    with pytest.raises(InputError, match="differ in size: 5x1, 5x2, 5x2"):
        assess_heights(of_metres, known, *places)


def test_the_figures_are_those_of_the_absolute_errors():
    found = assess(rows(1.1, 2.0, 2.4, 5.0), truth(1, 2, 3, 4))  # errors 0.1, 0, -0.6, 1
    assert found.roll.count == 4
    assert found.roll.median == pytest.approx(0.35)
    assert found.roll.p95 == pytest.approx(0.6 + 0.85 * 0.4)
    assert (found.roll.worst, found.roll.worst_file) == (pytest.approx(1), "maps/frame4.png")
    assert found.roll.bias == pytest.approx(0.125)
    assert found.roll.share_above_0_5_deg == 0.5


def test_angles_half_a_turn_apart_are_the_same():
    assert assess(rows(89.9), truth(-89.9)).roll.worst == pytest.approx(0.2)


def test_coverage_counts_the_truths_inside_their_interval():
    found = assess(rows(1.0, 2.0, 3.0, 4.0, ci95=0.25), truth(1.2, 2.3, 3.0, 3.76))
    assert (found.roll.coverage_95, found.roll.intervals) == (0.75, 4)


def test_an_error_of_just_the_limit_is_not_above_it_and_just_of_the_interval_is_inside():
    found = assess(rows(0.5, -0.5, 0.25, ci95=0.5), truth(0, 0, 0))
    assert (found.roll.share_above_0_5_deg, found.roll.coverage_95) == (0, 1)
    assert (found.roll.worst, found.roll.worst_file) == (0.5, "maps/frame1.png")
    given = dataclasses.replace(rows(0.0)[0], pitch_deg=0.5, pitch_ci95_deg=0.5)
    assert assess([given], {"frame1": KnownPose(0.0, 0.0)}).pitch.coverage_95 == 1
    unsure = dataclasses.replace(given, pitch_ci95_deg=None)
    assert assess([unsure], {"frame1": KnownPose(0.0, 0.0)}).pitch.coverage_95 is None


def test_without_intervals_there_is_no_coverage():
    found = assess(rows(1.0), truth(1))
    assert (found.roll.coverage_95, found.roll.intervals) == (None, 0)


def test_frames_match_by_stem_whatever_their_folder_and_ending():
    named = truth(0)
    for folder, ending in (("", ".npy"), ("a/b.c/", ".PNG"), ("c:\\maps\\", ".tiff"), ("left/", "")):
        assert assess(rows(0.0, folder=folder, ending=ending), named).roll.count == 1


def test_frames_without_an_angle_or_a_truth_are_named():
    found = assess(rows(1.0, None, 3.0), {**truth(1, 2), "frame9": KnownPose(0.0)})
    assert found.roll.count == 1
    assert found.no_angle == ("frame2", "frame9")
    assert found.no_truth == ("maps/frame3.png",)


def test_suspect_frames_are_compared_and_counted():
    given = rows(1.0, 1.5, status="suspect") + rows(2.0, folder="x", ending="b.png")
    found = assess(given, dict.fromkeys(("frame1", "frame2", "xframe1b"), KnownPose(0.0)))
    assert (found.roll.count, found.ok, found.suspect) == (3, 1, 2)


def test_truth_is_read_by_its_columns_whatever_else_is_there(tmp_path):
    path = write_truth(
        tmp_path / "t.csv", b"\xef\xbb\xbfpitch_deg,roll_deg,file\r\n0,-3.5,a/x.png\r\n1,2,y\r\n"
    )
    known = read_truth(path)
    assert {stem: pose.theta for stem, pose in known.items()} == {
        "x": math.radians(-3.5),
        "y": math.radians(2),
    }


TRUTH_WITH_POSE = (
    "file,roll_deg,pitch_deg,height_m,curvature_per_m\n"
    "frame1,1,3.0,1.5,0\nframe2,2,4.0,1.6,0\nframe3,3,5.0,1.7,0.001\nframe4,4,,,\n"
)


def posed_rows():
    poses = [(3.1, 0.2, 1.49, 0.02), (3.7, 0.2, 1.6, 0.02), (5.0, 0.2, 1.7, 0.02), (6.0, 0.2, 1.8, 0.02)]
    return [
        dataclasses.replace(row, pitch_deg=p, pitch_ci95_deg=pc, height_m=h, height_ci95_m=hc)
        for row, (p, pc, h, hc) in zip(rows(1.0, 2.0, 3.0, 4.0), poses, strict=True)
    ]


def test_pitch_and_height_are_compared_where_they_are_known_and_the_road_does_not_bend(tmp_path):
    known = read_truth(write_truth(tmp_path / "t.csv", TRUTH_WITH_POSE))
    found = assess(posed_rows(), known)
    pitch, height = found.pitch, found.height
    # errors of the first two frames: 0.1 and -0.3 degrees, -0.01 and 0 m
    assert (pitch.count, pitch.median, pitch.worst) == (2, pytest.approx(0.2), pytest.approx(0.3))
    assert pitch.p95 == pytest.approx(0.1 + 0.95 * 0.2)
    assert (pitch.bias, pitch.coverage_95) == (pytest.approx(-0.1), 0.5)
    assert (height.count, height.worst, height.coverage_95) == (2, pytest.approx(0.01), 1.0)


def test_without_known_poses_nothing_is_said_of_them(tmp_path):
    known = read_truth(write_truth(tmp_path / "t.csv", "file,roll_deg\nframe1,1\n"))
    assert assess(posed_rows(), known).pitch is None
    assert "pitch" not in as_table(assess(posed_rows(), truth(1, 2, 3, 4)))
