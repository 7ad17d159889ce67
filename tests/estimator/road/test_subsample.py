"""What a sample says of its map does not change with what is wrong in the map."""

import math

import numpy as np
import pytest

from rollcli.estimator.road.subsample import take_sample
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
