"""The global minimum of the energy, without a start value.

E_min = d'd - N/D, where N and D = det(Y'Y) are homogeneous of degree 6 in cos(theta) and sin(theta). Its
derivative is (N D' - N' D) / D^2, and this numerator is a trigonometric polynomial of degree 5 in 2 theta:
as METHOD's degree-10 polynomial in tan(theta), but well conditioned at every angle, 90 degrees included.
Its 11 Fourier coefficients follow from samples of E' D^2 without error; the roots of the polynomial in
z = exp(2 i theta) near the unit circle are all the angles at which E_min can have a minimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Floats
from rollcli.estimator.solution import Solution, principal

_DEGREE = 5
_SAMPLES = 16  # more than 2 * _DEGREE + 1
_ANGLES = np.arange(_SAMPLES) * (np.pi / _SAMPLES)
_POLISH = 8


@dataclass(frozen=True)
class Minimum:
    """A local minimum of the energy: theta in radians, in (-pi/2, pi/2], and E_min there, px^2."""

    theta: float
    energy: float


def exact(energy: Energy) -> Solution:
    """Return the global minimum; of equal ones, the angle nearest to 0."""
    return Solution(minima(energy)[0].theta, 0)


def minima(energy: Energy) -> list[Minimum]:
    """Return every local minimum of the energy, the lowest first.

    Parameters
    ----------
    energy : Energy

    Returns
    -------
    list of Minimum
        At least one, at most five. Those whose energies agree to rounding are ordered by abs(theta).
    """
    if not energy.parabolic:
        return [_line_minimum(energy)]
    starts = _stationary_angles(energy)
    found: list[Minimum] = []
    for start in starts:
        theta = principal(_polished(energy, start))
        value = float(energy.at(theta).value)
        if all(abs(math.remainder(theta - other.theta, math.pi)) > 1e-7 for other in found):
            found.append(Minimum(theta, value))
    lowest = min(found, key=lambda m: m.energy)
    same = 1e-12 * (energy.rest + energy.slope_energy)
    return sorted(found, key=lambda m: (m.energy if m.energy > lowest.energy + same else -1.0, abs(m.theta)))


def _line_minimum(energy: Energy) -> Minimum:
    """Solve the quadratic in tan(theta) of a2 = 0 [TITS]: its minimum is the angle of the best plane."""
    _, c1, c2 = energy.plane
    theta = principal(math.atan2(-c1, c2))
    return Minimum(theta, float(energy.at(theta).value))


def _stationary_angles(energy: Energy) -> Floats:
    """Return angles near every local minimum, at least one, radians."""
    terms = energy.at(_ANGLES)
    spectrum = np.fft.fft(terms.gradient * energy.denominator(_ANGLES) ** 2)
    # z^5 times the series is a polynomial in z; numpy wants the highest power first
    coefficients = np.concatenate([spectrum[_DEGREE::-1], spectrum[: -_DEGREE - 1 : -1]])
    largest = np.abs(coefficients).max()
    if not largest > 0:
        return np.zeros(1)
    roots = np.roots(np.where(np.abs(coefficients) > 1e-15 * largest, coefficients, 0))
    # A double root may leave the circle by the square root of rounding; the angle of any other root is
    # harmless, for only those that the polish confirms as minima are compared.
    angles = np.angle(roots[np.abs(np.log(np.maximum(np.abs(roots), 1e-300))) < 0.1]) / 2
    candidates = np.concatenate([angles, _ANGLES[[int(np.argmin(terms.value))]]])
    curvature = energy.at(candidates).curvature
    upward = candidates[curvature > 0]
    return upward if len(upward) else candidates


def _polished(energy: Energy, theta: float) -> float:
    """Newton's method on the gradient, as long as the energy does not rise."""
    now = energy.at(theta)
    for _ in range(_POLISH):
        if not now.curvature > 0:
            break
        step = -now.gradient / now.curvature
        then = energy.at(theta + step)
        if then.value > now.value:
            break
        theta, now = theta + step, then
        if abs(step) < 1e-15:
            break
    return theta
