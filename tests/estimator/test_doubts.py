"""Each reason to doubt an angle, on a map that gives it; a map that gives none."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rollcli.estimator.doubts import REASONS, Evidence, doubts_of
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import Interval
from rollcli.estimator.road.find import Road
from rollcli.estimator.solvers.exact import CertifiedSolution, Minimum
from rollcli.estimator.solvers.solution import Solution
from rollcli.estimator.tuning import DoubtTuning
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
    return np.random.default_rng(0).uniform(1, 9, (40, 60))


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
    "little of what lies ahead looks like a road": (lambda: np.minimum(road(-10), road(10)), {}),
    "the view is as narrow as that of a table or a room": (
        lambda: with_noise(50 + 0.06 * (V - 240), 0.05),
        {},
    ),
    "another plane, with another roll": (lambda: np.maximum(road(-10), road(10)), {}),
    "the road's pixels moved the roll": (twisted_road, {}),
    "the roll is at its bound": (lambda: road(20.2), {"max_roll": math.radians(20.25)}),
    "noise and unevenness leave the angle open": (
        lambda: with_noise(np.where(np.abs(U - 320) < 40, road(4), 0), 0.8),
        {},
    ),
    "the interval is wide": (two_halves, {"max_interval": math.radians(0.02)}),
}


@pytest.mark.parametrize("reason", MAPS)
def test_a_map_made_for_a_reason_is_suspect_and_says_so(reason):
    make, options = MAPS[reason]

    estimate = estimate_roll(make(), **options)

    assert estimate.status == "suspect"
    assert reason in estimate.message


def test_there_is_a_map_for_every_reason():
    assert len(MAPS) == len(REASONS)


@pytest.mark.parametrize("roll_deg", [-15, 0, 4])
def test_a_road_that_fills_the_map_is_beyond_doubt(roll_deg):
    estimate = estimate_roll(with_noise(road(roll_deg)))

    assert (estimate.status, estimate.message) == ("ok", "")


def test_what_a_car_leaves_of_the_road_gives_an_angle_beyond_doubt():
    estimate = estimate_roll(behind_a_car())

    assert abs(math.degrees(estimate.theta) - 4) < 0.1
    assert (estimate.status, estimate.message) == ("ok", "")


@pytest.mark.parametrize("roll_deg", [-20, 0, 12])
def test_a_table_is_no_road(roll_deg):
    estimate = estimate_roll(table(roll_deg))

    assert estimate.status == "suspect"
    assert "little of what lies ahead looks like a road" in estimate.message


BOUNDS = DoubtTuning(
    near_minimum=1.5,
    other_angle=0.25,
    least_score=0.25,
    least_steep_score=0.375,
    steep=0.5,
    rival_share=0.75,
    longest_move=0.125,
    bound_share=0.5,
    noise_share=0.25,
)


def just_within_every_bound():
    """What each reason looks at, exactly where an angle is still ok; all of it is exact in binary."""
    return {
        "energy": 1.5 * 64,  # of another minimum
        "elsewhere": 1.0,  # its angle
        "slope": 0.0,  # of the disparity down the road
        "score": 0.375,
        "horizon": 0.5,  # as far as a road with few pixels may not have it
        "rival": 0.75 * 0.375,
        "moved": 0.125,
        "theta": 0.5,
        "noise": 0.25,
        "half_width": 1.0,
    }


def doubts_about(energy, elsewhere, slope, score, horizon, rival, moved, theta, noise, half_width):
    found = [Minimum(0.0, 64.0), Minimum(elsewhere, energy)]
    surface = SimpleNamespace(moved=moved, model=SimpleNamespace(theta=theta))
    evidence = Evidence(
        energy=SimpleNamespace(plane=(9.0, 0.0, slope)),
        certified=CertifiedSolution(Solution(0.0, 1), found[0].energy, found, is_global=True),
        road=Road(np.array([2 * horizon, 0.0, 2.0]), score, rival),
        surface=surface,
        max_roll=1.0,
        max_interval=1.0,
        interval=Interval(noise, half_width),
    )
    return doubts_of(evidence, BOUNDS)


def test_what_is_just_within_every_bound_is_ok():
    assert doubts_about(**just_within_every_bound()) == []
    assert doubts_about(**just_within_every_bound() | {"energy": 64.0, "elsewhere": 0.25}) == []
    assert doubts_about(**just_within_every_bound() | {"horizon": 0.49, "score": 0.25, "rival": 0.18}) == []


@pytest.mark.parametrize(
    ("beyond", "says"),
    [
        ({"energy": 95.99}, "nearly as low"),
        ({"energy": 64.0, "elsewhere": 0.2501}, "nearly as low"),
        ({"energy": 64.0, "elsewhere": -0.2501}, "nearly as low"),
        ({"slope": -1e-9}, "grows upward"),
        ({"score": 0.3749}, "little of what lies ahead"),
        ({"score": 0.2499, "horizon": 0.49}, "little of what lies ahead"),
        ({"rival": 0.2813}, "another plane"),
        ({"moved": 0.1251}, "moved the roll by 7.2 degrees"),
        ({"theta": 0.5001}, "at its bound"),
        ({"theta": -0.5001}, "at its bound"),
        ({"noise": 0.2501}, "leave the angle open"),
        ({"half_width": 1.0001}, "the interval is wide"),
    ],
)
def test_what_is_just_beyond_a_bound_is_doubted_for_that_alone(beyond, says):
    (doubt,) = doubts_about(**just_within_every_bound() | beyond)
    assert says in doubt


@pytest.mark.parametrize(("sign", "grows_upward"), [(1, False), (-1, True)])
def test_which_way_is_down_is_told_along_the_rolled_road(sign, grows_upward):
    roll = 1.2
    plane = (9.0, -sign * 0.2 * math.sin(roll), sign * 0.2 * math.cos(roll))
    certified = CertifiedSolution(Solution(roll, 1), 64.0, [Minimum(roll, 64.0)], is_global=True)
    evidence = Evidence(SimpleNamespace(plane=plane), certified, None, None, 1.5, 1.0, None)
    assert (
        doubts_of(evidence, BOUNDS)
        == ["the disparity grows upward, as it does in a depth map"] * grows_upward
    )
