"""Sums tile by tile."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.estimator.moments import map_moments
from rollcli.estimator.solvers.areas import tile_sums
from tests.estimator.synthetic_maps import bent_road, random_maps, repeatable


def gram_of(moments):
    """sum x x', x = (1, p, q, d), from moments about the plane 0."""
    s, t = moments.s, moments.t
    return np.array(
        [
            [s[0, 0], s[1, 0], s[0, 1], t[0, 0]],
            [s[1, 0], s[2, 0], s[1, 1], t[1, 0]],
            [s[0, 1], s[1, 1], s[0, 2], t[0, 1]],
            [t[0, 0], t[1, 0], t[0, 1], moments.rr],
        ]
    )


@repeatable
@given(random_maps(), st.integers(2, 20))
def test_tiles_add_to_the_moments_of_the_map(disparity, side):
    total = tile_sums(disparity, None, side).gram.sum(axis=(0, 1))
    expected = gram_of(map_moments(disparity, plane=(0.0, 0.0, 0.0)))
    np.testing.assert_allclose(total, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_weights_and_no_data_are_those_of_the_moments():
    disparity = bent_road(5, noise=0.2)
    disparity[::9, ::4] = np.nan
    disparity[5] = np.inf
    weights = np.random.default_rng(3).uniform(0, 1, disparity.shape)
    total = tile_sums(disparity, weights, 16).gram.sum(axis=(0, 1))
    np.testing.assert_allclose(
        total, gram_of(map_moments(disparity, weights, plane=(0.0, 0.0, 0.0))), rtol=1e-9
    )


@pytest.mark.parametrize(("size", "step"), [(1, 1), (4, 2), (3, 1)])
def test_an_area_is_the_sum_of_its_tiles(size, step):
    tiles = tile_sums(bent_road(5, noise=0.2), None, 10)  # 12 x 16 tiles
    areas = tiles.areas(size, step)
    assert areas.shape[:2] == ((12 - size) // step + 1, (16 - size) // step + 1)
    for i, j in ((0, 0), (2, 3), (areas.shape[0] - 1, areas.shape[1] - 1)):
        inside = tiles.gram[i * step : i * step + size, j * step : j * step + size]
        np.testing.assert_allclose(areas[i, j], inside.sum(axis=(0, 1)), rtol=1e-9)


def test_a_map_smaller_than_an_area_has_none():
    assert tile_sums(bent_road(5, width=20, height=20), None, 10).areas(4, 2).size == 0
