"""The surface is that of the lane ahead, with its camber, whatever lies beside it."""

import math

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.estimator.road.find import find_road
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import fit_surface
from rollcli.estimator.tuning import TUNING
from tests.estimator.synthetic_maps import flat_road

WIDTH, HEIGHT, FOCAL = 640, 480, 400.0
BASELINE, CAMERA_HEIGHT = 0.5, 1.6
ROLL = math.radians(-3)


def disparity_of(height_at, roll_deg=0.0, pitch_deg=6.0):
    """Exact disparity of ground whose height in metres, X metres to the right of the rig, `height_at` says.

    The depth along each ray is found by bisection: below it the ray is above the ground.
    """
    roll, pitch = math.radians(roll_deg), math.radians(pitch_deg)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    x, y = (u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL
    across = x * math.cos(roll) + y * math.sin(roll)
    down = (y * math.cos(roll) - x * math.sin(roll)) * math.cos(pitch) + math.sin(pitch)
    near, far = np.full(u.shape, 0.5), np.full(u.shape, 60.0)
    for _ in range(40):
        middle = (near + far) / 2
        under = middle * down > CAMERA_HEIGHT - height_at(middle * across)
        near, far = np.where(under, near, middle), np.where(under, middle, far)
    noise = np.random.default_rng(2).normal(0, 0.1, u.shape)
    return np.where(far < 59, FOCAL * BASELINE / far + noise, 0)


def surface_of(disparity, *, parabolic=True):
    sample = take_sample(disparity, None, TUNING.sample)
    request = Request(model="parabola" if parabolic else "line")
    return fit_surface(sample, find_road(sample, request), request)


def found_in(height_at):
    return surface_of(disparity_of(height_at))


@pytest.mark.parametrize(
    ("roll_deg", "parabolic"), [(-8, True), (0, True), (3, True), (-8, False), (3, False)]
)
def test_a_flat_road_has_its_roll_and_no_camber_and_by_the_line_model_no_bend(roll_deg, parabolic):
    found = surface_of(disparity_of(lambda x: 0 * x, roll_deg), parabolic=parabolic)

    assert math.degrees(found.model.theta) == pytest.approx(roll_deg, abs=0.02)
    assert found.model.camber == pytest.approx(0, abs=5e-4)
    assert parabolic or found.model.alpha[2] == 0


@pytest.mark.parametrize("kerb", [0.03, 0.06, 0.08, 0.1, 0.15])
def test_a_platform_on_one_side_does_not_turn_the_angle(kerb):
    # the distance over which stereo matching smears a step
    found = found_in(lambda x: kerb * np.clip((x - 1.8) / 0.3, 0, 1))

    assert math.degrees(found.model.theta) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("slope", [-0.15, -0.06, 0.06, 0.15])
def test_a_verge_on_one_side_does_not_turn_the_angle(slope):
    found = found_in(lambda x: slope * np.maximum(0, x - 1.7))

    assert math.degrees(found.model.theta) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("fall", [0.01, 0.02, 0.03, 0.04])
@pytest.mark.parametrize("left_edge", [-6.0, -1.9])
def test_on_a_crowned_road_the_angle_is_that_under_the_rig(fall, left_edge):
    curvature = fall / 3.5  # falls by `fall` per metre 3.5 m to the side
    found = found_in(lambda x: -curvature / 2 * np.square(np.maximum(x, left_edge)))

    assert math.degrees(found.model.theta) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("fall", [0.02, 0.04])
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(("roll_deg", "cropped"), [(2, 0), (8, 160)])
def test_camber_is_reported_in_camera_heights(fall, sign, roll_deg, cropped):
    curvature = sign * fall / 3.5
    disparity = disparity_of(lambda x: curvature / 2 * np.square(x), roll_deg)[cropped:]
    estimate = estimate_roll(disparity, Request(middle=((WIDTH - 1) / 2, (HEIGHT - 1) / 2 - cropped)))
    assert estimate.camber == pytest.approx(curvature * CAMERA_HEIGHT, rel=0.15)
    assert math.degrees(estimate.theta) == pytest.approx(roll_deg, abs=0.02)


def test_where_only_the_middle_is_seen_camber_is_left_open():
    disparity = disparity_of(lambda x: 0 * x)
    columns = np.arange(WIDTH)
    narrow = np.where(np.abs(columns - WIDTH / 2) < 25, disparity, 0)

    assert estimate_roll(narrow).camber is None


@pytest.mark.parametrize("fall", [0.01, 0.03])
def test_on_a_roof_the_angle_is_that_of_the_side_the_rig_drives_on(fall):
    found = found_in(lambda x: -2 * fall * np.maximum(0, -1.6 - x))

    assert math.degrees(found.model.theta) == pytest.approx(0, abs=0.15)


def road_and_sides(sigma=0.1):
    """A road of -3 degrees with noise of sigma px, and how far to the right each pixel is, camera heights."""
    road = flat_road(-3, width=WIDTH, height=HEIGHT, focal=560.0, pitch_deg=0)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    x, y = u - (WIDTH - 1) / 2, v - (HEIGHT - 1) / 2
    below = y * math.cos(ROLL) - x * math.sin(ROLL)  # the horizon; a road's pixel is one height under it
    side = (x * math.cos(ROLL) + y * math.sin(ROLL)) / np.maximum(below, 1e-9)
    noise = np.random.default_rng(0).normal(0, sigma, road.shape)
    return np.where(road > 1, road + noise, 0), side


def test_pixels_with_noise_that_averages_out_are_road():
    disparity, side = road_and_sides(sigma=0.2)

    covered = surface_of(disparity).covers(disparity, TUNING)

    assert covered[(np.abs(side) < 1) & (disparity > 5)].mean() > 0.96


def test_twice_as_much_noise_is_seen_as_twice_as_much_though_the_tolerance_knows_of_neither():
    few, many = (surface_of(road_and_sides(sigma)[0]) for sigma in (0.75, 1.5))
    seen = [
        math.sqrt(np.average((each.d - each.model.disparity(each.x, each.y)) ** 2, weights=each.weights))
        for each in (few, many)
    ]
    assert seen[1] / seen[0] == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("slope", [-0.15, 0.15])
def test_a_verge_beyond_the_edge_of_the_road_is_no_road(slope):
    road, side = road_and_sides()
    disparity = road * (1 + slope * np.maximum(0, side - 1.4))

    covered = surface_of(disparity).covers(disparity, TUNING)

    assert not covered[side > 2].any()
    assert covered[(np.abs(side) < 1) & (road > 0)].mean() > 0.95


# of the height of the camera: at a hundredth the ground counts half, as `FitTuning.off_level` says
@pytest.mark.parametrize(("share", "is_road"), [(0.004, True), (0.008, True), (0.0125, False), (0.03, False)])
def test_ground_that_counts_half_as_much_as_the_lane_is_shown_as_road(share, is_road):
    disparity = disparity_of(lambda x: share * CAMERA_HEIGHT * np.clip((x - 1.2) / 0.1, 0, 1))
    to_the_right = (np.mgrid[:HEIGHT, :WIDTH][1] - (WIDTH - 1) / 2) * BASELINE / np.maximum(disparity, 1e-9)
    step = (disparity > 8) & (to_the_right > 1.4) & (to_the_right < 2.6)

    covered = surface_of(disparity).covers(disparity, TUNING)

    assert step.sum() > 20_000
    assert covered[step].mean() > 0.95 if is_road else covered[step].mean() < 0.05


def test_a_surface_that_crosses_the_road_without_rising_as_it_does_is_no_road():
    road, side = road_and_sides()
    crossing = np.abs(side + 1.8) < 0.5
    disparity = np.where(crossing & (road > 0), 15, road)

    covered = surface_of(disparity).covers(disparity, TUNING)

    near = crossing & (np.abs(road - 15) < 0.6)
    assert near.sum() > 100
    assert covered[near].mean() < 0.1


def test_pixels_that_do_not_lie_on_the_road_have_no_part_in_its_share():
    shares = {}
    for others in (0.0, 0.3):
        disparity = disparity_of(lambda x: 0 * x)
        above = (np.random.default_rng(4).random(disparity.shape) < others) & (disparity > 0)
        shares[others] = surface_of(disparity * (1 + 0.06 * above)).share  # three tolerances

    assert shares[0.3] == pytest.approx(0.7 * shares[0.0], rel=0.05)
