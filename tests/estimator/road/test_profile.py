"""The profile across a road: where the ground beside the lane stops to count."""

import math

import numpy as np
import pytest

from rollcli.estimator.road.surface import Profile, read_profile
from rollcli.estimator.tuning import ProfileTuning

SIDES = np.array([0.125, 0.375, 0.625, 0.875, 1.125, 1.375, 1.625, 1.875, 2.125, 2.375])  # middles of bins


def weights(height_at, spread=0.002):
    """The weights at `SIDES` to the right of ground whose height at a side `height_at` says."""
    rng = np.random.default_rng(6)
    side = rng.uniform(-2.5, 2.5, 20000)
    height = np.where(side > 0, height_at(side), 0) + rng.normal(0, spread, side.shape)
    return read_profile(side, height, ProfileTuning()).at(SIDES)


def beyond(start, height_at):
    """Level ground up to `start` camera heights to the side, then as `height_at` says."""
    return lambda side: np.where(side < start, 0, height_at(side - start))


def test_level_ground_counts_until_it_is_far_to_the_side():
    found = weights(lambda side: 0 * side)

    assert found[:4].min() > 0.9
    assert found[-1] < 0.01
    assert np.all(np.diff(found) <= 0)


@pytest.mark.parametrize("height", [0.04, 0.055, 0.1, -0.055])
def test_ground_behind_a_kerb_does_not_count(height):
    found = weights(beyond(1.25, lambda _: height))

    assert found[:4].min() > 0.9
    assert found[5:].max() < 0.05


@pytest.mark.parametrize("slope", [-0.2, -0.08, -0.04, 0.04, 0.08, 0.2])
def test_a_verge_fades_out_from_its_edge(slope):
    found = weights(beyond(1.0, lambda beside: slope * beside))

    assert found[:4].min() > 0.9
    assert np.all(np.diff(found[4:]) <= 0)
    assert found[-1] < 0.05


def test_ground_that_is_not_seen_goes_on_at_the_height_that_was_seen_last():
    rng = np.random.default_rng(8)
    side = rng.uniform(-2.5, 2.5, 20000)
    side = side[(np.abs(side) < 1) | (np.abs(side) > 1.75)]
    height = np.where(side < -0.75, 0.05, 0.0)
    found = read_profile(side, height, ProfileTuning())

    assert found.level(np.array([-1.125, -1.375, -1.625])).max() < 0.05
    assert found.level(np.array([1.125, 1.375, 1.625])).min() > 0.95


def test_each_side_is_read_by_itself():
    rng = np.random.default_rng(7)
    side = rng.uniform(-2.5, 2.5, 20000)
    profile = read_profile(side, np.where(side > 1.25, 0.1, 0.0), ProfileTuning())

    assert profile.at(SIDES)[5] < 0.01
    assert profile.level(-SIDES)[5] > 0.95


def test_the_middle_of_the_lane_counts_whatever_its_height():
    assert weights(lambda side: np.where(side < 0.5, 0.03, 0))[:2].min() > 0.95


def test_a_kerb_that_grows_takes_the_weight_away_little_by_little():
    behind = [
        weights(beyond(0.75, lambda _, height=height: height))[3] for height in np.linspace(0, 0.05, 51)
    ]

    assert behind[0] > 0.9
    assert behind[-1] < 0.02
    assert np.abs(np.diff(behind)).max() < 0.15  # a millimetre and a half of a car's camera height at a time


def test_no_pixel_leaves_the_lane_to_itself():
    none = np.empty(0)
    found = read_profile(none, none, ProfileTuning()).at(SIDES)

    assert found[0] == pytest.approx(1)
    assert math.isfinite(found.sum())
    assert len(read_profile(none, none, ProfileTuning()).weights) == 20


def test_the_left_is_the_mirror_image_of_the_right():
    rng = np.random.default_rng(9)
    side = rng.uniform(-2.5, 2.5, 20000)
    height = 0.03 * np.maximum(0, side - 0.6) - 0.02 * np.maximum(0, -side - 1.1)
    one, other = (read_profile(sign * side, height, ProfileTuning()) for sign in (1, -1))
    np.testing.assert_allclose(one.weights, other.weights[::-1])
    np.testing.assert_allclose(one.at(SIDES), other.at(-SIDES))
    assert len(set(one.weights.round(3))) > 8


def test_between_the_middles_of_bins_the_level_is_interpolated_and_beyond_the_last_it_stays():
    profile = Profile(np.linspace(0, 0.95, 20), ProfileTuning())
    sides = np.linspace(-2.375, 2.375, 96)
    np.testing.assert_allclose(profile.level(sides), np.linspace(0, 0.95, 96), atol=1e-12)
    np.testing.assert_allclose(profile.level(np.array([-9.0, 9.0, -np.inf, np.inf])), [0, 0.95, 0, 0.95])


def test_a_bin_with_too_few_pixels_has_no_height():
    tuning = ProfileTuning()
    middle = np.full(50, 0.125)
    for pixels, level in ((tuning.bin_pixels - 1, 1), (tuning.bin_pixels, 0.5)):
        side = np.concatenate([middle, np.full(pixels, 1.125)])
        found = read_profile(side, np.where(side > 1, tuning.off_level, 0), tuning)
        assert found.level(np.array([1.125])) == pytest.approx(level)
        assert len(found.weights) == 20
