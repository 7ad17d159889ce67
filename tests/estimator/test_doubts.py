"""Each reason to doubt an angle, on a map that gives it; a map that gives none."""

import inspect
import math
import re

import numpy as np
import pytest

from rollcli.estimator import doubts
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from tests.estimator.synthetic_maps import bent_road, flat_road

V, U = np.mgrid[:480, :640].astype(float)


def road(roll_deg):
    """A flat road that fills the map below its horizon, 480 x 640, px."""
    return flat_road(roll_deg, width=640, height=480, focal=560.0)


def with_noise(disparity, sigma=0.15):
    """The map with white noise on its valid pixels."""
    noise = np.random.default_rng(0).normal(0, sigma, disparity.shape)
    return np.where(disparity > 0, np.maximum(disparity + noise, 0.01), 0)


def twisted_road():
    """A road whose roll changes from near to far."""
    y = (V - 300) * math.cos(0.05) - (U - 320) * math.sin(0.05)
    return with_noise(np.where(y > -150, 40 + 0.25 * y + 0.0015 * (U - 320) * y, 0))


def noise_alone():
    return np.random.default_rng(2).uniform(1, 9, (40, 60))


def saddle():
    """A surface that an angle explains hardly better than its mirror image."""
    v, u = np.mgrid[:60, :100] - np.array([29.5, 49.5])[:, None, None]
    return 100 + 0.02 * u * v + 0.001 * (u - v)


def two_halves():
    """A road whose near half has another roll than its far half."""
    return with_noise(np.where(V > 330, road(4), road(5.8)), 0.3)


def behind_a_car():
    """A road of which a car hides most of the lane, a few metres ahead."""
    hidden = (np.abs(U - 320) < 150) & (V > 200) & (V < 470)
    return with_noise(np.where(hidden, road(4)[470, 320], road(4)))


def close_table():
    """A table that fills the view of a camera close above it, but for a box."""
    box = (np.abs(U - 200) < 80) & (np.abs(V - 300) < 80)
    return with_noise(np.where(box, 70, 46 + 0.1 * (V - 240)))


def dashboard():
    """A car's dashboard and its front, which is steep, and through the window above them nothing."""
    return with_noise(np.where(V > 420, 80, np.where(V > 300, road(4), 0)))


def table(roll_deg):
    """A table seen from above, with things on it, and the floor behind it."""
    y = (V - 240) * math.cos(math.radians(roll_deg)) - (U - 320) * math.sin(math.radians(roll_deg))
    top = np.where(y > -100, 50 + 0.03 * y, 20)
    for left, above, disparity in ((100, 60, 58), (250, 220, 63), (420, 120, 55)):
        top[above : above + 150, left : left + 110] = disparity
    return with_noise(top, 0.2)


MAPS = {
    "no convergence within the iterations allowed": (noise_alone, {"road": "all", "tolerance": 1e-300}),
    "a lower minimum of the energy lies at 90.0000 degrees": (lambda: bent_road(90), {"road": "all"}),
    "the energy is nearly as low at -30.96 degrees": (saddle, {"road": "all", "method": "exact"}),
    "the disparity grows upward": (lambda: road(4)[::-1], {"road": "all"}),
    "the view is as narrow as that of a table": (lambda: with_noise(50 + 0.06 * (V - 240), 0.05), {}),
    "a camera that looks down so far sees more of a road": (close_table, {}),
    "the plane ends near ahead": (lambda: with_noise(np.where(V > 270, road(4), 5)), {}),
    "the plane is seen near ahead alone": (dashboard, {}),
    "the plane is closed off near ahead": (lambda: with_noise(np.maximum(road(4), 22)), {}),
    "another plane, with another roll": (lambda: np.maximum(road(-10), road(10)), {}),
    "the road's pixels moved the roll": (twisted_road, {}),
    "the roll is at its bound": (lambda: road(20.2), {"max_roll": math.radians(20.25)}),
    "noise and misfit leave the angle open": (
        lambda: with_noise(np.where(np.abs(U - 320) < 40, road(4), 0), 0.8),
        {},
    ),
    "too few pixels lie away from the map's border": (lambda: noise_alone()[:3], {"road": "all"}),
    "the interval is wide": (two_halves, {"max_interval": math.radians(0.02)}),
}


@pytest.mark.parametrize("reason", MAPS)
def test_a_map_made_for_a_reason_is_suspect_and_says_so(reason):
    make, options = MAPS[reason]

    estimate = estimate_roll(make(), Request(**options))

    assert estimate.status == "suspect"
    assert reason in estimate.message


def test_there_is_a_map_for_every_reason():
    assert len(MAPS) == len(re.findall(r"^ +yield (?!from)", inspect.getsource(doubts), re.MULTILINE))


@pytest.mark.parametrize(("roll_deg", "mask"), [(-15, None), (0, None), (4, None), (4, V > 380)])
def test_a_road_that_fills_the_map_or_a_mask_of_the_nearest_is_beyond_doubt(roll_deg, mask):
    estimate = estimate_roll(with_noise(road(roll_deg)), mask=mask)

    assert (estimate.status, estimate.message) == ("ok", "")


def test_a_street_that_is_narrow_from_a_truck_is_beyond_doubt():
    """From 8 camera heights on, house fronts 0.9 of them to the sides fill most of the view."""
    flat = road(0)
    fronts = (flat[-1, 320] - flat[-2, 320]) * np.abs(U - 320) / 0.9

    estimate = estimate_roll(with_noise(np.maximum(flat, fronts)))

    assert (estimate.status, estimate.message) == ("ok", "")


@pytest.mark.parametrize("rows", [5, 10, 20])
def test_a_border_of_small_disparities_below_the_road_is_no_end_of_it(rows):
    bordered = with_noise(road(4))
    bordered[-rows:] = 1

    estimate = estimate_roll(bordered)

    assert (estimate.status, estimate.message) == ("ok", "")


@pytest.mark.parametrize("rows", [(300, 340), (330, 400)])
def test_a_puddle_across_the_lane_is_no_end_of_it(rows):
    """It mirrors the sky: small disparities, with road before and behind it."""
    wet = (rows[0] < V) & (rows[1] > V) & (np.abs(U - 320) < 180)

    estimate = estimate_roll(np.where(wet, 2, with_noise(road(4))))

    assert abs(math.degrees(estimate.theta) - 4) < 0.1
    assert (estimate.status, estimate.message) == ("ok", "")


def test_what_a_car_leaves_of_the_road_gives_an_angle_beyond_doubt():
    estimate = estimate_roll(behind_a_car())

    assert abs(math.degrees(estimate.theta) - 4) < 0.1
    assert (estimate.status, estimate.message) == ("ok", "")


def test_a_camera_that_looks_up_need_not_see_much_of_its_road():
    """The horizon lies 100 rows below the centre; walls beside the lane reach up to the top."""
    walls = 0.25 / 3 * np.abs(U - 320)

    estimate = estimate_roll(with_noise(np.maximum(0.25 * (V - 340), walls)))

    assert abs(math.degrees(estimate.theta)) < 0.1
    assert (estimate.status, estimate.message) == ("ok", "")


@pytest.mark.parametrize("roll_deg", [-20, 0, 12])
def test_a_table_is_no_road(roll_deg):
    estimate = estimate_roll(table(roll_deg))

    assert estimate.status == "suspect"
    assert "sees more of a road" in estimate.message
