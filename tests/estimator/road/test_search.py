"""What is done to a road moves its angle by little: shares of noise, kinds of maps, walls, kerbs, verges."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.simulate.spec import FrameSpec
from tests.estimator.road.test_surface import CAMERA_HEIGHT, disparity_of
from tests.slow import mostly_slow, repeatable
from tests.true_disparity import true_disparity


def street(roll_deg=4.0, seed=8, scene="street"):
    spec = FrameSpec(scene=scene, roll=math.radians(roll_deg), pitch=0.05, seed=seed)
    return true_disparity(spec)[0].astype(np.float32)


def angle_deg(disparity, mask=None):
    return estimate_roll(disparity, mask=mask).roll_deg


def replaced(disparity, share, seed=0):
    """The map with a share of its pixels replaced by noise of up to its largest disparity."""
    chance = np.random.default_rng(seed)
    noise = chance.uniform(0, disparity.max(), disparity.shape)
    return np.where(chance.random(disparity.shape) < share, noise, disparity).astype(np.float32)


@pytest.mark.parametrize(("share", "most_deg"), [(0.0, 0.02), (0.3, 0.05), (0.5, 0.1), (0.67, 0.15)])
@pytest.mark.parametrize("scene", mostly_slow(["street", "verge"], "street"))
def test_a_share_of_noise_moves_the_angle_by_so_much_at_most(scene, share, most_deg):
    for roll_deg in (-20, -3, 0, 9):
        off = angle_deg(replaced(street(roll_deg, scene=scene), share)) - roll_deg
        assert abs(off) < most_deg, roll_deg


@pytest.mark.slow
@repeatable
@given(st.floats(-40, 40), st.floats(0.1, 0.6), st.floats(100, 300))
def test_any_plane_with_noise_of_a_tenth_of_a_pixel_is_found(roll_deg, slope, horizon):
    v, u = np.mgrid[:480, :640]
    roll = math.radians(roll_deg)
    road = slope * ((v - horizon) * math.cos(roll) - (u - 320) * math.sin(roll))
    noise = np.random.default_rng(1).normal(0, 0.1, road.shape)
    assert angle_deg(np.where(road > 1, road + noise, 0)) == pytest.approx(roll_deg, abs=0.05)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint8, np.uint16, np.int16])
def test_any_type_of_map_and_whole_pixels_of_it_will_do(dtype):
    assert angle_deg(np.rint(street()).astype(dtype)) == pytest.approx(4, abs=0.05)


@pytest.mark.parametrize(("step", "most_deg"), [(0.25, 0.02), (1, 0.05), (4, 0.3)])
def test_rounding_moves_the_angle_by_so_much_at_most(step, most_deg):
    assert angle_deg(step * np.rint(street() / step)) == pytest.approx(4, abs=most_deg)


@pytest.mark.parametrize("first", [0, 1])
def test_a_map_of_which_every_second_row_and_column_is_valid_will_do(first):
    disparity, grid = street(), np.zeros((480, 640), bool)
    grid[first::2, first::2] = True
    assert angle_deg(np.where(grid, disparity, 0)) == pytest.approx(4, abs=0.05)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5])
def test_a_sparse_map_will_do(share):
    known = np.random.default_rng(3).random((480, 640)) < share
    assert angle_deg(np.where(known, street(), 0)) == pytest.approx(4, abs=0.1)


@pytest.mark.parametrize("inside", [45, 500])
def test_a_few_pixels_inside_or_a_single_row_are_too_few_to_look_for_a_road(inside):
    disparity, few = street(), np.zeros((480, 640), bool)
    few[300, 100 : 100 + inside] = few[:2] = few[400:440, :2] = True
    with pytest.raises(EstimationError, match=f"only {inside} valid pixels away .* rows: 1, .* too few"):
        estimate_roll(np.where(few, disparity + 1, 0))


@pytest.mark.parametrize("seed", range(4))
def test_the_mirror_image_has_the_opposite_angle(seed):
    disparity = street(5, seed, "verge")
    assert angle_deg(disparity[:, ::-1]) == pytest.approx(-angle_deg(disparity), abs=0.03)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_a_wall_over_a_third_of_the_map_is_not_the_road(side, tilt):
    v, u = np.mgrid[:480, :640]
    wall = 40 - side * 0.02 * (u - 320) + tilt * v + np.random.default_rng(0).normal(0, 0.2, u.shape)
    disparity = np.where(side * (u - 320) > 105, wall, street(2))
    assert angle_deg(disparity) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
def test_a_kerb_that_grows_turns_the_angle_little_by_little():
    heights = np.linspace(0, 0.04, 17)  # m
    angles = [
        angle_deg(disparity_of(lambda x, h=height: h * np.clip((x - 1.8) / 0.3, 0, 1))) for height in heights
    ]
    assert max(map(abs, angles)) < 0.1
    assert np.abs(np.diff(angles)).max() < 0.02


def test_ground_that_is_as_high_as_the_lane_is_road_far_to_the_side_and_a_platform_is_not():
    def shares(height):
        disparity = disparity_of(lambda x: height * CAMERA_HEIGHT * (x > 1.5))
        return estimate_roll(disparity).road_fraction

    assert shares(0.05) < 0.85 * shares(0.0)


def test_neighbours_outside_a_mask_do_not_count():
    disparity, road = street(), np.zeros((480, 640), bool)
    road[260:, 200:440] = True
    beside = np.where(road, disparity, disparity + 1)  # within the tolerance: it would move the means
    assert angle_deg(beside, mask=road) == pytest.approx(4, abs=0.01)
