"""The profile across a road tells a verge from a kerb."""

import numpy as np
import pytest

from rollcli.estimator.profile import falls_away

SLOPE = 200.0  # px of disparity per unit of y


def ground(height_at):
    """Pixels of a level road of half-width 1 camera height, and of what `height_at` says beside it."""
    rng = np.random.default_rng(6)
    x, y = rng.uniform(-1, 1, 20000), rng.uniform(0.05, 0.4, 20000)
    road = SLOPE * y
    side = x * SLOPE / road
    d = road * (1 + np.where(np.abs(side) < 1, 0, height_at(np.abs(side) - 1))) + rng.normal(0, 0.1, x.shape)
    near = np.abs(d / road - 1) < 0.08
    return falls_away(x[near], y[near], d[near], np.ones(near.sum(), bool), 0.0, (0.0, SLOPE, 0.0))


@pytest.mark.parametrize("slope", [-0.1, -0.05, 0.05, 0.1])
def test_ground_that_slopes_from_the_edge_is_a_verge(slope):
    assert ground(lambda beyond: slope * beyond)


@pytest.mark.parametrize("height", [0.015, 0.03, -0.03])
def test_a_kerb_and_level_ground_behind_it_is_none(height):
    assert not ground(lambda beyond: height + 0 * beyond)


def test_a_kerb_and_a_slight_slope_behind_it_is_none():
    assert not ground(lambda beyond: 0.025 + 0.02 * beyond)


def test_a_road_as_wide_as_the_picture_has_none():
    assert not ground(lambda beyond: 0 * beyond)
