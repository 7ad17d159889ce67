"""The jackknife is that of weighted least squares, solved group by group and part by part."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import jackknife
from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.tuning import TUNING


class Fitted(NamedTuple):
    """A surface of scattered pixels, and its linear problem by central differences of the road."""

    surface: Surface
    design: Floats  # shape (N, 5)
    wanted: Floats  # shape (N,)
    prior: float

    def solve(self, weights, columns=slice(None)):
        """The least-squares parameters at some weights, prior included, and the sum that they minimise."""
        rows = np.vstack([self.design * np.sqrt(weights)[:, None], [0, 0, 0, 0, math.sqrt(self.prior)]])
        wanted = np.append(self.wanted * np.sqrt(weights), 0)
        found = np.linalg.lstsq(rows[:, columns], wanted, rcond=None)[0]
        return found, np.sum((wanted - rows[:, columns] @ found) ** 2)


def fitted(*, prior=4e3, parabolic=True, heavy=1.0, count=241, noise=0.3):
    """Such a surface with a bulge, and the theta about which it is laid out."""
    rng = np.random.default_rng(11)
    x, y = rng.uniform(-0.9, 0.9, count), rng.uniform(0.05, 0.6, count)
    weights = heavy * rng.uniform(0.2, 1, count)
    alpha = np.array([30.0, 60.0, 9.0 if parabolic else 0.0])
    theta, camber, step = 0.2, 0.01, 1e-5

    def disparity(change):
        a0, a1, a2, turned, bulge = change
        return RoadModel(theta + turned, (30 + a0, 60 + a1, alpha[2] + a2), bulge).disparity(x, y)

    steps = step * np.eye(5)
    design = np.stack([(disparity(each) - disparity(-each)) / (2 * step) for each in steps], axis=1)
    design[:, 2] *= parabolic
    design[:, 4] *= math.isfinite(prior)
    wanted = design @ [0.2, -0.3, 0.1, 0.01, 0.0] + rng.normal(0, noise, count)
    surface = Surface(
        x=x,
        y=y,
        d=disparity(np.zeros(5)) + wanted,
        weights=weights,
        model=RoadModel(0.0, tuple(alpha), camber),
        grid=Grid.of_shape(480, 640),
        noise=0.1,
        parabolic=parabolic,
        camber_precision=prior,
    )
    return Fitted(surface, design, wanted, prior if math.isfinite(prior) else 0.0), theta


def equal_shares(position, share, count=6):
    """The group of each pixel, when so many of equal share are cut along a position."""
    order = np.argsort(position)
    groups = np.empty(len(order), int)
    groups[order] = np.minimum(count * np.cumsum(share[order]) // share.sum(), count - 1)
    return groups


# of a parameter's largest change, or of its textbook error: the sums are in single precision (6e-8), and the
# normal equations have condition numbers of up to 260, more where a group is left out
SINGLE = 1e-4

CASES = [{}, {"prior": math.inf}, {"parabolic": False}, {"heavy": 0.3}, {"prior": 5e4}]


@pytest.mark.parametrize("case", CASES)
def test_without_each_group_all_parameters_are_those_of_a_least_squares_fit(case):
    problem, theta = fitted(**case)
    surface, weights = problem.surface, problem.surface.weights
    road = RoadModel(theta, surface.model.alpha)
    across, along = road.across(surface.x, surface.y), road.along(surface.x, surface.y)
    turning = weights * problem.design[:, 3] ** 2
    found = jackknife(surface, theta, TUNING.interval)

    whole, _ = problem.solve(weights)
    for changes, freedom, position, share in (
        (found.bands, found.freedom[0], along, np.ones_like(along)),
        (found.columns, found.freedom[1], across, turning),
    ):
        groups = equal_shares(position, share)
        without = [problem.solve(weights * (groups != k))[0][:4] for k in range(6)]
        expected = whole[:4] - without
        assert (np.abs(changes - expected) < SINGLE * np.abs(expected).max(axis=0) + 1e-9).all()
        leverage = np.bincount(groups, turning) / turning.sum()
        assert freedom == pytest.approx(1 / np.sum(leverage**2) - 1, rel=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_the_textbooks_covariance_is_that_of_as_many_pixels_as_could_be_independent(case):
    problem, theta = fitted(**case)
    weights = problem.surface.weights
    known = np.flatnonzero(problem.design.any(axis=0))
    normal = (problem.design.T * weights) @ problem.design + np.diag([0, 0, 0, 0, problem.prior])
    _, squares = problem.solve(weights)
    independent = max(1, weights.sum() / TUNING.interval.independent_pixels)
    expected = np.zeros((5, 5))
    inverse = np.linalg.inv(normal[np.ix_(known, known)])
    expected[np.ix_(known, known)] = inverse * squares / weights.sum() * independent
    white = jackknife(problem.surface, theta, TUNING.interval).white
    errors = np.sqrt(expected.diagonal()[:4])
    assert (np.abs(white - expected[:4, :4]) <= SINGLE * np.outer(errors, errors)).all()


def test_the_unevenness_of_waves_is_theirs_and_that_of_noise_is_none():
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:300, :400].astype(float)
    plane = 5 + 0.2 * rows
    side = (columns - 199.5) * 0.2 / plane  # camera heights
    waves = 0.004 * np.sin(2 * math.pi * side / 1.7) * np.sin(40 / plane)
    noise = rng.normal(0, 0.2, plane.shape)
    rough, smooth = (
        estimate_roll(plane * (1 + height) + noise).tangent.jackknife.uneven for height in (waves, 0)
    )
    view = 400 * 0.2 / plane.max()
    assert 0.4 < rough * view / np.sqrt(np.mean(waves**2)) < 1.2
    assert smooth < 0.15 * rough


def test_the_part_of_the_camber_is_what_a_fit_without_it_turns_by():
    problem, theta = fitted()
    root = np.sqrt(problem.surface.weights)[:, None]
    bulge = 0.01 * problem.design[:, 4:]
    turned = np.linalg.lstsq(problem.design[:, :4] * root, bulge * root, rcond=None)[0][3, 0]
    assert jackknife(problem.surface, theta, TUNING.interval).bend == pytest.approx(abs(turned), rel=1e-5)


def test_the_camber_is_that_which_the_pixels_ask_for_without_the_prior():
    problem, theta = fitted()
    with_prior = problem.solve(problem.surface.weights)[0][4]
    alone = problem._replace(prior=0.0).solve(problem.surface.weights)[0][4]
    surface = dataclasses.replace(
        problem.surface, model=problem.surface.model._replace(camber=float(with_prior))
    )
    assert abs(with_prior) < 0.99 * abs(alone)
    assert jackknife(surface, theta, TUNING.interval).camber == pytest.approx(alone, rel=1e-5)


@pytest.mark.parametrize(("times", "known"), [(0.99, True), (1.01, False)])
def test_a_camber_of_which_the_prior_knows_more_than_the_pixels_is_left_open(times, known):
    problem, _ = fitted()
    weights = problem.surface.weights
    root = np.sqrt(weights)
    others = problem.design[:, :4] * root[:, None]
    bulge = problem.design[:, 4] * root
    rest = bulge - others @ np.linalg.lstsq(others, bulge, rcond=None)[0]  # what tells of the camber alone
    problem, theta = fitted(prior=times * float(rest @ rest))
    assert (jackknife(problem.surface, theta, TUNING.interval).camber is not None) == known
