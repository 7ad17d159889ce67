"""Gradient descent with the paper's learning rate, and golden section search."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rollcli.estimator.energy import Terms
from rollcli.estimator.request import Request
from rollcli.estimator.solvers.exact import exact, minima
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from rollcli.estimator.solvers.solution import SolverStatus
from rollcli.evaluate.experiments import Textbook
from tests.estimator.synthetic_maps import at_each, bent_road, degrees_apart, energy_of, random_maps
from tests.slow import repeatable


@repeatable
@given(st.floats(-45, 45), st.sampled_from([0.01, 0.3, 1]))
def test_it_converges_to_the_global_minimum_on_roads(roll_deg, noise):
    energy = energy_of(bent_road(roll_deg, noise=noise))
    found = gradient_descent(energy, Request(tolerance=math.radians(1e-6)))
    assert found.status is SolverStatus.CONVERGED
    assert degrees_apart(found.theta, exact(energy).theta) < 1e-6


@repeatable
@given(random_maps(), st.sampled_from([1e-6, 1.0, 26.0, 1e6, "auto"]))
def test_it_never_climbs_whatever_the_first_rate(disparity, lambda0):
    energy = energy_of(disparity)
    slack = 1e-12 * (energy.rest + energy.slope_energy)
    found = gradient_descent(energy, Request(lambda0=lambda0))
    assert energy.at(found.theta).value <= energy.at(0.0).value + slack


@repeatable
@given(random_maps())
def test_what_has_converged_is_flat(disparity):
    energy = energy_of(disparity)
    found = gradient_descent(energy, Request(tolerance=math.radians(1e-6)))
    assume(found.status.converged)
    steepest = np.abs(at_each(energy, np.linspace(0, math.pi, 181)).gradient).max()
    assert abs(energy.at(found.theta).gradient) < 1e-4 * steepest


def test_newtons_rate_reaches_a_near_minimum_in_few_steps():
    energy = energy_of(bent_road(2, noise=0.3))
    assert gradient_descent(energy, Request(lambda0="auto")).iterations <= 5


def test_equal_gradients_end_it():
    v, u = np.mgrid[:60, :60] - 29.5
    flat_in_theta = 100 + 0.01 * (u * u + v * v)  # a bowl: every angle fits alike
    found = gradient_descent(energy_of(flat_in_theta))
    assert (found.iterations, found.status) == (1, SolverStatus.CONVERGED)
    assert found.theta == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("roll_deg", [-6, -2, 1, 4])
def test_it_takes_the_path_of_the_papers_equations(roll_deg):
    disparity = bent_road(roll_deg, width=150, height=100, noise=0.5)
    ours = gradient_descent(energy_of(disparity), Request(tolerance=1.7e-6))
    papers = Textbook(disparity).gradient_descent(1.7e-6)
    assert ours.iterations == papers.iterations
    assert degrees_apart(ours.theta, papers.theta) < 1e-6


def test_started_on_a_maximum_it_stays_there():
    energy = energy_of(bent_road(90, noise=0))
    assert gradient_descent(energy).theta == pytest.approx(0, abs=1e-12)
    assert degrees_apart(minima(energy)[0].theta, math.pi / 2) < 1e-6


def test_where_rounding_hides_the_fall_it_is_stuck_beside_the_minimum_and_says_so():
    v, u = np.mgrid[:40, :60] - np.array([19.5, 29.5])[:, None, None]
    symmetric = 100 + 0.01 * (u * u + v * v)  # about 0 but for the noise, so that the first step is long
    energy = energy_of(symmetric + 1e-6 * np.random.default_rng(0).normal(size=u.shape))
    found = gradient_descent(energy, Request(tolerance=1e-3, lambda0=1e6))
    there = energy.at(found.theta)
    assert found.status is SolverStatus.STUCK
    assert abs(there.gradient / there.curvature) < 1e-6
    assert there.value <= energy.at(0.0).value + 1e-14 * (energy.rest + energy.slope_energy)


class Curve:
    """An energy whose derivatives are written out, and the angles at which it was asked for."""

    weight, peak, rest, slope_energy = 0.5, 1.0, 0.0, 0.0

    def __init__(self, value, gradient, curvature):
        self.functions, self.asked = (value, gradient, curvature), []

    def at(self, theta):
        self.asked.append(theta)
        return Terms(*(function(theta) for function in self.functions))


@pytest.mark.parametrize("lowest", [-1.0, 1.0])
def test_no_step_is_longer_than_20_degrees(lowest):
    curve = Curve(lambda theta: (theta - lowest) ** 2, lambda theta: 2 * (theta - lowest), lambda theta: 2.0)
    assert gradient_descent(curve, Request(tolerance=1e-9, lambda0=1e6)).theta == pytest.approx(lowest)
    steps = np.diff(curve.asked)
    assert np.abs(steps).max() == pytest.approx(math.radians(20))
    assert steps[0] == pytest.approx(math.copysign(math.radians(20), lowest))


def test_it_ends_after_100_angles():
    curve = Curve(lambda theta: -theta, lambda theta: -1e-3, lambda theta: 0.0)
    found = gradient_descent(curve, Request(tolerance=1e-9))
    assert (found.iterations, found.status) == (100, SolverStatus.STEP_LIMIT)
    assert len(curve.asked) == 101


TABLE_1 = {1.8e3: 16, 1.8e4: 21, 1.8e5: 26, 1.8e6: 30}  # [GD] Table I: pi / delta -> iterations


@repeatable
@given(random_maps())
def test_iterations_are_those_of_the_papers_table_on_any_map(disparity):
    energy = energy_of(disparity)
    counts = [golden_section(energy, Request(tolerance=math.pi / k)).iterations for k in TABLE_1]
    assert counts == list(TABLE_1.values())


@pytest.mark.parametrize("delta_deg", [0.1, 0.01, 0.001, 0.0001])
@pytest.mark.parametrize("roll_deg", [-44, -3, 0, 17, 45])
def test_the_angle_is_within_half_the_tolerance(roll_deg, delta_deg):
    energy = energy_of(bent_road(roll_deg, noise=0.3))
    found = golden_section(energy, Request(tolerance=math.radians(delta_deg)))
    assert degrees_apart(found.theta, exact(energy).theta) <= delta_deg / 2
    assert found.status.converged


@repeatable
@given(random_maps())
def test_it_ends_near_a_minimum_or_at_the_end_of_its_bracket(disparity):
    energy = energy_of(disparity)
    theta = golden_section(energy, Request(tolerance=math.radians(0.01))).theta
    ends = [*(m.theta for m in minima(energy)), math.pi / 2]
    assert min(degrees_apart(theta, end) for end in ends) < 0.01


def test_it_takes_the_path_of_the_textbook_form():
    disparity = bent_road(-7, noise=0.5)
    found, textbook = golden_section(energy_of(disparity)), Textbook(disparity).golden_section(1.7e-6)
    assert found.iterations == textbook.iterations == 30
    assert degrees_apart(found.theta, textbook.theta) < 1e-6
