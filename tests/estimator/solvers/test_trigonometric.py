"""Zeros of trigonometric polynomials, against dense scans."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.estimator.solvers import exact as trigonometric
from rollcli.estimator.solvers.exact import DEGREE, SAMPLES, derivative, rising_zeros, zeros
from tests.estimator.synthetic_maps import repeatable

PLACES = np.arange(SAMPLES) * (2 * math.pi / SAMPLES)
DENSE = np.arange(40000) * (2 * math.pi / 40000) + 1e-5
ORDERS = np.arange(1, DEGREE + 1)


def polynomial(seed, mean=0.0, fade=1.0):
    """A polynomial whose k-th wave has sizes about fade^k, and its slope."""
    cosines, sines = np.random.default_rng(seed).normal(size=(2, DEGREE)) * fade**ORDERS

    def value(angles):
        waves = np.multiply.outer(angles, ORDERS)
        return mean + np.cos(waves) @ cosines + np.sin(waves) @ sines

    def slope(angles):
        waves = np.multiply.outer(angles, ORDERS)
        return np.cos(waves) @ (ORDERS * sines) - np.sin(waves) @ (ORDERS * cosines)

    return value, slope


def scanned(value):
    """Where a dense scan finds that the polynomial rises through 0, and where it falls."""
    low = value(DENSE)
    high = np.roll(low, -1)
    middle = DENSE + math.pi / 40000
    return middle[(low < 0) & (high >= 0)], middle[(low >= 0) & (high < 0)]


def apart(one, other):
    return np.abs(np.angle(np.exp(1j * (np.subtract.outer(one, other)))))


@repeatable
@given(st.integers(0, 99999), st.floats(-2, 2), st.floats(0.1, 2))
def test_zeros_that_are_proven_are_all_and_no_others(seed, mean, fade):
    value, slope = polynomial(seed, mean, fade)
    found = rising_zeros(value(PLACES))
    if found is None:
        return
    expected, _ = scanned(value)
    assert len(found) == len(expected)
    if found:
        assert apart(found, expected).min(0).max() < 2e-4
        assert np.abs(value(np.array(found)) / slope(np.array(found))).max() < 1e-9


def test_most_smooth_polynomials_are_proven():
    proven = [rising_zeros(polynomial(seed, 0.0, 0.5)[0](PLACES)) is not None for seed in range(400)]
    assert np.mean(proven) > 0.95


@pytest.mark.parametrize("order", ORDERS)
def test_the_bounds_between_two_places_are_what_a_wave_and_its_slope_bend_by(order):
    matrices = trigonometric._matrices()
    bounds = matrices.bends @ np.abs(matrices.to_waves @ np.cos(order * PLACES))
    half = math.pi / trigonometric._FINE  # of what lies between two places
    bend = 1 - math.cos(order * half)  # of the wave off the chord, where it is most curved
    for bound, most in zip(bounds, (bend, order * bend), strict=True):
        assert most <= bound < 1.01 * most


@repeatable
@given(st.floats(0, 6.28), st.floats(1e-9, 0.01), st.booleans())
def test_two_zeros_that_are_close_are_not_overlooked(place, gap, upward):
    def value(angles):  # a double zero that is split, or has just vanished
        return (1 - np.cos(angles - place) - (gap**2 / 2 if upward else -(gap**2) / 2)) * (2 + np.sin(angles))

    found = rising_zeros(value(PLACES))
    assert found is None or len(found) == upward


@repeatable
@given(st.integers(0, 99999), st.floats(-2, 2), st.floats(0.3, 2))
def test_roots_are_near_every_zero(seed, mean, fade):
    value, _ = polynomial(seed, mean, fade)
    found = zeros(value(PLACES))
    for expected in scanned(value):
        if len(expected):
            assert apart(found, expected).min(0).max() < 2e-4


@pytest.mark.parametrize("place", [0.0, math.pi / 8, math.pi, 2 * math.pi - 1e-17, 1e-17])
def test_a_zero_at_a_place_of_the_grid_is_found_once(place):
    (found,) = rising_zeros(np.sin(PLACES - place))
    assert apart([found], [place])[0, 0] < 1e-12


def test_nothing_is_proven_where_all_is_zero():
    assert rising_zeros(np.zeros(SAMPLES)) is None
    assert zeros(np.zeros(SAMPLES)) == []


def test_a_polynomial_without_zeros_has_none():
    assert rising_zeros(2 + np.cos(PLACES)) == []


@pytest.mark.parametrize("seed", range(5))
def test_the_derivative_is_that_of_the_polynomial(seed):
    value, slope = polynomial(seed, 3.0)
    np.testing.assert_allclose(derivative(value(PLACES)), slope(PLACES), atol=1e-12)
