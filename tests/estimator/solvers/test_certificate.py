"""Which minimum is meant, and whether it is the lowest."""

import math

import numpy as np
import pytest

from rollcli.estimator.solvers.exact import certify, certify_near, minima
from rollcli.estimator.solvers.solution import Solution
from tests.estimator.synthetic_maps import energy_of

ENERGY = energy_of(np.random.default_rng(3).uniform(1, 9, (40, 60)))
LOWEST, HIGHER = (minimum.theta for minimum in minima(ENERGY)[:2])


def test_the_lowest_minimum_is_global_and_another_is_not():
    assert certify(ENERGY, Solution(LOWEST, 3)).is_global
    assert not certify(ENERGY, Solution(HIGHER, 3)).is_global


@pytest.mark.parametrize(("times", "is_global"), [(0.8, True), (1.2, False)])
def test_a_solution_whose_energy_is_a_billionth_higher_is_still_the_lowest(times, is_global):
    there = ENERGY.at(LOWEST)
    off = math.sqrt(2 * times * 1e-9 * (ENERGY.rest + ENERGY.slope_energy) / there.curvature)
    assert certify(ENERGY, Solution(LOWEST + off, 3)).is_global == is_global


def test_the_minimum_nearest_to_the_road_replaces_another():
    found = certify_near(ENERGY, Solution(LOWEST, 3), HIGHER + 0.05, 1e-6)
    assert (found.solution.theta, found.replaced, found.is_global) == (HIGHER, LOWEST, False)


@pytest.mark.parametrize(
    ("tolerance_deg", "off_deg", "replaced"),
    [(1e-6, 0.009, False), (1e-6, 0.011, True), (0.01, 0.09, False), (0.01, 0.11, True)],
)
def test_a_solution_within_ten_tolerances_of_the_minimum_stays(tolerance_deg, off_deg, replaced):
    solution = Solution(LOWEST + math.radians(off_deg), 3)
    found = certify_near(ENERGY, solution, LOWEST, math.radians(tolerance_deg))
    assert found.replaced == (solution.theta if replaced else None)
    assert found.solution.theta == (LOWEST if replaced else solution.theta)
