"""The exact solver: no other angle has a lower energy, and which minimum is meant."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.errors import EstimationError
from rollcli.estimator.solvers.exact import certify, exact, minima, zeros
from rollcli.estimator.solvers.solution import Solution
from tests.estimator.synthetic_maps import at_each, bent_road, degrees_apart, energy_of, random_maps
from tests.slow import repeatable

STEP = math.pi / 2048
DENSE = np.arange(2048) * STEP - math.pi / 2 + STEP


def dense_minima(energy):
    """All local minima of a dense scan, each the vertex of a parabola through a closer one: (theta, value).

    Closer scans show the rounding of E, where E hardly bends.
    """
    values = at_each(energy, DENSE).value
    low = np.flatnonzero((values < np.roll(values, 1)) & (values <= np.roll(values, -1)))
    found = []
    for theta in DENSE[low]:
        for width in (STEP, STEP / 15):
            offsets = np.linspace(-width, width, 41)
            values = at_each(energy, theta + offsets).value
            theta = theta + offsets[np.argmin(values)]
        bend, slope, _ = np.polyfit(offsets, at_each(energy, theta + offsets).value, 2)
        theta -= slope / (2 * bend)
        found.append((theta, energy.at(theta).value))
    return sorted(found, key=lambda each: each[1])


def noise_map(seed, shape=(40, 60)):
    return np.random.default_rng(seed).uniform(1, 9, shape)


@repeatable
@given(random_maps())
def test_no_angle_of_a_dense_scan_is_lower(disparity):
    energy = energy_of(disparity)
    scale = energy.rest + energy.slope_energy
    assert minima(energy)[0].energy <= at_each(energy, DENSE).value.min() + 1e-12 * scale


@repeatable
@given(st.integers(0, 9999))
def test_on_noise_it_finds_every_minimum_of_a_dense_scan(seed):
    energy = energy_of(noise_map(seed))
    found, expected = minima(energy), dense_minima(energy)
    assert len(found) == len(expected)
    for one, (theta, value) in zip(found, expected, strict=True):
        assert degrees_apart(one.theta, theta) < 5e-5
        assert one.energy == pytest.approx(value, rel=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_a_polynomial_is_zero_where_it_was_made_to_be(seed):
    places = np.sort(np.random.default_rng(seed).uniform(-math.pi, math.pi, 10))
    angles = np.arange(16) * (2 * math.pi / 16)
    samples = np.prod(np.sin((angles[:, None] - places) / 2), axis=1)  # of degree 5: ten halves
    np.testing.assert_allclose(sorted(zeros(samples)), places, atol=1e-6)
    double = zeros(np.prod(np.sin((angles[:, None] - np.repeat(places[::4], 2)) / 2), axis=1))
    off = np.abs(np.array(double)[:, None] - places[::4])
    assert (np.minimum(off, 2 * math.pi - off).min(axis=0) < 1e-3).all()


@repeatable
@given(st.integers(0, 9999))
def test_it_is_polished_to_machine_precision(seed):
    energy = energy_of(noise_map(seed))
    best = exact(energy).theta
    terms = energy.at(best)
    assert abs(terms.gradient / terms.curvature) < 1e-12


@repeatable
@given(st.integers(0, 9999))
def test_of_two_equal_minima_both_are_found_and_the_lower_angle_comes_first(seed):
    noise = noise_map(seed)
    v, u = np.mgrid[:40, :60] - np.array([19.5, 29.5])[:, None, None]
    odd = 0.02 * u * v + 0.1 * (noise - noise[:, ::-1])  # odd in u, so that E(theta) = E(-theta)
    first, second, *_ = minima(energy_of(100 + odd))
    assert first.energy == pytest.approx(second.energy, rel=1e-12)
    assert degrees_apart(first.theta, -second.theta) < 1e-6
    assert degrees_apart(first.theta, 0) > 1
    assert abs(first.theta) <= abs(second.theta)


@pytest.mark.parametrize("off_deg", [0, 1e-9, -1e-9, 1e-4, -1e-4, 0.3, -0.3])
def test_angles_about_90_degrees_are_found(off_deg):
    disparity = bent_road(90 + off_deg, noise=0)
    theta = exact(energy_of(disparity)).theta
    assert -math.pi / 2 < theta <= math.pi / 2
    assert degrees_apart(theta, math.radians(90 + off_deg)) < 1e-6


@repeatable
@given(st.floats(-89.9, 90), st.sampled_from([0, 0.001, 0.1]))
def test_a_road_at_any_roll_is_found(roll_deg, noise):
    disparity = bent_road(roll_deg, width=80, height=60, noise=noise)
    assert degrees_apart(exact(energy_of(disparity)).theta, math.radians(roll_deg)) < 1e-6 + 2 * noise


@repeatable
@given(random_maps())
def test_the_line_model_gives_the_angle_of_the_best_plane(disparity):
    energy = energy_of(disparity, parabolic=False)
    v, u = np.nonzero(disparity > 0)
    design = np.stack([np.ones(len(u)), u, v], axis=1)
    (_, c1, c2), *_ = np.linalg.lstsq(design, disparity[v, u], rcond=None)
    theta = exact(energy).theta
    assert degrees_apart(theta, math.atan2(-c1, c2)) < 1e-6
    assert energy.at(theta).value <= at_each(energy, DENSE).value.min() * (1 + 1e-12)


@pytest.mark.parametrize("columns", [(3, 40), (3, 4), (0, 59)])
def test_two_columns_of_pixels_give_the_angle_of_their_plane_not_the_singular_direction(columns):
    road = bent_road(8, width=60, height=60, bend=0, noise=0.01)
    mask = np.zeros(road.shape, bool)
    mask[:, list(columns)] = True
    theta = exact(energy_of(road * mask)).theta
    assert math.degrees(theta) == pytest.approx(8, abs=2 if columns == (3, 4) else 0.1)


@repeatable
@given(st.integers(0, 9999), st.floats(0.3, 3), st.integers(0, 20))
def test_pixels_in_a_narrow_strip_are_no_harder(seed, slope, offset):
    v, u = np.mgrid[:60, :60]
    strip = np.abs(u - slope * v - offset) < 1.5
    try:
        energy = energy_of(noise_map(seed, (60, 60)) * strip)
    except EstimationError:
        return  # too short to hold more than a line
    scale = energy.rest + energy.slope_energy
    assert minima(energy)[0].energy <= at_each(energy, DENSE).value.min() + 1e-7 * scale


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
    found = certify(ENERGY, Solution(LOWEST, 3), HIGHER + 0.05, 1e-6)
    assert (found.solution.theta, found.replaced, found.is_global) == (HIGHER, LOWEST, False)


@pytest.mark.parametrize(
    ("tolerance_deg", "off_deg", "replaced"),
    [(1e-6, 0.009, False), (1e-6, 0.011, True), (0.01, 0.09, False), (0.01, 0.11, True)],
)
def test_a_solution_within_ten_tolerances_of_the_minimum_stays(tolerance_deg, off_deg, replaced):
    solution = Solution(LOWEST + math.radians(off_deg), 3)
    found = certify(ENERGY, solution, LOWEST, math.radians(tolerance_deg))
    assert found.replaced == (solution.theta if replaced else None)
    assert found.solution.theta == (LOWEST if replaced else solution.theta)
    assert found.off == pytest.approx(0 if replaced else math.radians(off_deg), abs=1e-9)
    assert found.is_global
