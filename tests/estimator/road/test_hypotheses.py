"""Planes drawn through triples of neighbouring pixels."""

import dataclasses
import math

import numpy as np
import pytest

from rollcli.estimator.road.find import draw_planes
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.tuning import ROAD_TUNING
from tests.estimator.synthetic_maps import flat_road

MAX_ROLL = math.radians(45)
WIDTH, HEIGHT = 1200, 300
LEFT, RIGHT = 420, 780  # the columns of a gap


def two_roads():
    """Roads of 5 and of -8 degrees, beside each other; the gap between is wider than a triple."""
    size = {"width": WIDTH, "height": HEIGHT, "focal": 600.0}
    u = np.arange(WIDTH)
    roads = np.where(u < LEFT, flat_road(5, **size), flat_road(-8, **size))
    return np.where((u >= LEFT) & (u < RIGHT), 0, roads).astype(np.float32)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_triple_does_not_reach_across_a_gap_that_is_wider_than_its_radius(seed):
    assert ROAD_TUNING.hypotheses.radius < (RIGHT - LEFT) / (WIDTH / 2)

    planes = draw_planes(take_sample(two_roads()), MAX_ROLL, seed)
    rolls = np.degrees(np.arctan2(-planes[:, 1], planes[:, 2]))

    np.testing.assert_allclose(np.where(rolls > 0, rolls - 5, rolls + 8), 0, atol=0.1)
    assert {np.sign(roll) for roll in rolls} == {-1, 1}


def test_every_plane_passes_through_three_pixels():
    rng = np.random.default_rng(4)
    road = flat_road(5, width=640, height=480, focal=560.0)
    sample = take_sample(np.where(road > 0, np.maximum(road + rng.normal(0, 0.3, road.shape), 0.01), 0))
    c0, c1, c2 = draw_planes(sample, MAX_ROLL, 0)[:40].T.astype(np.float64)[:, :, None]
    off = np.abs(c0 + c1 * sample.x + c2 * sample.y - sample.d)

    assert (np.sort(off, axis=1)[:, 2] < 1e-4 * sample.d.max()).all()


def test_no_plane_is_rolled_beyond_the_bound():
    planes = draw_planes(take_sample(two_roads()), math.radians(6), 0)

    assert (np.abs(planes[:, 1]) <= math.tan(math.radians(6)) * planes[:, 2]).all()
    assert (planes[:, 1] < 0).all()  # those of 5 degrees alone


def test_a_surface_that_rises_upward_gives_no_plane():
    assert len(draw_planes(take_sample(two_roads()[::-1]), MAX_ROLL, 0)) == 0


def rising_by(tolerances, scale=1.0):
    """A surface that rises downward by so many tolerances of its middle within the radius of a triple."""
    numbers, radius = ROAD_TUNING.sample, ROAD_TUNING.hypotheses.radius
    tolerance = math.hypot(numbers.noise_share * 50, numbers.uneven_share * 50)
    v, u = np.mgrid[:480, :640]
    return scale * (50 + tolerances * tolerance / radius * (v - 239.5) / 320 + 0 * u)


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_what_hardly_rises_within_the_radius_is_no_road(scale):
    least = ROAD_TUNING.hypotheses.least_rise
    assert len(draw_planes(take_sample(rising_by(0.7 * least, scale)), MAX_ROLL, 0)) == 0
    assert len(draw_planes(take_sample(rising_by(1.3 * least, scale)), MAX_ROLL, 0)) > 50


def test_of_many_planes_the_first_are_kept():
    every = take_sample(rising_by(20))
    fewer = dataclasses.replace(
        every,
        tuning=dataclasses.replace(
            ROAD_TUNING, hypotheses=dataclasses.replace(ROAD_TUNING.hypotheses, kept=40)
        ),
    )
    np.testing.assert_array_equal(draw_planes(fewer, MAX_ROLL, 0), draw_planes(every, MAX_ROLL, 0)[:40])


def test_pixels_half_of_whose_neighbours_agree_are_coherent_enough():
    u = np.arange(640)
    striped = rising_by(8) * (1 + 0.3 * (u // 3 % 2))  # neighbours are 3 px away: those below are alike
    sample = take_sample(striped)
    assert (sample.coarse.coherence == 0.5).all()
    assert len(draw_planes(sample, MAX_ROLL, 0)) > 0


def test_two_pixels_are_no_plane():
    disparity = np.zeros((60, 80))
    disparity[::3, ::3] = np.random.default_rng(0).uniform(5, 90, (20, 27))
    sample = take_sample(disparity)
    assert draw_planes(sample, MAX_ROLL, 0).shape[1] == 3
