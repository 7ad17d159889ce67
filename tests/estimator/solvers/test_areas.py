"""Planes in one area, and in many that agree."""

import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import DEFAULT_REQUEST, Request
from rollcli.estimator.solvers.areas import iterative, lower_centre
from rollcli.estimator.solvers.solution import SolverStatus
from tests.estimator.synthetic_maps import bent_road, flat_road

SIZE = {"width": 320, "height": 240, "focal": 280.0}


def areas(disparity, usable=True):
    """The solution, and the pixels it rests on."""
    fit = iterative(disparity, (disparity > 0) & usable, DEFAULT_REQUEST, False)
    return fit.solution, fit.used


def road_with_obstacles(roll_deg, seed=0):
    """A road with noise, on which three boxes stand: fronts of constant disparity."""
    road = flat_road(roll_deg, **SIZE)
    rng = np.random.default_rng(seed)
    road = np.where(road > 0, road + rng.normal(0, 0.1, road.shape), 0)
    for top, left, height, width in ((120, 130, 70, 60), (100, 10, 90, 70), (110, 240, 60, 80)):
        road[top : top + height, left : left + width] = road[top + height - 1, left + width // 2]
    return road


@pytest.mark.parametrize("roll_deg", [-44, -12, 0, 3, 40])
def test_the_exact_map_of_a_flat_road_gives_its_roll(roll_deg):
    found, _ = areas(flat_road(roll_deg, **SIZE))
    assert math.degrees(found.theta) == pytest.approx(roll_deg, abs=1e-6)
    assert found.status.converged


@pytest.mark.parametrize("roll_deg", [-15, -2, 0, 8])
def test_obstacles_are_left_out(roll_deg):
    disparity = road_with_obstacles(roll_deg)
    found, used = areas(disparity)
    assert math.degrees(found.theta) == pytest.approx(roll_deg, abs=0.05)
    assert not used[150, 160]  # the box in the middle
    assert abs(estimate_roll(disparity, Request(method="exact", road="all")).roll_deg - roll_deg) > 0.5


def test_walls_beside_a_road_are_no_candidates():
    road = flat_road(2, **SIZE)
    u = np.arange(SIZE["width"])
    wall = np.broadcast_to(30 - 0.25 * u, road.shape)
    found, _ = areas(np.where(u < 110, wall, road))
    assert math.degrees(found.theta) == pytest.approx(2, abs=0.01)


def test_whole_pixels_still_agree():
    found, _ = areas(np.rint(flat_road(4, **SIZE)).astype(np.uint8))
    assert math.degrees(found.theta) == pytest.approx(4, abs=0.1)


def test_masked_pixels_have_no_say():
    disparity = flat_road(-5, **SIZE)
    usable = np.zeros(disparity.shape, bool)
    usable[130:, 60:260] = True
    spoilt = np.where(usable, disparity, np.random.default_rng(1).uniform(1, 90, disparity.shape))
    found, used = areas(spoilt, usable)
    assert math.degrees(found.theta) == pytest.approx(-5, abs=1e-6)
    assert not (used & ~usable).any()


def test_estimate_says_which_pixels_it_used():
    disparity = road_with_obstacles(3)
    found = estimate_roll(disparity, Request(method="areas", road="all"), road_mask=True)
    assert found.road_mask.sum() == pytest.approx(found.road_fraction * (disparity > 0).sum())
    assert found.iterations >= 1
    assert found.global_minimum is None
    _, _, bend = found.alpha
    assert bend == 0


def test_a_depth_map_is_refused_with_the_reason():
    with pytest.raises(EstimationError, match="grows downward in none"):
        areas(np.flipud(bent_road(0, bend=0)))


def test_scattered_pixels_are_refused_with_the_reason():
    sparse = flat_road(5, **SIZE) * (np.random.default_rng(0).random((240, 320)) < 0.05)
    with pytest.raises(EstimationError, match="no area of 12x12 pixels is at least half valid"):
        areas(sparse)


def test_areas_of_noise_whose_common_plane_is_no_road_have_not_converged():
    noise = np.random.default_rng(5).uniform(1, 9, (60, 80))
    pixels = iterative(noise, noise > 0, DEFAULT_REQUEST, False)
    assert pixels.solution.status is SolverStatus.DRIFTED
    v, u = np.nonzero(pixels.used)
    (_, c1, c2), *_ = np.linalg.lstsq(np.stack([np.ones(len(u)), u, v], axis=1), noise[v, u], rcond=None)
    assert c2 <= 0 or abs(c1) > math.tan(math.radians(45)) * c2


def test_areas_that_still_change_after_the_last_round_have_not_converged():
    v, u = np.mgrid[:60, :80] - np.array([29.5, 39.5])[:, None, None]
    curved = 80 + 0.3 * v - 0.004409 * v * v - 0.003132 * u * u - 0.00561 * u * v
    found = iterative(curved, curved > 0, DEFAULT_REQUEST, False).solution
    assert found.status is SolverStatus.STEP_LIMIT
    assert found.iterations == 20


def test_an_area_of_which_half_is_valid_is_enough():
    road = bent_road(4, bend=0, width=80, height=60)
    half = np.where(np.arange(80) % 2 == 0, road, 0)
    found, _ = areas(half)
    assert math.degrees(found.theta) == pytest.approx(4, abs=1e-6)
    half[::4, ::8] = 0
    with pytest.raises(EstimationError, match="at least half valid"):
        areas(half)


def default_area(shape):
    """The rows and columns that are documented."""
    height, width = shape
    return slice(round(0.6 * height), round(0.9 * height)), slice(round(0.35 * width), round(0.65 * width))


def plane_of(disparity):
    """What the default area gives."""
    return lower_centre(disparity, disparity > 0, DEFAULT_REQUEST, False)


def test_by_default_the_area_is_the_lower_centre():
    disparity = flat_road(6)
    rows, columns = default_area(disparity.shape)
    used = plane_of(disparity).used
    assert used[rows, columns].all()
    assert np.count_nonzero(used) == used[rows, columns].size
    assert rows.start / disparity.shape[0] > 0.5
    assert rows.stop < disparity.shape[0]


def test_what_lies_outside_the_area_has_no_say():
    clean = flat_road(6, pitch_deg=20)
    rows, columns = default_area(clean.shape)
    spoilt = np.random.default_rng(0).uniform(1, 90, clean.shape)
    spoilt[rows, columns] = clean[rows, columns]
    assert plane_of(spoilt).solution.theta == pytest.approx(plane_of(clean).solution.theta, abs=1e-9)


def test_a_mask_is_the_chosen_area():
    rolled, level = bent_road(9, bend=0), bent_road(0, bend=0)
    both = np.where(np.arange(160) < 80, rolled, level)
    left = np.zeros(both.shape, bool)
    left[:, :80] = True
    found = estimate_roll(both, Request(method="plane", road="all"), mask=left, road_mask=True)
    assert math.degrees(found.theta) == pytest.approx(9, abs=1e-6)
    assert found.road_mask.sum() == left.sum()
    assert (found.iterations, found.global_minimum) == (0, None)


def test_it_is_the_least_squares_plane_and_says_its_error():
    disparity = bent_road(4, noise=0.3, seed=5)
    used, energy, found = plane_of(disparity)
    v, u = np.nonzero(used)
    design = np.stack([np.ones(len(u)), u, v], axis=1)
    plane, squares, *_ = np.linalg.lstsq(design, disparity[v, u], rcond=None)
    assert found.theta == pytest.approx(math.atan(-plane[1] / plane[2]), abs=1e-9)
    rmse = math.sqrt(squares[0] / len(u))
    assert energy.rmse(energy.at(found.theta).value) == pytest.approx(rmse, rel=1e-6)


def test_an_area_without_pixels_is_refused_with_the_reason():
    disparity = flat_road(6)
    rows, columns = default_area(disparity.shape)
    disparity[rows, columns] = 0
    with pytest.raises(EstimationError, match="no valid pixel of road where the method looks"):
        plane_of(disparity)
