"""Errors of a result against known angles."""

import dataclasses

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.evaluate.accuracy import assess, assess_heights
from rollcli.evaluate.truth import KnownPose
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


def test_heights_are_compared_at_their_distances_where_all_that_takes_is_there(tmp_path):
    disparity = np.array([[20, 10, 10, 1, 0]] * 2, np.float32)  # 5, 10, 10 and 100 m ahead, and no road
    off = np.array([[0.25, -0.5, np.nan, 9, 9], [0.75, -0.5, -0.5, 9, 9]], np.float32)
    for name, values in (("made", off), ("truth/heights", 0 * disparity), ("truth/disparity", disparity)):
        (tmp_path / name).mkdir(parents=True)
        for frame in ("frame1", "frame2", "frame3")[: 2 if name == "truth/heights" else 3]:
            np.save(tmp_path / name / f"{frame}.npy", values)
    places = [str(tmp_path / each) for each in ("made", "truth/heights", "truth/disparity")]
    known = {f"frame{k}": KnownPose(0.0, focal_baseline=100.0) for k in (1, 2, 3)}
    first, second, third = rows(1, 1, 1, ending=".npy")  # the second has no metres, the third no truth
    of_metres = [dataclasses.replace(first, height_m=1.5), second, dataclasses.replace(third, height_m=1.5)]
    found = assess_heights(of_metres, known, *places)
    figures = {at: [each.count, each.median, each.p95, each.bias] for at, each in found.items()}
    assert figures == {5: pytest.approx([1, 0.5, 0.725, 0.5]), 10: pytest.approx([1, 0.5, 0.5, -0.5])}
    assert assess_heights(of_metres[1:], known, *places) is None
    np.save(tmp_path / "made" / "frame1.npy", off[:1])
    with pytest.raises(InputError, match="differ in size: 5x1, 5x2, 5x2"):
        assess_heights(of_metres, known, *places)


def test_an_error_of_just_the_limit_is_not_above_it_and_just_of_the_interval_is_inside():
    level = {f"frame{k}": KnownPose(0.0) for k in (1, 2, 3)}
    found = assess(rows(0.5, -0.5, 0.25, ci95=0.5), level, "rolls.csv")
    assert (found.roll.share_above_0_5_deg, found.roll.coverage_95) == (0, 1)
    assert (found.roll.worst, found.roll.worst_file) == (0.5, "maps/frame1.png")
    given = dataclasses.replace(rows(0.0)[0], pitch_deg=0.5, pitch_ci95_deg=0.5)
    assert assess([given], {"frame1": KnownPose(0.0, 0.0)}, "").pitch.coverage_95 == 1
    lane = {"frame1": KnownPose(0.0, lane_deg=(-0.25, 0.125))}
    reached = [assess(rows(angle, ci95=0.5), lane, "").roll for angle in (0.625, 0.63, -0.75, -0.76)]
    assert [each.coverage_95 for each in reached] == [1, 0, 1, 0]
    unsure = dataclasses.replace(given, pitch_ci95_deg=None)
    assert assess([unsure], {"frame1": KnownPose(0.0, 0.0)}, "").pitch.coverage_95 is None


def test_the_worst_height_is_the_worst_of_all_pixels(tmp_path):
    """Of many pixels some are enough for the other figures; the worst may be among those left out."""
    off = np.zeros((300, 400), np.float32)
    off[::2, 1] = 0.5  # 120,000 pixels at 5 m: every third would be taken
    off[7, 9] = -2.0
    places = [tmp_path / each for each in ("made", "truth/heights", "truth/disparity")]
    for place, values in zip(places, (off, 0 * off, np.full_like(off, 20)), strict=True):
        place.mkdir(parents=True)
        np.save(place / "frame1.npy", values)
    known = {"frame1": KnownPose(0.0, focal_baseline=100.0)}
    row = dataclasses.replace(rows(1, ending=".npy")[0], height_m=1.5)
    found = assess_heights([row], known, *map(str, places))
    assert (7 * 400 + 9) % 3
    assert found[5].worst == 2
