"""The tangent's errors are those of the parabola that it touches."""

import math

import numpy as np
import pytest

from rollcli.estimator.interval import Jackknife
from rollcli.estimator.moments import Grid
from rollcli.estimator.tangent import touch

GRID = Grid.of_shape(375, 1242)
THETA = 0.2


def knife(bands, columns, white):
    return Jackknife(np.array(bands), np.array(columns), np.array(white), (3.0, 5.0), 0.0, 0.0, 0.0, None)


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


def test_a_textbook_that_knows_some_parameter_exactly_adds_no_error_to_it():
    white = np.diag([0.04, 0.01, 0.0, 0.0])  # of a line: there is no a2, and here no roll to err
    nothing = np.zeros((2, 4))
    tangent = touch((30.0, 0.3, 0.0), THETA, GRID, None, knife(nothing, nothing, white))
    assert (tangent.changes[:, 2] == 0).all()
    assert np.square(tangent.changes[:, 0]).sum() == pytest.approx(1.96**2 * 0.04)


def test_without_pixels_it_touches_at_the_centre_of_the_map():
    parabola = np.polynomial.Polynomial((30.0, 0.3, 1e-4))
    tangent = touch(tuple(parabola.coef), THETA, GRID, None, None)
    row = 187 * math.cos(THETA) - 620.5 * math.sin(THETA)
    assert tangent.row == pytest.approx(row)
    assert tangent.disparity == pytest.approx(parabola(row))
    assert tangent.slope == pytest.approx(parabola.deriv()(row))
    assert tangent.changes is None


def test_a_slope_along_the_rows_turns_a_road_by_its_part_across_and_a_constant_one_not_at_all():
    assert touch((30.0, 0.0, 0.0), THETA, GRID, None, None).turned_by(1e-3) == 0
    slope, theta = 0.3, 0.2
    rolled = np.array([-slope * math.sin(theta), slope * math.cos(theta)])  # along the columns, the rows
    turned = [math.atan2(-(rolled[0] + change), rolled[1]) for change in (1e-6, -1e-6)]
    tangent = touch((30.0, slope, 0.0), theta, GRID, None, None)
    assert tangent.turned_by(1e-6) == pytest.approx(abs(turned[0] - turned[1]) / 2, rel=1e-6)


def test_what_it_shows_has_no_array_in_it():
    assert "changes" not in repr(touch((30.0, 0.3, 0.0), THETA, GRID, None, None))
