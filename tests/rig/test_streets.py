"""Pitch and height on real streets, with the calibration that KITTI publishes for them."""

import math

import cv2
import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import with_pose
from rollcli.stereo.match import StereoOptions, match_pair
from tests.run_cli import ROOT

STREETS = ROOT.parent / "shared" / "streets"
CALIBRATION = Calibration(707.0912, 707.0912, 601.8873, 183.1104, 0.5372)
RUNS = {"000074": (9, 10, 11), "000151": (7, 8), "000174": (10, 11)}

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not STREETS.is_dir(), reason=f"{STREETS}, the real streets, are not here"),
]


def posed(name, downscale=1.0):
    left, right = (cv2.imread(str(STREETS / side / f"{name}.png"), -1) for side in ("left", "right"))
    disparity = match_pair(left, right, StereoOptions(downscale=downscale)).disparity
    calibration = CALIBRATION.for_size(*left.shape[::-1])
    return with_pose(estimate_roll(disparity), calibration)


@pytest.mark.parametrize("run", RUNS)
def test_the_camera_is_where_kitti_says_and_stays_there(run):
    heights = [posed(f"{run}_{number:02}").height_m for number in RUNS[run]]
    assert all(1.55 <= height <= 1.75 for height in heights)
    assert np.ptp(heights) <= 0.03 * np.mean(heights)


def test_full_and_half_size_agree_within_their_intervals():
    full, half = posed("000174_11"), posed("000174_11", 2)
    assert abs(full.pitch - half.pitch) <= math.hypot(full.pitch_ci95, half.pitch_ci95)
    assert abs(full.height_m - half.height_m) <= math.hypot(full.height_ci95_m, half.height_ci95_m)
