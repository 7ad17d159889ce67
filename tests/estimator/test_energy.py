"""The energy, its derivatives and its parabola."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.errors import EstimationError
from rollcli.estimator.solvers.exact import exact
from tests.estimator.synthetic_maps import at_each, bent_road, degrees_apart, energy_of, random_maps
from tests.slow import repeatable

ANGLES = np.linspace(-math.pi / 2, math.pi / 2, 181)
angles = st.floats(-math.pi / 2, math.pi / 2)


def least_squares(disparity, theta, degree=2):
    """The residual energy of an n x 3 (or n x 2) least-squares fit, and its coefficients."""
    v, u = np.nonzero(disparity > 0)
    y = v * math.cos(theta) - u * math.sin(theta)
    centre, scale = y.mean(), np.ptp(y)
    design = np.vander((y - centre) / scale, degree + 1, increasing=True)
    d = disparity[v, u]
    alpha, *_ = np.linalg.lstsq(design, d, rcond=None)
    return float(np.sum((d - design @ alpha) ** 2)), np.polynomial.Polynomial(alpha)((y - centre) / scale)


def central(function, theta, step):
    """The derivative by central differences of order 8: narrow maps bend too much for lower ones."""
    pairs = ((4 / 5, 1), (-1 / 5, 2), (4 / 105, 3), (-1 / 280, 4))
    return sum(c * (function(theta + k * step) - function(theta - k * step)) for c, k in pairs) / step


@repeatable
@given(random_maps(), angles, st.booleans())
def test_energy_is_that_of_a_least_squares_fit(disparity, theta, parabolic):
    energy = energy_of(disparity, parabolic=parabolic)
    scale = energy.rest + parabolic * energy.slope_energy
    rounding = disparity.size * np.finfo(float).eps * np.sum(disparity**2)  # of a sum of n squares
    expected, _ = least_squares(disparity, theta, degree=1 + parabolic)
    assert energy.at(theta).value == pytest.approx(expected, rel=1e-9, abs=1e-9 * scale + rounding)


@repeatable
@given(random_maps(), angles, st.booleans())
def test_gradient_and_curvature_agree_with_central_differences(disparity, theta, parabolic):
    energy = energy_of(disparity, parabolic=parabolic)
    terms, everywhere, step = energy.at(theta), at_each(energy, ANGLES), 1e-3
    for function, derivative in (("value", "gradient"), ("gradient", "curvature")):
        expected = central(lambda t: getattr(energy.at(t), function), theta, step)  # noqa: B023
        rounding = np.finfo(float).eps / step * abs(getattr(terms, function))
        most = 1e-8 * np.abs(getattr(everywhere, derivative)).max() + rounding
        assert getattr(terms, derivative) == pytest.approx(expected, rel=1e-6, abs=most)


@repeatable
@given(random_maps(), angles)
def test_the_parabola_is_the_least_squares_fit_in_pixels(disparity, theta):
    energy = energy_of(disparity)
    a0, a1, a2 = energy.parabola(theta)
    v, u = np.nonzero(disparity > 0)
    y = v * math.cos(theta) - u * math.sin(theta)
    _, fitted = least_squares(disparity, theta)
    np.testing.assert_allclose(a0 + a1 * y + a2 * y * y, fitted, atol=1e-6 * disparity.max())


def test_rmse_is_the_root_of_the_mean_squared_residual():
    disparity = bent_road(10, noise=0.25)
    energy = energy_of(disparity)
    assert energy.rmse(energy.at(math.radians(10)).value) == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize("roll_deg", [-33, -4, 0, 11, 45])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shifting_scaling_or_adding_a_constant_leaves_the_angle(roll_deg, dtype):
    disparity = bent_road(roll_deg, width=400, height=380, noise=2.0).astype(dtype)
    disparity[:, ::5] = 0
    angle = exact(energy_of(disparity)).theta
    shifted = np.pad(disparity, ((31, 0), (57, 12)))
    added = np.where(disparity > 0, disparity.astype(np.float64) + 100, 0)
    for changed in (shifted, disparity * dtype(0.0625), disparity.astype(np.float64) * 7.3, added):
        assert degrees_apart(exact(energy_of(changed)).theta, angle) < 1e-6


LINE = "the valid pixels lie on one line"


def kept(mask):
    return bent_road(5, width=60, height=60, noise=0.1) * mask


V, U = np.mgrid[:60, :60]


@pytest.mark.parametrize(
    ("disparity", "reason"),
    [
        (np.full((600, 600), 7.3, np.float32), "the same everywhere"),
        (kept(U == 9), LINE),
        (kept(V == 9), LINE),
        (kept(U == V), LINE),
        (kept((U == 3) & (V == 4)), LINE),
        (bent_road(5) * 1e200, "double precision"),
        (bent_road(5) * 1e-160, "double precision"),
    ],
)
def test_pixels_that_do_not_determine_a_roll_are_refused_with_the_reason(disparity, reason):
    with pytest.raises(EstimationError, match=reason):
        energy_of(disparity)


def test_a_line_across_a_large_map_is_seen():
    v, u = np.mgrid[:600, :900]
    with pytest.raises(EstimationError, match=LINE):
        energy_of(np.where(2 * u == 3 * v, 5 + u / 100, 0).astype(np.float32))


def test_a_parabola_through_two_lines_of_pixels_is_refused():
    two = kept((U == V) | (U == V + 5))
    with pytest.raises(EstimationError, match="two lines"):
        energy_of(two).parabola(math.radians(45))


@pytest.mark.parametrize(("times", "enough"), [(0.9, False), (1.1, True)])
def test_a_map_is_the_same_everywhere_when_it_bends_by_less_than_rounding(times, enough):
    v, u = np.mgrid[:60, :60] - 29.5
    bend = u * v / np.sum((u * v) ** 2) * 30**2  # of which sum p q d is 1 on normalised coordinates
    least = 1e-9 * 3600 * 100  # a billionth of the disparity for each pixel
    if enough:
        assert energy_of(100 + times * least * bend).weight == 3600
    else:
        with pytest.raises(EstimationError, match="the same everywhere"):
            energy_of(100 + times * least * bend)


@pytest.mark.parametrize("theta", [-1.2, -0.3, 0.0, 0.4, 1.5])
def test_the_quotient_whose_roots_are_minima_is_the_energy(theta):
    disparity = bent_road(7, width=60, height=40, noise=0.5)
    disparity[:17, :33] = 0  # what is not symmetric has sums of odd powers
    energy = energy_of(disparity)
    over, under = energy.as_quotient(np.array([3 * math.cos(theta)]), np.array([3 * math.sin(theta)]))
    assert (over / under + energy.rest).item() == pytest.approx(energy.at(theta).value, rel=1e-9)
