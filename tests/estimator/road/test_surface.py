"""The road's pixels: between its edges, as long as there are any."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rollcli.estimator.road.edges import NO_EDGES
from rollcli.estimator.road.find import find_road
from rollcli.estimator.road.subsample import take_sample
from rollcli.estimator.road.surface import fit_surface
from rollcli.estimator.road.tuning import ROAD_TUNING
from tests.estimator.synthetic_maps import flat_road

WIDTH, HEIGHT, FOCAL = 640, 480, 560.0
ROLL = math.radians(-3)


def road_and_sides():
    """A road of -3 degrees with noise, px, and how far to the right each pixel lies, in camera heights."""
    road = flat_road(-3, width=WIDTH, height=HEIGHT, focal=FOCAL, pitch_deg=0)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    x, y = u - (WIDTH - 1) / 2, v - (HEIGHT - 1) / 2
    below = y * math.cos(ROLL) - x * math.sin(ROLL)  # the horizon; a road's pixel is one height under it
    side = (x * math.cos(ROLL) + y * math.sin(ROLL)) / np.maximum(below, 1e-9)
    noise = np.random.default_rng(0).normal(0, 0.1, road.shape)
    return np.where(road > 1, road + noise, 0), side


def surface_of(disparity, tuning=ROAD_TUNING):
    sample = take_sample(disparity, None, tuning)
    return fit_surface(sample, find_road(sample, math.radians(45), 0), parabolic=True)


@pytest.mark.parametrize("slope", [-0.15, 0.15])
def test_a_verge_beyond_the_edge_of_the_road_is_no_road(slope):
    road, side = road_and_sides()
    verge = np.maximum(0, side - 1.4)

    found = surface_of(road * (1 + slope * verge))

    assert found.edges.left == math.inf
    assert found.edges.right == pytest.approx(1.4, abs=0.3)
    assert math.degrees(found.model.theta) == pytest.approx(-3, abs=0.05)
    covered = found.covers(road * (1 + slope * verge))
    assert not covered[side > 1.7].any()
    assert covered[(np.abs(side) < 1) & (road > 0)].mean() > 0.95


def test_a_road_without_edges_is_road_up_to_the_sides_of_the_map():
    road, side = road_and_sides()

    found = surface_of(road)

    assert found.edges == NO_EDGES
    assert found.covers(road)[(side > 1.7) & (road > 5)].mean() > 0.9


def test_edges_with_hardly_a_pixel_between_them_are_none():
    road, side = road_and_sides()
    disparity = road * (1 + 0.15 * np.maximum(0, side - 1.4))
    crossed = replace(ROAD_TUNING, edges=replace(ROAD_TUNING.edges, margin=400))  # the left edge right of all

    found = surface_of(disparity, crossed)

    assert found.edges == NO_EDGES
    assert found.share > surface_of(disparity).share


def test_a_surface_that_crosses_the_road_without_rising_as_it_does_is_no_road():
    road, side = road_and_sides()
    crossing = np.abs(side + 1.8) < 0.5
    disparity = np.where(crossing & (road > 0), 15, road)

    covered = surface_of(disparity).covers(disparity)

    near = crossing & (np.abs(road - 15) < 0.6)
    assert near.sum() > 100
    assert covered[near].mean() < 0.1
