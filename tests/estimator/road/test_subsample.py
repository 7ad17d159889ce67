"""What a sample says of its map does not change with what is wrong in the map."""

import dataclasses
import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.road.sample import NO_SLOPE, reach_of, rising, take_sample
from rollcli.estimator.tuning import ROAD_TUNING
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
    np.testing.assert_array_equal(hundred.coarse.coherence, one.coarse.coherence)


def test_pixels_without_neighbours_are_a_sample_too(street):
    alone = np.zeros_like(street)
    alone[5::20, 5::20] = street[5::20, 5::20]

    sample = take_sample(alone)

    assert not sample.coarse.coherence.any()
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
    left, right, up, down = sample.coarse.slopes

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


def test_a_finer_grid_ends_the_search_where_it_aims_at_fewer_pixels_than_are_enough():
    tuning = dataclasses.replace(ROAD_TUNING.sample, sparse_share=0.95, finer_share=0.3)
    half = np.where(np.arange(640) < 320, 50.0, 0).astype(np.float32).repeat(480).reshape(640, 480)

    sample = take_sample(half, tuning=dataclasses.replace(ROAD_TUNING, sample=tuning))

    assert 0.3 * tuning.pixels < len(sample.d) < tuning.pixels


def pixels_alone(count):
    """A map of which so many pixels are valid."""
    disparity = np.zeros((40, 40))
    disparity[10:30, 10:30].flat[:count] = 20.0
    return disparity


def test_as_many_pixels_as_are_needed_are_enough_and_one_less_is_not():
    least = ROAD_TUNING.sample.least_pixels
    assert len(take_sample(pixels_alone(least)).d) == least
    with pytest.raises(EstimationError, match=f"only {least - 1} valid pixels"):
        take_sample(pixels_alone(least - 1))


def test_a_pixel_half_of_whose_neighbours_agree_is_no_noise():
    v, u = np.mgrid[:480, :640]
    stripes = 50.0 + 10 * (u // 3 % 2)  # neighbours are 3 px away: those above and below are alike
    noise = np.random.default_rng(1).uniform(1, 20, u.shape)
    sample = take_sample(np.where(v < 180, stripes, noise))
    assert sample.typical >= 50


@pytest.mark.parametrize("apart", [4, 5, 6, 12])
@pytest.mark.parametrize("first", [4, 5])
def test_a_grid_of_valid_pixels_is_found_between_the_rows_and_columns_of_the_sample(street, apart, first):
    alone = np.zeros_like(street)
    alone[first::apart, first::apart] = street[first::apart, first::apart]
    sample = take_sample(alone)
    assert len(sample.d) >= min(5400, np.count_nonzero(alone > 0)) * 0.95
    assert sample.typical == pytest.approx(take_sample(street).typical, rel=0.1)


@pytest.mark.parametrize("size", [(480, 640), (375, 1242), (1080, 1920), (90, 100)])
def test_places_are_where_the_sampled_disparities_are(size):
    disparity = np.random.default_rng(2).uniform(10, 20, size).astype(np.float32)
    sample = take_sample(disparity)
    places = sample.places
    np.testing.assert_array_equal(disparity.ravel()[places], sample.d)
    v, u = np.divmod(places, size[1])
    np.testing.assert_allclose(sample.x, (u - (size[1] - 1) / 2) / (size[1] / 2), atol=1e-6)
    np.testing.assert_allclose(sample.y, (v - (size[0] - 1) / 2) / (size[1] / 2), atol=1e-6)
    assert sample.pitch == pytest.approx(sample.spacing.columns / (size[1] / 2))
    assert sample.spacing.rows % 3 != 0
    for each, apart in ((u, sample.spacing.columns), (v, sample.spacing.rows)):
        assert set(np.diff(np.unique(each))) == {apart}
    assert min(u.min(), v.min(), size[1] - 1 - u.max(), size[0] - 1 - v.max()) >= sample.reach


@pytest.mark.parametrize(
    ("size", "reach"),
    [((480, 640), 3), ((600, 1240), 4), ((2000, 3100), 10), ((5000, 9000), 16), ((16, 700), 2), ((7, 9), 1)],
)
def test_neighbours_are_as_far_away_as_the_size_of_the_map_allows(size, reach):
    assert reach_of(*size, ROAD_TUNING.sample) == reach


def test_the_coarse_sample_is_every_so_many_of_the_pixels(street):
    sample = take_sample(street)
    coarse, step = sample.coarse, round(len(sample.d) / ROAD_TUNING.sample.coarse_pixels)
    assert step > 1
    for name in ("x", "y", "d", "tolerance"):
        np.testing.assert_array_equal(getattr(coarse, name), getattr(sample, name)[::step])
    assert coarse.slopes.shape == (4, len(coarse.d))
    np.testing.assert_allclose(coarse.column * sample.pitch, coarse.x - coarse.x.min(), atol=1e-5)


def test_the_slopes_of_holes_agree_with_no_road(street):
    holes = np.where(np.random.default_rng(0).random(street.shape) < 0.5, 0, street)
    slopes = take_sample(holes).coarse.slopes
    assert 0.4 < np.mean(np.abs(slopes) == NO_SLOPE) < 0.6
