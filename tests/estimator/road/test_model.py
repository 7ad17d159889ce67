"""The road's rotation and parabola."""

import math

import numpy as np
import pytest

from rollcli.estimator.road.model import RoadModel
from tests.estimator.synthetic_maps import flat_road

ROLLS = [-1.4, -0.3, 0.0, 0.2, 1.1]
X, Y = np.random.default_rng(0).uniform(-1, 1, (2, 50))


@pytest.mark.parametrize("theta", ROLLS)
def test_across_and_along_are_the_pixel_turned_back_by_the_roll(theta):
    turned = (X + 1j * Y) * np.exp(-1j * theta)
    model = RoadModel(theta, (1.0, 2.0, 3.0))

    np.testing.assert_allclose(model.across(X, Y), turned.real, atol=1e-12)
    np.testing.assert_allclose(model.along(X, Y), turned.imag, atol=1e-12)


def test_the_disparity_is_a_parabola_of_the_way_along():
    model = RoadModel(0.4, (5.0, -2.0, 0.7))
    parabola = np.polynomial.Polynomial(model.alpha)

    np.testing.assert_allclose(model.disparity(X, Y), parabola(model.along(X, Y)), rtol=1e-12)


@pytest.mark.parametrize("theta", ROLLS)
def test_turning_is_the_derivative_of_the_disparity(theta):
    before, after = (RoadModel(theta + step, (5.0, -2.0, 0.7)) for step in (-1e-6, 1e-6))
    model = RoadModel(theta, (5.0, -2.0, 0.7))
    slope = (after.disparity(X, Y) - before.disparity(X, Y)) / 2e-6

    np.testing.assert_allclose(model.turning(model.across(X, Y), model.along(X, Y)), slope, atol=1e-8)


@pytest.mark.parametrize("theta", ROLLS)
def test_a_plane_is_a_road_without_curvature(theta):
    plane = (7.0, -3 * math.sin(theta), 3 * math.cos(theta))
    model = RoadModel.of_plane(*plane)

    np.testing.assert_allclose(model.disparity(X, Y), plane[0] + plane[1] * X + plane[2] * Y, rtol=1e-12)
    np.testing.assert_allclose(model.plane, plane, atol=1e-12)
    assert model.theta == pytest.approx(theta)


@pytest.mark.parametrize("roll_deg", [-20, 0, 35])
def test_the_side_of_a_pixel_is_its_way_to_the_right_in_camera_heights(roll_deg):
    """Against the geometry: pixels of a level road seen from 1.4 m, 0.3 m baseline, f = 140 px."""
    focal, baseline, height = 140.0, 0.3, 1.4
    disparity = flat_road(roll_deg, focal=focal, pitch_deg=0)
    v, u = np.nonzero(disparity > 1)
    x, y, d = u - 79.5, v - 59.5, disparity[v, u]
    roll = math.radians(roll_deg)
    depth = focal * baseline / d
    metres = (x * math.cos(roll) + y * math.sin(roll)) * depth / focal
    model = RoadModel(roll, (0.0, baseline / height, 0.0))

    np.testing.assert_allclose(
        model.side(model.across(x, y), model.disparity(x, y)), metres / height, rtol=1e-9, atol=1e-9
    )


def test_above_the_horizon_everything_is_very_far_to_the_side():
    model = RoadModel(0.0, (0.0, 1.0, 0.0))
    left, right = model.side(np.array([-1e-3, 1e-3]), np.array([-1.0, 0.0]))

    assert -left == right > 1e5


def test_camber_lifts_the_road_by_half_the_side_squared():
    """Against the geometry: ground that is higher by h camera heights is nearer by the factor 1 - h."""
    camber, side = 0.02, np.linspace(-2, 2, 9)
    model = RoadModel(0.0, (0.0, 200.0, 0.0), camber)
    y = np.full(9, 0.3)
    x = side * y  # across * slope / disparity = x / y

    lifted = model.disparity(x, y)

    height = camber / 2 * side**2
    np.testing.assert_allclose(lifted, 200 * y / (1 - height), rtol=2 * np.square(height.max()))


def test_camber_is_not_extrapolated_far_to_the_side_or_above_the_horizon():
    model = RoadModel(0.0, (0.0, 200.0, 0.0), 0.02)
    far, above = model.disparity(np.array([0.9, 0.0]), np.array([0.1, -0.1]))

    assert far == pytest.approx(20 * (1 + 0.01 * 16))
    assert above == -20


def test_a_bulge_is_half_the_disparity_times_the_side_squared_however_small_they_are():
    road = np.array([1e-3, 0.05, 0.5, 3.0])
    side = np.array([0.5, -1.0, 2.0, 3.5])
    model = RoadModel(0.0, (0.0, 0.02, 0.0))
    np.testing.assert_allclose(model.bulge(side * road / 0.02, road), road / 2 * side**2)
