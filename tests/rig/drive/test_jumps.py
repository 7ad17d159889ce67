"""The search for jumps: its steps against least squares and likelihoods that are written out."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from rollcli.rig.drive import jumps
from rollcli.rig.drive.jumps import Series, bounds_of, fit_residuals, fit_steps, search
from rollcli.rig.drive.tuning import TUNING
from tests.rig.drive.series import ar1, drive, two_jumps


def series(seed, frames=240, missing=0.0, **options):
    values, errors = drive(seed, frames, **options)
    used = np.random.default_rng(seed).random(frames) >= missing
    return Series(np.where(used, values, 0.0), errors**2, used)


def columns(frames, starts, drift):
    """One for each stretch between the starts, and a line."""
    place = np.arange(frames)
    steps = [(place >= low) & (place < high) for low, high in pairwise([0, *starts, frames])]
    return np.column_stack([*steps, place] if drift else steps).astype(float)


@pytest.mark.parametrize("drift", [False, True])
@pytest.mark.parametrize("starts", [[], [60], [60, 61, 200]])
def test_the_first_level_is_that_of_weighted_least_squares(starts, drift):
    given = series(1, missing=0.3, jump=0.5, at=60, drift=2.0)
    weights = np.where(given.used, 1 / (given.variances + np.var(given.values[given.used])), 0)
    design, root = columns(240, starts, drift), np.sqrt(weights)
    beta = np.linalg.lstsq(design * root[:, None], given.values * root, rcond=None)[0]
    assert jumps._first_level(given, starts, drift) == pytest.approx(design @ beta, abs=1e-9)


@pytest.mark.parametrize(("starts", "drift"), [((), False), ((), True), ((60,), False), ((60, 150), True)])
def test_the_score_is_twice_the_negative_log_likelihood_and_the_penalties(starts, drift):
    given = series(2, jump=0.5, at=60)
    fit = fit_steps(given, starts, drift)
    beta, _, squares = fit.cells.solve(fit.cells.design(starts, drift))
    left = fit.cells.values - fit.cells.design(starts, drift) @ beta
    # the scale of the covariance is the likeliest one: what is left over the cells
    covariance = np.linalg.inv(fit.cells.precision) * squares / len(left)
    likelihood = multivariate_normal(np.zeros(len(left)), covariance, allow_singular=False).logpdf(left)
    constant = len(left) * (np.log(2 * np.pi) + 1)
    scarce = TUNING.scarce_penalty * fit.noise.correlation_time / 240
    penalties = (14.0 + scarce) * len(starts) + (6.6 + scarce / 2) * drift
    assert fit.score == pytest.approx(-2 * likelihood - constant + penalties, rel=1e-6)


def test_the_noise_of_a_series_is_found_though_its_frames_weigh_unlike():
    rng = np.random.default_rng(5)
    frames = 40_000
    errors = rng.choice([0.05, 0.4], frames)
    values = ar1(rng, frames, 0.9, 0.3) + rng.normal(0, 1, frames) * errors
    given = Series(values, errors**2, np.ones(frames, dtype=bool))
    weights, tau2, noise, slow, white = fit_residuals(given, np.zeros(frames))
    assert tau2 == pytest.approx(0.09, rel=0.1)
    sure, unsure = (np.median(weights[errors == each]) for each in (0.05, 0.4))
    assert sure / unsure == pytest.approx((0.09 + 0.16) / (0.09 + 0.0025), rel=0.1)
    assert noise.phi == pytest.approx(0.9, abs=0.02)
    assert slow == pytest.approx(0.09, rel=0.15)
    assert white == pytest.approx(1, rel=0.15)


def test_what_is_left_is_taken_about_the_level_and_rounding_is_nothing():
    level = np.linspace(0, 1, 200)
    given = Series(level + np.resize([4e-10, -4e-10], 200), np.full(200, 1e-8), np.ones(200, dtype=bool))
    weights, tau2, noise, _, _ = fit_residuals(given, level)
    assert (tau2, noise.variance) == (0, 0)
    assert np.ptp(weights) == 0


@pytest.mark.parametrize("starts", [(), (20,), (12, 31)])
@pytest.mark.parametrize("gap", [1, 3, 7])
def test_a_further_jump_may_be_wherever_each_stretch_is_long_enough(starts, gap):
    allowed = jumps._allowed(starts, gap, 50)
    for cell in range(50):
        bounds = [0, *starts, 50]
        assert allowed[cell] == all(abs(cell - each) >= gap for each in bounds)


@pytest.mark.parametrize(
    ("frames", "time"), [(240, 1.0), (240, 9.0), (2000, 3.0), (2000, 30.0), (2000, 900.0)]
)
def test_the_shortest_stretch_is_four_correlation_times_within_eight_frames_and_a_twelfth(frames, time):
    fit = fit_steps(series(3, frames), (), drift=False)
    noise = fit.noise.__class__(1.0, 0.9, 1.0, time)
    found = jumps._gap(jumps.Fit((), False, fit.cells, fit.weights, noise, 1.0, 1.0, 1.0, 0.0))
    width = int(np.diff(fit.cells.first)[0])
    assert width == np.ceil(frames / 250)
    assert (found - 1) * width < max(8, int(min(4 * time, frames / 12))) <= found * width


def test_a_step_persists_and_a_kick_that_fades_does_not():
    rng = np.random.default_rng(4)
    noise = ar1(rng, 240, 0.9, 0.05)
    step = np.where(np.arange(240) >= 100, 1.0, 0.0)
    kick = step * 0.9 ** np.maximum(np.arange(240) - 100, 0)
    for shape, lasts in ((step, True), (kick, False), (-step, True), (step + 2 * kick, False)):
        given = Series(noise + shape, np.full(240, 1e-4), np.ones(240, dtype=bool))
        found = fit_steps(given, (100,), drift=False)
        slow = found.noise.__class__(1.0, 0.9, 1.0, 19.0)
        cells = jumps.make_cells(given.values, found.weights, given.variances, 0.01, 0.9, 1)
        fit = jumps.Fit((100,), False, cells, found.weights, slow, 0.01, 1.0, 0.0, 0.0)
        assert jumps._persists(fit, 100) == lasts


def test_without_correlation_a_step_is_no_kick():
    given = series(6, phi=0.0, sd=0.05, jump=1.0, at=100)
    fit = fit_steps(given, (100,), drift=False)
    assert fit.noise.phi == 0
    assert jumps._persists(fit, 100)


@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_jumps_are_found_beside_a_line_and_without_one(drift):
    found = search(two_jumps(drift))
    assert found.drift == (drift != 0)
    assert found.starts == (50, 110)


def test_a_proposed_jump_moves_to_where_it_explains_most():
    given = series(8, phi=0.5, sd=0.02, errors=(0.01, 0.02), jump=1.0, at=100)
    fit = fit_steps(given, (), drift=False)
    gap = jumps._gap(fit)
    assert jumps._settled(given, (100 - gap,), fit) == (100,)
    assert jumps._settled(given, (), fit) == ()
    # of two that begin too close together each makes room for the other
    settled = jumps._settled(given, (99, 101), fit)
    assert len(settled) < 2 or settled[1] - settled[0] >= gap


@pytest.mark.parametrize("shape", [np.repeat([0.0, 9.0], 12), np.linspace(0, 9, 24)], ids=["step", "line"])
def test_fewer_frames_than_two_dozen_neither_jump_nor_drift(shape):
    values = shape + np.random.default_rng(0).normal(0, 0.1, 24)
    for count in (23, 24):
        used = np.arange(24) >= 24 - count
        found = search(Series(np.where(used, values, 0), np.full(24, 1e-4), used))
        assert (bool(found.starts) or found.drift) == (count == 24)


def test_stretches_begin_and_end_at_the_starts():
    assert bounds_of([], 9) == [(0, 9)]
    assert bounds_of([2, 5], 9) == [(0, 2), (2, 5), (5, 9)]


@pytest.mark.parametrize(("off", "reached"), [(4, True), (5, False), (-4, True), (-5, False)])
def test_where_stretches_are_short_a_proposed_jump_moves_twice_by_two_cells(off, reached):
    given = series(9, 2500, phi=0.0, sd=0.02, errors=(0.01, 0.02))
    fit = fit_steps(given, (), drift=False)
    assert jumps._gap(fit) == 1
    jumped = Series(given.values + (np.arange(2500) >= 1000), given.variances, given.used)
    cells = jumps.make_cells(jumped.values, fit.weights, given.variances, 0.0, 0.0, 10)
    moved = jumps._settled(jumped, (100 + off,), replace(fit, cells=cells))
    assert (moved == (100,)) == reached


def test_one_more_jump_is_proposed_by_the_scan_and_one_or_two_by_the_partitions():
    given = series(10, phi=0.5, sd=0.02, errors=(0.01, 0.02))
    shape = np.where(np.arange(240) >= 100, 1.0, 0.0)
    once = Series(given.values + shape, given.variances, given.used)
    scan, one, two = jumps._proposals(once, fit_steps(once, (), drift=False))
    assert scan == (100,)
    assert (len(one), len(two)) == (1, 2)
    # with what is there already, and beside it the next one
    twice = Series(once.values - 2 * (np.arange(240) >= 170), given.variances, given.used)
    scan, one, two = jumps._proposals(twice, fit_steps(twice, (100,), drift=False))
    assert scan == (100, 170)
    assert (len(one), len(two)) == (2, 3)
