"""The correlation of frames."""

import numpy as np
import pytest

from rollcli.rig.drive import noise
from rollcli.rig.drive.noise import fit_noise
from tests.rig.drive.series import ar1


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
    assert (found.phi, found.share) == (0, 0)


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
    variance = np.mean(np.square(series)) if series else 0.0
    assert fit_noise(np.array(series)) == noise.Noise(variance, 0.0, 0.0, 1.0)


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


def test_a_correlation_is_seen_by_its_decay_and_not_by_its_share():
    decays, shares = np.array([0.05, 0.2, 1.0]), np.array([0.0, 0.3, 0.9])
    deviance = np.full((3, 3), 50.0)
    deviance[1, 2] = deviance[0, 1] = 0.0
    longest = noise._longest(deviance, decays, shares, np.unravel_index(5, (3, 3)))
    assert longest == pytest.approx(1 + 8.0)  # a slower one has a smaller share


@pytest.mark.parametrize("frames", [4, 5, 40, 41, 3000, 3001])
def test_the_periodogram_has_every_frequency_once_and_the_slow_ones_by_themselves(frames):
    series = np.random.default_rng(3).normal(0, 1, frames)
    power, omega, counts = noise._periodogram(series)
    every = np.arange(1, (frames + 1) // 2)
    raw = [np.abs(np.sum(series * np.exp(-2j * np.pi * k * np.arange(frames) / frames))) ** 2 for k in every]
    ends = np.cumsum(counts).astype(int)
    assert ends[-1] == len(every)
    for start, end, mean, middle in zip(ends - counts.astype(int), ends, power, omega, strict=True):
        assert mean == pytest.approx(np.mean(raw[start:end]) / frames)
        assert middle == pytest.approx(2 * np.pi * every[start:end].mean() / frames)
    assert (counts[: min(len(every), 24)] == 1).all()
    assert len(counts) <= 24 + 90


def test_the_deviance_is_whittles_likelihood_at_its_best_scale():
    rng = np.random.default_rng(4)
    power, omega, counts = (
        rng.exponential(1, 12),
        np.linspace(0.1, 3, 12),
        rng.integers(1, 9, 12).astype(float),
    )
    decays, shares = np.array([0.02, 0.3, 1.0]), np.array([0.0, 0.4, 1.0])
    deviance, scale = noise._deviance(power, omega, counts, decays, shares)
    for row, decay in enumerate(decays):
        for column, share in enumerate(shares):
            # the spectrum of AR(1) as the sum of its correlations, which fade within 2,000 frames
            lags = np.arange(1, 2000)
            slow = 1 + 2 * np.cos(np.outer(omega, lags)) @ (1 - decay) ** lags
            shape = share * slow + 1 - share

            def whittle(factor, shape=shape):
                return 2 * np.sum(counts * (np.log(factor * shape) + power / (factor * shape)))

            best = scale[row, column]
            assert whittle(best) < min(whittle(0.99 * best), whittle(1.01 * best))
            assert deviance[row, column] == pytest.approx(whittle(best) - 2 * counts.sum())


def test_few_frames_have_a_correlation_time_of_half_of_them_at_most():
    for frames in (12, 40):
        limited = 0
        for seed in range(20):
            found = fit_noise(ar1(np.random.default_rng(seed), frames, 0.99, 1.0))
            fitted = 1 + 2 * found.phi / (1 - found.phi)
            assert 1 <= found.correlation_time <= max(fitted, frames / 2)
            limited += found.correlation_time == frames / 2
        assert limited > 0 or frames == 12


@pytest.mark.parametrize("phi", [0.9, 0.97])
def test_many_frames_have_the_correlation_time_of_ar1_at_the_upper_end_of_its_error(phi):
    found = fit_noise(ar1(np.random.default_rng(2), 40_000, phi, 1.0))
    fitted = 1 + 2 * found.phi / (1 - found.phi)
    assert fitted <= found.correlation_time <= 1.3 * fitted


@pytest.mark.parametrize("frames", [32, 300])
def test_frames_that_are_hardly_correlated_are_taken_for_two_at_most(frames):
    series = np.random.default_rng(0).normal(0, 1, (100, frames))
    times = np.array([fit_noise(each).correlation_time for each in series])
    # eight in deviance are brought by chance in a few of a hundred
    assert np.mean(times <= 2) > 0.9
    assert times.min() == 1
    # a slow part that cannot be ruled out is allowed for, the more the fewer frames there are
    assert np.any(times == 2) == (frames == 32)
    assert 0.1 < np.mean(times > 1) < 0.9


def test_a_slow_share_of_less_than_a_third_counts_in_part():
    assert noise._forgotten(0.1, 1.0) == noise._forgotten(0.1, 0.5) == pytest.approx(19)
    assert noise._forgotten(0.1, 1 / 6) == pytest.approx(10)
    assert noise._forgotten(1.0, 1.0) == noise._forgotten(0.1, 0.0) == 1
