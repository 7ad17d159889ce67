"""What a sample says of its map does not change with what is wrong in the map."""

import math

import numpy as np
import pytest

from rollcli.estimator.road.subsample import NO_SLOPE, rising, take_sample
from rollcli.estimator.road.tuning import ROAD_TUNING
from rollcli.simulate.render import true_disparity
from rollcli.simulate.spec import FrameSpec


@pytest.fixture(scope="module")
def street():
    return true_disparity(FrameSpec(size=(640, 480), seed=5, roll=math.radians(4)))[0]


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_noise_does_not_change_what_is_typical(street, share):
    rng = np.random.default_rng(1)
    noise = rng.random(street.shape) < share
    noisy = np.where(noise, rng.uniform(0, 4 * np.nanmax(street), street.shape), street)

    clean, degraded = take_sample(street), take_sample(noisy)

    assert degraded.typical == pytest.approx(clean.typical, rel=0.1)
    assert degraded.noise == pytest.approx(clean.noise, rel=0.1)


def test_whole_pixels_are_off_by_their_rounding(street):
    sample = take_sample(np.round(street / 4))

    assert sample.noise == pytest.approx(math.sqrt(1 / 12), rel=0.05)


def test_a_factor_changes_the_unit_alone(street):
    one, hundred = take_sample(street), take_sample(100 * street)

    np.testing.assert_allclose(hundred.tolerance, 100 * one.tolerance, rtol=1e-5)
    np.testing.assert_array_equal(hundred.coherence, one.coherence)


def test_pixels_without_neighbours_are_a_sample_too(street):
    alone = np.zeros_like(street)
    alone[5::20, 5::20] = street[5::20, 5::20]

    sample = take_sample(alone)

    assert not sample.coherence.any()
    assert sample.typical == pytest.approx(take_sample(street).typical, rel=0.1)


@pytest.mark.parametrize(
    ("up", "down", "grows"),
    [
        (2, 2, True),
        (2, -2, True),
        (-2, 2, True),
        (-2, -2, False),
        (0, 0, False),
        (-2, NO_SLOPE, False),
        (NO_SLOPE, -2, False),
        (NO_SLOPE, 2, True),
        (2, NO_SLOPE, True),
        (NO_SLOPE, NO_SLOPE, False),
    ],
)
def test_the_map_rises_where_a_known_slope_above_or_below_does(up, down, grows):
    slopes = np.array([[-1], [1], [up], [down]], np.float32)

    assert rising(slopes) == [grows]


def test_slopes_are_those_of_the_map_per_unit_to_all_four_sides():
    v, u = np.mgrid[:480, :640]
    sample = take_sample((50 + 0.02 * u + 0.1 * v).astype(np.float32))
    left, right, up, down = sample.slopes

    for slope, expected in ((left, 0.02), (right, 0.02), (up, 0.1), (down, 0.1)):
        np.testing.assert_allclose(slope, expected * sample.grid.scale, rtol=1e-3)


@pytest.mark.parametrize("sides", [(1, 0), (0, 1)])
def test_whole_pixels_are_seen_across_and_down(sides):
    v, u = np.mgrid[:480, :640]
    sample = take_sample(np.round(2 + 0.01 * (sides[0] * u + sides[1] * v)).astype(np.float32))

    assert sample.noise == pytest.approx(math.sqrt(1 / 12), rel=0.05)


@pytest.mark.parametrize("size", [(240, 320), (480, 640)])
def test_a_sparse_map_is_sampled_more_finely(size):
    rng = np.random.default_rng(0)
    sparse = np.where(rng.random(size) < 0.1, 50.0, 0).astype(np.float32)
    whole = np.full(size, 50.0, np.float32)

    found = len(take_sample(sparse).d)
    assert found > 3 * 0.1 * len(take_sample(whole).d)
    assert found < 2 * ROAD_TUNING.sample.finer_share * ROAD_TUNING.sample.pixels  # not all there are
