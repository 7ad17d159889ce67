"""Golden section search."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.estimator.request import SolverSettings
from rollcli.estimator.solvers.exact import exact, minima
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.evaluate.experiments import Textbook
from tests.estimator.synthetic_maps import bent_road, degrees_apart, energy_of, random_maps, repeatable

TABLE_1 = {1.8e3: 16, 1.8e4: 21, 1.8e5: 26, 1.8e6: 30}  # [GD] Table I: pi / delta -> iterations


@repeatable
@given(random_maps())
def test_iterations_are_those_of_the_papers_table_on_any_map(disparity):
    energy = energy_of(disparity)
    counts = [golden_section(energy, SolverSettings(math.pi / k)).iterations for k in TABLE_1]
    assert counts == list(TABLE_1.values())


@pytest.mark.parametrize("delta_deg", [0.1, 0.01, 0.001, 0.0001])
@pytest.mark.parametrize("roll_deg", [-44, -3, 0, 17, 45])
def test_the_angle_is_within_half_the_tolerance(roll_deg, delta_deg):
    energy = energy_of(bent_road(roll_deg, noise=0.3))
    found = golden_section(energy, SolverSettings(math.radians(delta_deg)))
    assert degrees_apart(found.theta, exact(energy).theta) <= delta_deg / 2
    assert found.status.converged


@repeatable
@given(st.floats(-90, 90))
def test_the_angle_stays_in_its_range(roll_deg):
    theta = golden_section(energy_of(bent_road(roll_deg, width=40, height=30))).theta
    assert -math.pi / 2 < theta <= math.pi / 2


@repeatable
@given(random_maps())
def test_it_ends_near_a_minimum_or_at_the_end_of_its_bracket(disparity):
    energy = energy_of(disparity)
    theta = golden_section(energy, SolverSettings(math.radians(0.01))).theta
    ends = [*(m.theta for m in minima(energy)), math.pi / 2]
    assert min(degrees_apart(theta, end) for end in ends) < 0.01


def test_a_tolerance_below_rounding_ends_too():
    energy = energy_of(bent_road(5, noise=0.1))
    assert golden_section(energy, SolverSettings(1e-300)).iterations < 100


def test_it_takes_the_path_of_the_textbook_form():
    disparity = bent_road(-7, noise=0.5)
    found, textbook = golden_section(energy_of(disparity)), Textbook.of(disparity).golden_section(1.7e-6)
    assert found.iterations == textbook.iterations == 30
    assert degrees_apart(found.theta, textbook.theta) < 1e-6
