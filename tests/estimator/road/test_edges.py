"""The profile across a road tells where a verge ends it, and a verge from a kerb."""

import numpy as np
import pytest

from rollcli.estimator.road.edges import NO_EDGES, find_edges
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.tuning import EdgeTuning

SLOPE = 200.0  # px of disparity per unit of y
ROAD = RoadModel(0.0, (0.0, SLOPE, 0.0))


def edges(height_at, half_width=1.0, nearest=0.08):
    """Of a level road, with ground beside it whose height `height_at` says, all in camera heights."""
    rng = np.random.default_rng(6)
    x, y = rng.uniform(-1, 1, 20000), rng.uniform(0.05, 0.4, 20000)
    road = SLOPE * y
    side = x * SLOPE / road
    beyond = np.abs(side) - half_width
    d = road * (1 + np.where(beyond < 0, 0, height_at(beyond))) + rng.normal(0, 0.1, x.shape)
    near = np.abs(d / road - 1) < nearest
    return find_edges(x[near], y[near], d[near], np.ones(near.sum(), bool), ROAD, EdgeTuning())


@pytest.mark.parametrize("slope", [-0.2, -0.1, -0.05, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("half_width", [1.0, 1.3])
def test_the_road_ends_where_the_ground_begins_to_slope(slope, half_width):
    found = edges(lambda beyond: slope * beyond, half_width)

    assert found.left == pytest.approx(half_width, abs=0.3)
    assert found.right == pytest.approx(half_width, abs=0.3)


def test_each_side_has_an_edge_of_its_own():
    rng = np.random.default_rng(7)
    x, y = rng.uniform(-1, 1, 20000), rng.uniform(0.05, 0.4, 20000)
    road = SLOPE * y
    side = x * SLOPE / road
    d = road * (1 + np.maximum(0, 0.08 * (side - 1.2)))
    near = np.abs(d / road - 1) < 0.08

    found = find_edges(x[near], y[near], d[near], np.ones(near.sum(), bool), ROAD, EdgeTuning())

    assert found.left == np.inf
    assert found.right == pytest.approx(1.2, abs=0.3)


@pytest.mark.parametrize("height", [0.015, 0.03, -0.03])
def test_a_low_kerb_and_level_ground_behind_it_is_no_edge(height):
    assert edges(lambda beyond: height + 0 * beyond) == NO_EDGES


@pytest.mark.parametrize("height", [0.055, -0.055])
def test_a_kerb_is_an_edge(height):
    found = edges(lambda beyond: height + 0 * beyond, half_width=1.2)

    assert found.left == pytest.approx(1.2, abs=0.3)
    assert found.right == pytest.approx(1.2, abs=0.3)


def test_a_low_kerb_and_a_slight_slope_behind_it_is_no_edge():
    assert edges(lambda beyond: 0.025 + 0.02 * beyond) == NO_EDGES


def test_ground_that_is_lost_within_a_bin_is_an_edge():
    found = edges(lambda beyond: 0.04 + 0.3 * beyond, half_width=1.2)

    assert found.left == pytest.approx(1.2, abs=0.3)
    assert found.right == pytest.approx(1.2, abs=0.3)


def test_a_road_that_is_lost_from_view_has_no_edge():
    rng = np.random.default_rng(8)
    x, y = rng.uniform(-0.15, 0.15, 20000), rng.uniform(0.05, 0.4, 20000)
    d = SLOPE * y + rng.normal(0, 0.1, x.shape)

    assert find_edges(x, y, d, np.ones(len(x), bool), ROAD, EdgeTuning()) == NO_EDGES


def test_a_kerb_and_a_steep_verge_behind_it_is_an_edge():
    found = edges(lambda beyond: -0.025 - 0.1 * beyond, half_width=1.25, nearest=0.06)

    assert found.left == pytest.approx(1.25, abs=0.3)
    assert found.right == pytest.approx(1.25, abs=0.3)


def test_no_pixel_has_no_edge():
    none = np.empty(0)

    assert find_edges(none, none, none, none > 0, ROAD, EdgeTuning()) == NO_EDGES


def test_a_road_as_wide_as_the_picture_has_no_edge():
    assert edges(lambda beyond: 0 * beyond) == NO_EDGES


def test_a_strip_that_is_narrower_than_a_lane_is_no_road_of_its_own():
    assert edges(lambda beyond: 0.08 * beyond, half_width=0.4) == NO_EDGES


@pytest.mark.parametrize("sign", [-1, 1])
def test_camber_is_no_verge(sign):
    assert edges(lambda aside: sign * (0.028 * aside - 0.01), half_width=0) == NO_EDGES


@pytest.mark.parametrize("slope", [-0.08, 0.08])
def test_a_lane_may_be_narrow_for_a_tall_rig(slope):
    found = edges(lambda beyond: slope * beyond, half_width=0.75)

    assert found.left == pytest.approx(0.75, abs=0.3)
    assert found.right == pytest.approx(0.75, abs=0.3)
