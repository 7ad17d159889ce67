"""The tangent's errors are those of the parabola that it touches."""

import math

import numpy as np
import pytest

from rollcli.estimator.interval import Jackknife, touch
from rollcli.estimator.moments import Grid
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import whole_surface
from rollcli.estimator.tuning import TUNING
from tests.estimator.synthetic_maps import bent_road, energy_of

GRID = Grid.of_shape(375, 1242)
THETA = 0.2


def knife(bands, columns, white):
    return Jackknife(np.array(bands), np.array(columns), np.array(white), (3.0, 5.0), 0.0, 0.0, None)


@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_errors_have_the_covariance_that_those_of_the_parabola_imply(size):
    rng = np.random.default_rng(5)
    bands, columns, roots = (size * rng.normal(size=shape) for shape in ((6, 4), (6, 4), (4, 4)))
    white = roots @ roots.T
    tangent = touch((30.0, 0.3, 1e-5), THETA, GRID, None, knife(bands, columns, white))
    # by hand: (a0, a1, a2, theta) are independent sums of all groups, and of the textbook's 95 % half-widths
    covariance = bands.T @ bands + columns.T @ columns + 1.96**2 * white
    across = GRID.centre_u * math.cos(THETA) + GRID.centre_v * math.sin(THETA)
    to_pixels = np.array([[1, 0, 0, tangent.slope * across], [0, 1 / GRID.scale, 0, 0], [0, 0, 0, 1]])
    expected = to_pixels @ covariance @ to_pixels.T
    np.testing.assert_allclose(tangent.changes.T @ tangent.changes, expected, rtol=1e-9)


def test_a_slope_along_the_rows_turns_a_road_by_its_part_across_and_a_constant_one_not_at_all():
    assert touch((30.0, 0.0, 0.0), THETA, GRID, None, None).turned_by(1e-3) == 0
    slope, theta = 0.3, 0.2
    rolled = np.array([-slope * math.sin(theta), slope * math.cos(theta)])  # along the columns, the rows
    turned = [math.atan2(-(rolled[0] + change), rolled[1]) for change in (1e-6, -1e-6)]
    tangent = touch((30.0, slope, 0.0), theta, GRID, None, None)
    assert tangent.turned_by(1e-6) == pytest.approx(abs(turned[0] - turned[1]) / 2, rel=1e-6)


def touched(disparity, alpha=None):
    """The tangent of a map's parabola, or of another, amid all of its pixels, and the mean of their rows."""
    surface = whole_surface(take_sample(disparity, None, TUNING.sample), energy := energy_of(disparity))
    u, v = (each * surface.grid.scale for each in (surface.x, surface.y))
    y = (v + 119.5) * math.cos(THETA) - (u + 159.5) * math.sin(THETA)
    return touch(alpha or energy.parabola(THETA), THETA, GRID, surface, None), y.mean()


@pytest.mark.parametrize("bend", [-300.0, 300.0])
def test_on_a_road_of_constant_curvature_it_is_the_roads_own_tangent(bend):
    v, u = np.mgrid[:240, :320]
    y = v * math.cos(THETA) - u * math.sin(THETA) + 120

    # y = 3 d + bend / d, solved for the disparity
    def road(y):
        return (y + np.sqrt(y**2 - 12 * bend)) / 6

    tangent, row = touched(np.where(y > 100, road(np.maximum(y, 100)), 0))
    there = road(tangent.row + 120)
    assert tangent.row == pytest.approx(row, abs=1e-3)
    assert tangent.disparity == pytest.approx(there, rel=1e-3)
    assert tangent.slope == pytest.approx(1 / (3 - bend / there**2), rel=2e-3)


def test_what_bends_more_than_a_road_moves_it_by_a_twentieth_at_most():
    for bend in (-0.01, 0.01):
        alpha = (30.0 + 100 * abs(bend) * 100, 0.3 - 2 * bend * 85, bend)  # a slope of 0.3 about the middle
        tangent, _ = touched(bent_road(0, width=320, height=240, bend=0), alpha)
        own = alpha[1] + 2 * bend * tangent.row
        assert own > 0
        assert abs(tangent.slope / own - 1) == pytest.approx(0.05)


def test_of_a_surface_that_falls_it_is_the_parabolas():
    alpha = (90.0, -0.3, 1e-4)
    tangent, _ = touched(bent_road(0, width=320, height=240, bend=0), alpha)
    parabola = np.polynomial.Polynomial(alpha)
    assert tangent.disparity == pytest.approx(parabola(tangent.row), rel=1e-12)
    assert tangent.slope == pytest.approx(parabola.deriv()(tangent.row), rel=1e-12)
