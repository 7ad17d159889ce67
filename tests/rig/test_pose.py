"""Pitch and height against rigs whose planes are made by ray casting, and on real streets."""

import dataclasses
import math
from itertools import product

import cv2
import numpy as np
import pytest

import rollcli
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import Tangent
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import pose_of, with_pose
from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from rollcli.stereo.match import StereoOptions, match_pair
from tests.estimator.synthetic_maps import cast
from tests.real_pairs import STREETS, needs_streets

WIDTH, HEIGHT = 320, 200


def random_rig(rng, *, square=True):
    fx = rng.uniform(150, 400)
    fy = fx if square else fx * rng.uniform(0.97, 1.03)
    centre = rng.uniform(-30, 30, 2) + np.array([WIDTH, HEIGHT]) / 2
    calibration = Calibration(fx, fy, *centre.tolist(), rng.uniform(0.1, 0.8), rng.uniform(-5, 5))
    return calibration, rng.uniform(-0.4, 0.4), rng.uniform(-0.1, 0.3), rng.uniform(0.5, 3)


def plane_tangent(disparity):
    """The tangent of a map that is a plane, from three of its pixels."""
    v, u = np.nonzero(disparity)
    d0, c1, c2 = np.linalg.lstsq(np.column_stack([np.ones_like(u), u, v]), disparity[v, u], rcond=None)[0]
    slope = math.hypot(c1, c2)
    row = HEIGHT / 2
    return Tangent(math.atan2(-c1, c2), row, float(d0 + slope * row), slope, None)


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("square", [True, False])
def test_the_pose_of_a_ray_cast_plane_is_the_rigs(seed, square):
    calibration, roll, pitch, height = random_rig(np.random.default_rng(seed), square=square)
    pose = pose_of(plane_tangent(cast(calibration, roll, pitch, height)), calibration)
    assert (pose.roll, pose.pitch, pose.height) == pytest.approx((roll, pitch, height), abs=1e-9)


def test_the_interval_of_the_roll_is_turned_as_the_roll_is():
    """The image's angle moved by a little, both ways: the rig's moves by as much more as its interval is."""
    calibration = Calibration(300.0, 150.0, 170.0, 80.0, 0.5)
    disparity = cast(calibration, math.radians(10), 0.4, 1.6)
    noise = np.random.default_rng(2).normal(0, 0.3, disparity.shape)
    estimate = estimate_roll(np.where(disparity > 0, disparity + noise, 0))
    step = 1e-4
    rolls = [math.atan(2 * math.tan(estimate.theta + each)) for each in (-step, step)]
    ratio = (rolls[1] - rolls[0]) / (2 * step)
    posed = with_pose(estimate, calibration)
    assert abs(ratio - 1) > 0.3
    assert posed.ci95 == pytest.approx(ratio * estimate.ci95, rel=1e-3)
    assert with_pose(dataclasses.replace(estimate, ci95=math.pi / 2), calibration).ci95 == math.pi / 2
    assert posed.tangent.theta == estimate.theta


@pytest.mark.parametrize(("fy", "pitch"), [(300, 0), *product((100, 160, 200), (0, 0.3))])
@pytest.mark.parametrize("roll_deg", [0, 20])
def test_roll_and_camber_of_a_crown_are_true_whatever_the_shape_of_pixels_and_the_pitch(fy, roll_deg, pitch):
    v, u = np.mgrid[:240, :320]
    x, y, roll = (u - 159.5) / 200, (v - 119.5) / fy, math.radians(roll_deg)
    across, below = x * math.cos(roll) + y * math.sin(roll), y * math.cos(roll) - x * math.sin(roll)
    down = below * math.cos(pitch) + math.sin(pitch)
    # 1.5 m below the rig, a crown that falls by 0.02 / 2 of the camera's height this far to the side
    crown = 100 / 3 * (down + np.sqrt(np.maximum(down**2 - 0.04 * across**2, 0)))
    view, rig = np.where(down > 0.1, crown, 0), Calibration(200.0, fy, 159.5, 119.5, 0.5)
    found, later = rollcli.estimate_roll(view, calibration=rig), with_pose(estimate_roll(view), rig)
    assert (found.camber, later.camber) == pytest.approx((-0.02, -0.02), abs=0.001)
    assert found.theta == pytest.approx(roll, abs=1e-4)


def noisy_plane(rng):
    rig, pitch, height = Calibration(250, 250, 160, 90, 0.5), rng.uniform(0.1, 0.3), rng.uniform(1.2, 2)
    disparity = cast(rig, rng.uniform(-0.1, 0.1), pitch, height)
    return np.where(disparity > 0, disparity + rng.normal(0, 0.3, disparity.shape), 0), rig, [pitch, height]


