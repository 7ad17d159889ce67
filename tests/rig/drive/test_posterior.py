"""The posterior against statsmodels and scipy, its interval against simulated truth, and outliers."""

from statistics import NormalDist

import numpy as np
import pytest

from rollcli.rig.drive.posterior import TUNING, Fit, Likelihood, Series, make_cells
from rollcli.rig.drive.quantity import assess_sequence, gross_outliers
from tests.rig.drive.series import ar1, drive, swaying
from tests.slow import mostly_slow

FRAMES = 40
FACTORS = len(TUNING.error_factors)
KINKED = len(TUNING.correlations) + len(TUNING.slow) * len(TUNING.fast)  # after them smooth movements


@pytest.fixture(scope="module")
def cells():
    rng = np.random.default_rng(3)
    errors = rng.uniform(0.02, 0.1, FRAMES)
    values = 1.0 + ar1(rng, FRAMES, 0.8, 0.2) + rng.normal(0, 1, FRAMES) * errors
    used = rng.random(FRAMES) < 0.9
    return make_cells(Series(np.where(used, values, 0), errors**2, used))


def covariance_of(cells, place, noise):
    """The covariance of one noise of the grid, written out."""
    spreads = np.geomspace(*TUNING.spreads, TUNING.spread_steps)
    spread, factor = spreads[noise // FACTORS], TUNING.error_factors[noise % FACTORS]
    distance = np.abs(cells.centres[:, None] - cells.centres)
    if place < len(TUNING.correlations):
        correlation = TUNING.correlations[place] ** distance
    elif place >= KINKED:
        reach = TUNING.smooth_cells[place - KINKED]
        correlation = (1 + distance / reach) * np.exp(-distance / reach)
    else:
        slow, fast = divmod(place - len(TUNING.correlations), len(TUNING.fast))
        left, period = TUNING.fast[fast]
        swings = left**distance * np.cos(2 * np.pi * distance / period)
        share = TUNING.slow_share
        correlation = share * TUNING.slow[slow] ** distance + (1 - share) * swings
    return spread**2 * correlation + factor * np.diag(cells.variances)


@pytest.mark.slow
@pytest.mark.parametrize(("place", "noise"), [(0, 2), (4, 30), (12, 69), (8, 41), (16, 50), (26, 41)])
def test_each_noise_has_the_fit_of_statsmodels_and_the_likelihood_of_scipy(cells, place, noise):
    import statsmodels.api as sm
    from scipy.stats import multivariate_normal

    design = np.column_stack([np.ones(len(cells.first)), cells.centres / FRAMES])
    fit = Likelihood(cells).fit(design)
    covariance = covariance_of(cells, place, noise)
    oracle = sm.GLS(cells.values, design, covariance).fit()
    assert fit.beta[place, noise] == pytest.approx(oracle.params, rel=1e-6)
    assert fit.covariance[place, noise] == pytest.approx(oracle.normalized_cov_params, rel=1e-6)
    left = multivariate_normal(oracle.fittedvalues, covariance).logpdf(cells.values)
    level = np.linalg.slogdet(np.linalg.inv(oracle.normalized_cov_params))[1]
    spread = np.geomspace(*TUNING.spreads, TUNING.spread_steps)[noise // FACTORS]
    alone = len(TUNING.correlations)
    others = (1 - TUNING.two) * (1 - TUNING.independent) / (alone - 1)
    probable = {0: (1 - TUNING.two) * TUNING.independent, **dict.fromkeys(range(1, alone), others)}
    prior = np.log(TUNING.error_priors[noise % FACTORS]) + TUNING.spread_power * np.log(spread)
    two = TUNING.two / (KINKED - alone)
    smooth = TUNING.smooth / len(TUNING.smooth_cells)
    prior += np.log(smooth if place >= KINKED else (1 - TUNING.smooth) * probable.get(place, two))
    expected = left - level / 2 + prior
    constant = len(cells.values) / 2 * np.log(2 * np.pi) + np.log(cells.variances).sum() / 2
    assert fit.log_evidence[place, noise] == pytest.approx(expected + constant, rel=1e-6)


@pytest.mark.parametrize("unit", [1.0, 0.02])
def test_a_step_has_the_evidence_of_the_fit_with_it(cells, unit):
    likelihood, places = Likelihood(cells, unit), np.arange(len(cells.first))
    for design in (np.ones((len(places), 1)), np.column_stack([np.ones(len(places)), places >= 20])):
        found = likelihood.scan(design, likelihood.fit(design))
        for place in (1, 7, 21, len(places) - 1):
            further = likelihood.fit(np.column_stack([design, places >= place]))
            assert found[place] == pytest.approx(further.evidence, abs=1e-6)
        assert found[0] < found[1:20].min() - 100  # what the design has already is no step


@pytest.mark.slow
def test_a_pair_of_steps_gains_what_its_fit_gains(cells):
    import statsmodels.api as sm

    likelihood, level = Likelihood(cells), np.ones((len(cells.first), 1))
    fit = likelihood.fit(level)
    gains = likelihood.pairs(level, fit)
    at, noise = np.unravel_index(fit.log_evidence.argmax(), fit.log_evidence.shape)
    places = np.arange(len(level))
    both = np.column_stack([level, places >= 9, places >= 21]).astype(float)
    covariance = covariance_of(cells, at, noise)
    left = [np.sum(sm.GLS(cells.values, each, covariance).fit().wresid ** 2) for each in (level, both)]
    assert gains[9, 21] == pytest.approx((left[0] - left[1]) / 2, rel=1e-6)


def test_the_interval_of_a_mixture_holds_95_per_cent_of_it():
    means, deviations, shares = np.array([0.0, 0.5]), np.array([0.1, 1.0]), np.array([0.7, 0.3])
    fit = Fit(means[None, :, None], (deviations**2)[None, :, None, None], np.log(shares)[None])
    found = fit.estimate([1.0])
    ends = [found.value - found.ci95, found.value + found.ci95]
    parts = [NormalDist(*each) for each in zip(means, deviations, strict=True)]
    low, high = (shares @ [part.cdf(end) for part in parts] for end in ends)
    assert found.value == pytest.approx(0.15)
    assert high - low == pytest.approx(0.95, abs=1e-6)


@pytest.mark.parametrize(
    ("frames", "phi", "sd", "widest"),
    [
        (8, 0.0, 0.1, 1.1),
        (20, 0.0, 0.1, 0.25),
        (20, 0.9, 0.1, 0.5),
        pytest.param(60, 0.7, 0.15, 0.38, marks=pytest.mark.slow),
        pytest.param(120, 0.5, 0.2, 0.11, marks=pytest.mark.slow),
        pytest.param(240, 0.94, 0.3, 0.5, marks=pytest.mark.slow),
    ],
)
def test_the_interval_holds_from_eight_frames_on_and_is_not_too_wide(frames, phi, sd, widest):
    inside, halves = 0, []
    for seed in range(30):
        rng = np.random.default_rng([seed, frames])
        errors = rng.uniform(0.015, 0.1, frames)
        values = -0.44 + ar1(rng, frames, phi, sd) + rng.normal(0, 1, frames) * errors
        now = assess_sequence(values, errors).segments[0].mean
        inside += abs(now.value + 0.44) <= now.ci95
        halves.append(now.ci95)
    assert inside >= 26  # of thirty, where 95 % are inside, 99.7 % have as many
    assert np.median(halves) <= widest


@pytest.mark.slow
def test_errors_that_are_said_too_small_do_not_make_the_interval_too_narrow():
    inside = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        values = ar1(rng, 120, 0.9, 0.1) + rng.normal(0, 0.15, 120)
        now = assess_sequence(values, np.full(120, 0.05)).now
        inside += abs(now.value) <= now.ci95
    assert inside >= 26


@pytest.mark.parametrize("frames", [8, 20])
def test_a_smooth_sway_of_a_short_drive_is_seldom_surely_a_drift(frames):
    surely = 0
    for seed in range(2000, 2040):
        rng = np.random.default_rng([seed, frames])
        values = swaying(rng, frames, 40, 0.97, 0.3) + rng.normal(0, 0.05, frames)
        drift = assess_sequence(values, np.full(frames, 0.05)).drift
        surely += drift.ci95 is not None and abs(drift.value) > drift.ci95
    assert surely <= 10  # of forty; 16 and 15 where no movement is smooth


@pytest.mark.slow
@pytest.mark.parametrize("fast", [{"bumps": 0.3}, {"sways": 0.2}], ids=str)
def test_a_slow_movement_under_a_faster_one_is_covered_and_seldom_a_jump(fast):
    found = [
        assess_sequence(*drive(seed, 400, level=0.0, phi=0.97, errors=(0.02, 0.1), **fast))
        for seed in range(1000, 1030)
    ]
    # of thirty; with one movement 15 and 12
    assert sum(abs(rig.now.value) <= rig.now.ci95 for rig in found) >= 25
    assert sum(bool(rig.jumps) for rig in found) <= 4


@pytest.mark.parametrize("frames", mostly_slow([1, 2, 9, 200, 2000, 20_000], 1, 9, 200))
@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 16, 17, 40])
@pytest.mark.parametrize("where", ["first", "middle", "last", "spread"])
def test_whatever_counts_gives_a_mean_among_its_frames(frames, count, where):
    count = min(count, frames)
    start = {"first": 0, "middle": (frames - count) // 2, "last": frames - count, "spread": 0}[where]
    places = np.linspace(0, frames - 1, count).astype(int) if where == "spread" else start + np.arange(count)
    values = np.full(frames, np.nan)
    values[places] = np.random.default_rng(count).normal(1.0, 0.1, count)

    found = assess_sequence(values, np.full(frames, 0.05))

    assert found.used == count
    assert np.nanmin(values) - 1e-9 <= found.segments[-1].mean.value <= np.nanmax(values) + 1e-9
    assert (found.now.ci95 is None) == (count < 8)
    assert (found.drift.value is None) or count >= 8


@pytest.mark.parametrize(("phi", "sd"), [(0.9, 0.4), (0.97, 0.1), (0.94, 0.3)])
def test_gross_outliers_are_found_and_good_frames_are_not_called_so(phi, sd):
    values, errors = drive(5, 3000, phi=phi, sd=sd)
    for few, at in ((8, 6), (13, 6), (60, 20)):
        assert gross_outliers(np.eye(few)[at] * 80, errors[:few] ** 2).nonzero()[0].tolist() == [at]
    assert gross_outliers(values, errors**2).sum() <= 3
    assert sum(assess_sequence(each, errors[:3]).outliers for each in values[:300].reshape(-1, 3)) <= 4
    rng = np.random.default_rng(6)
    bad = rng.random(3000) < 0.05
    values[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(5, 30, bad.sum())
    found = gross_outliers(values, errors**2)
    assert (found[bad].sum(), found[~bad].mean() < 0.01) == (bad.sum(), True)
