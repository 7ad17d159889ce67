"""What frames count, against the meta-analysis of statsmodels."""

import numpy as np
import pytest
from scipy.stats import norm
from statsmodels.stats.meta_analysis import combine_effects

from rollcli.rig.drive.noise import between_variance, frame_weights, gross_outliers
from rollcli.rig.drive.tuning import TUNING
from tests.rig.drive.series import drive


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("spread", [0.1, 0.5])
def test_variance_between_frames_is_that_of_paule_and_mandel(seed, spread):
    rng = np.random.default_rng(seed)
    errors = rng.uniform(0.02, 0.3, 200)
    values = rng.normal(0, spread, 200) + rng.normal(0, 1, 200) * errors
    oracle = combine_effects(values, errors**2, method_re="iterated", atol=1e-12, maxiter=500)
    assert between_variance(values, errors**2) == pytest.approx(oracle.tau2, rel=1e-4)


def test_frames_that_their_own_errors_explain_have_no_variance_between_them():
    errors = np.random.default_rng(0).uniform(0.02, 0.3, 200)
    values = 0.8 * errors * np.resize([1, -1], 200)
    assert between_variance(values, errors**2) == 0


def test_variance_between_frames_is_near_that_of_dersimonian_and_laird():
    values, errors = drive(1, 4000)
    oracle = combine_effects(values, errors**2, method_re="dl")
    assert between_variance(values, errors**2) == pytest.approx(oracle.tau2, rel=0.1)


def test_frames_without_outliers_have_the_weights_of_a_random_effects_model():
    rng = np.random.default_rng(3)
    errors = rng.uniform(0.02, 0.3, 500)
    residuals = np.clip(rng.normal(0, 1, 500), -2, 2) * np.hypot(0.2, errors)
    weights, tau2 = frame_weights(residuals, errors**2)
    oracle = combine_effects(residuals, errors**2, method_re="iterated", atol=1e-10)
    assert tau2 == pytest.approx(oracle.tau2, rel=0.02)
    assert weights / weights.sum() == pytest.approx(oracle.weights_rel_re, rel=0.05)


def test_a_frame_far_off_counts_less():
    residuals = np.append(np.random.default_rng(0).normal(0, 0.1, 200), 3.0)
    weights, _ = frame_weights(residuals, np.full(201, 0.05**2))
    assert weights[-1] < 0.1 * np.median(weights)


@pytest.mark.parametrize(("phi", "sd"), [(0.9, 0.4), (0.97, 0.1), (0.94, 0.3)])
def test_gross_outliers_are_found_and_good_frames_are_not_called_so(phi, sd):
    values, errors = drive(5, 3000, phi=phi, sd=sd)
    assert gross_outliers(values, errors**2).sum() <= 3
    rng = np.random.default_rng(6)
    bad = rng.random(3000) < 0.05
    values[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(5, 30, bad.sum())
    found = gross_outliers(values, errors**2)
    assert found[bad].all()
    assert found[~bad].mean() < 0.01


def test_a_jump_is_no_gross_outlier():
    values = np.repeat([0.0, 5.0], 100) + np.random.default_rng(0).normal(0, 0.1, 200)
    assert not gross_outliers(values, np.full(200, 0.01)).any()


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 1.0, 1.0], [0.0] * 50])
def test_few_or_equal_values_have_no_outliers(values):
    assert not gross_outliers(np.array(values), np.full(len(values), 0.01)).any()


def test_the_variance_between_frames_is_cut_at_hubers_bound_of_the_median():
    """Twice the mean square of a normal variable that is cut at the bound, first that of its median."""
    residuals = np.random.default_rng(11).normal(0, 0.2, 40_000)
    expected = 1.0
    for _ in range(2):
        bound = TUNING.huber * np.sqrt(expected)
        expected = norm.expect(lambda x, cut=bound: min(x * x, cut * cut), lb=-12, ub=12)

    _, tau2 = frame_weights(residuals, np.full(40_000, 1e-12))

    assert tau2 == pytest.approx(0.2**2 * expected, rel=0.03)