def rough_lane(rng):
    spec = FrameSpec("bare", 0, 0.05, size=(160, 120), focal=112, roughness="C", seed=rng.integers(1000))
    rig = Calibration(spec.focal, spec.focal, *spec.centre, spec.baseline)
    return render_frame(spec).disparity, rig, [spec.pitch, spec.height]


# the known pitch of a rough lane is that at the rig, and the tangent touches it ahead
@pytest.mark.parametrize(
    ("case", "least"), [(noisy_plane, 36), pytest.param(rough_lane, 28, marks=pytest.mark.slow)]
)
def test_the_intervals_hold_the_truth(case, least):
    held = np.zeros(2)
    for seed in range(40):
        disparity, rig, known = case(np.random.default_rng(seed))
        posed = with_pose(estimate_roll(disparity), rig)
        off = np.subtract([posed.pitch, posed.height_m], known)
        held += np.abs(off) <= [posed.pitch_ci95, posed.height_ci95_m]
    assert (held >= least).all()


@pytest.mark.parametrize(("down", "right"), [(1, 2), (2, 1)])
def test_the_interval_on_uneven_ground_is_the_same_whatever_the_shape_of_pixels(down, right):
    disparity, rig, _ = rough_lane(np.random.default_rng(0))
    fewer = Calibration(rig.fx / right, rig.fy / down, rig.cx / right, rig.cy / down, rig.baseline)
    found = rollcli.estimate_roll(disparity[::down, ::right], calibration=fewer)
    assert found.ci95 == pytest.approx(rollcli.estimate_roll(disparity, calibration=rig).ci95, rel=0.3)


@pytest.mark.parametrize("curvature", [-0.001, 0.001])
def test_on_a_bent_road_the_pose_is_that_over_the_road_where_the_tangent_touches_it(curvature):
    calibration = Calibration(720.0, 720.0, 620.0, 170.0, 0.54)
    pitch, height = 0.03, 1.6
    v = np.arange(375.0)
    down = np.tan(np.arctan((v - calibration.cy) / calibration.fy) + pitch)
    # the ray meets height - curvature z^2 / 2 below the camera's level
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(down**2 + 2 * curvature * height)
        z = np.where(down > 0.02, (root - down) / curvature, np.inf)
    seen = np.isfinite(z)
    z = z[seen]
    along_axis = z * math.cos(pitch) + (height - curvature * z**2 / 2) * math.sin(pitch)
    disparity = np.zeros((375, 1242))
    disparity[seen] = (calibration.fx * calibration.baseline / along_axis)[:, None]
    posed = with_pose(estimate_roll(disparity), calibration)
    far = calibration.fx * calibration.baseline / posed.tangent.disparity
    bend = math.atan(curvature * far)
    assert posed.pitch == pytest.approx(pitch + bend, abs=math.radians(0.03))
    over = (height + curvature * far**2 / 2) * math.cos(bend)
    assert posed.height_m == pytest.approx(over, rel=3e-3)


KITTIS = Calibration(707.0912, 707.0912, 601.8873, 183.1104, 0.5372)
RUNS = {"000074": (9, 10, 11), "000151": (7, 8), "000174": (10, 11)}


def posed_street(name, downscale=1.0):
    """A real street with the calibration that KITTI publishes for it."""
    left, right = (cv2.imread(str(STREETS / side / f"{name}.png"), -1) for side in ("left", "right"))
    disparity = match_pair(left, right, StereoOptions(downscale=downscale)).disparity
    return with_pose(estimate_roll(disparity), KITTIS.for_size(*left.shape[::-1]))


@pytest.mark.slow
@needs_streets
@pytest.mark.parametrize("run", RUNS)
def test_the_camera_is_where_kitti_says_and_stays_there(run):
    heights = [posed_street(f"{run}_{number:02}").height_m for number in RUNS[run]]
    assert all(1.55 <= height <= 1.75 for height in heights)
    assert np.ptp(heights) <= 0.03 * np.mean(heights)


@pytest.mark.slow
@needs_streets
def test_full_and_half_size_agree_within_their_intervals():
    full, half = posed_street("000174_11"), posed_street("000174_11", 2)
    assert abs(full.pitch - half.pitch) <= math.hypot(full.pitch_ci95, half.pitch_ci95)
    assert abs(full.height_m - half.height_m) <= math.hypot(full.height_ci95_m, half.height_ci95_m)
