"""The correlation of frames."""

import numpy as np
import pytest

from rollcli.rig.sequence import noise
from rollcli.rig.sequence.noise import fit_noise
from tests.rig.sequence.series import ar1


@pytest.mark.parametrize(("phi", "white"), [(0.9, 0.0), (0.94, 0.5), (0.97, 0.2)])
def test_the_correlation_of_ar1_with_white_noise_is_found(phi, white):
    rng = np.random.default_rng(1)
    series = ar1(rng, 40_000, phi, 1.0) + rng.normal(0, white, 40_000)
    found = fit_noise(series)
    assert 1 - found.phi == pytest.approx(1 - phi, rel=0.15)
    assert found.share == pytest.approx(1 / (1 + white**2), abs=0.05)
    assert found.variance == pytest.approx(1 + white**2, rel=0.1)


def test_frames_without_an_order_have_no_correlation():
    found = fit_noise(np.random.default_rng(0).normal(0, 1, 5000))
    assert found.correlation_time < 1.2


@pytest.mark.parametrize(("phi", "white"), [(0.9, 0.0), (0.97, 1.0)])
@pytest.mark.parametrize("frames", [1, 7, 50, 400])
def test_the_variance_of_a_mean_is_the_sum_of_all_covariances(phi, white, frames):
    found = fit_noise(ar1(np.random.default_rng(2), 5000, phi, 1.0))
    lags = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
    slow = found.variance * found.share * found.phi ** lags.astype(float)
    total = slow.sum() + frames * found.variance * (1 - found.share)
    assert found.variance_of_mean(frames) == pytest.approx(total / frames**2, rel=1e-6)


@pytest.mark.parametrize("series", [[], [1.0], [0.0] * 100, [1.0, -1.0, 0.5]])
def test_what_tells_nothing_has_no_correlation(series):
    assert fit_noise(np.array(series)).correlation_time == 1.0


def test_the_longest_correlation_that_fits_is_that_of_the_best_where_no_other_fits():
    decays, shares = np.array([0.05, 0.2, 0.6]), np.array([0.0, 0.3, 0.9])
    deviance = np.full((3, 3), 50.0)
    deviance[1, 1] = 0.0
    best = noise._longest(deviance, decays, shares, np.unravel_index(4, (3, 3)))
    assert best == pytest.approx(1 + 8.0 * min(1.0, 0.3 * noise._SLOW_MATTERS))
    deviance[0, 1] = 0.9  # slower, and within one standard error
    deviance[0, 0] = 0.9  # fits as well, but its slow share is smaller
    longer = noise._longest(deviance, decays, shares, np.unravel_index(4, (3, 3)))
    assert longer == pytest.approx(1 + 38.0 * min(1.0, 0.3 * noise._SLOW_MATTERS))
