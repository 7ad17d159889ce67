"""The global minimum of the energy, without a start value.

E_min = d'd - N/D, where N and D = det(Y'Y) are homogeneous of degree 6 in cos(theta) and sin(theta). Its
derivative is (N D' - N' D) / D^2, and this numerator is a trigonometric polynomial of degree 5 in 2 theta:
a polynomial of degree 10 in tan(theta), but well conditioned at every angle, 90 degrees included. Its 11
Fourier coefficients follow from samples of E' D^2 without error; the roots of the polynomial in
z = exp(2 i theta) near the unit circle are all the angles at which E_min can have a minimum.

[TITS]: Fan, Liu, "Road Damage Detection Based on Unsupervised Disparity Map Segmentation", IEEE T-ITS (2019).
"""

import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.energy import Energy
from rollcli.estimator.methods import DEFAULT_SOLVER, SolverSettings
from rollcli.estimator.moments import Floats
from rollcli.estimator.solvers.solution import Solution, angle_between, principal

_DEGREE = 5
_SAMPLES = 16  # more than 2 * _DEGREE + 1
_ANGLES: Floats = np.linspace(0, np.pi, _SAMPLES, endpoint=False, dtype=np.float64)
_POLISH = 8


@dataclass(frozen=True)
class Minimum:
    """A local minimum of the energy: theta in radians, in (-pi/2, pi/2], and E_min there, px^2."""

    theta: float
    energy: float


def exact(energy: Energy, settings: SolverSettings = DEFAULT_SOLVER) -> Solution:
    """Return the global minimum; of equal ones, the angle nearest to 0.

    It is polished to machine precision, whatever the tolerance in the settings.
    """
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
    starts, low = _stationary_angles(energy)
    same = 1e-12 * (energy.rest + energy.slope_energy)
    found = _settled(energy, starts)
    if min((minimum.energy for minimum in found), default=math.inf) > low.energy + same:  # no root led to it
        found += _settled(energy, [low.theta]) or [low]
    lowest = min(found, key=lambda m: m.energy)
    return sorted(found, key=lambda m: (m.energy if m.energy > lowest.energy + same else -1.0, abs(m.theta)))


def _line_minimum(energy: Energy) -> Minimum:
    """Solve the quadratic in tan(theta) of a2 = 0 [TITS]: its minimum is the angle of the best plane."""
    _, c1, c2 = energy.plane
    theta = principal(math.atan2(-c1, c2))
    return Minimum(theta, float(energy.at(theta).value))


def _stationary_angles(energy: Energy) -> tuple[list[float], Minimum]:
    """Return angles near every local minimum, radians, and the lowest of a few angles."""
    angles, stretch = _unwhitened(energy, _ANGLES)
    terms, numerator = energy.at_with_numerator(angles)
    lowest = int(np.argmin(terms.value))
    low = Minimum(float(angles[lowest]), float(terms.value[lowest]))
    spectrum = np.fft.fft(numerator * stretch**10)
    # z^5 times the series is a polynomial in z; numpy wants the highest power first
    coefficients = np.concatenate([spectrum[_DEGREE::-1], spectrum[: -_DEGREE - 1 : -1]])
    largest = np.abs(coefficients).max()
    roots = np.roots(np.where(np.abs(coefficients) > 1e-15 * largest, coefficients, 0))
    # Rounding moves a double root off the circle by its square root. Other roots that are near do no harm:
    # only minima that Newton's method confirms are compared.
    near = roots[np.abs(np.log(np.maximum(np.abs(roots), 1e-300))) < 0.1]
    return _unwhitened(energy, np.angle(near) / 2)[0].tolist(), low


def _unwhitened(energy: Energy, angles: Floats) -> tuple[Floats, Floats]:
    """Return the theta of angles in the frame where the pixels spread alike in all directions.

    There the polynomial is well conditioned even if all pixels lie in a narrow strip. The second result is
    the length of the unit vector along y, back in the map's frame: E' D^2 grows with its 10th power.
    """
    xx, xy, yy = energy.forms[:3, 0]
    root = math.sqrt(xx * yy - xy * xy)
    size = math.sqrt(xx + yy + 2 * root)  # (C + root I) / size is the square root of C = [[xx, xy], [xy, yy]]
    a, b, c = (yy + root) / size, -xy / size, (xx + root) / size  # its inverse, up to a factor
    u, v = -np.sin(angles), np.cos(angles)
    u, v = a * u + b * v, b * u + c * v
    length = np.hypot(u, v) / math.sqrt(a * c - b * b)
    return np.arctan2(-u, v), length


def _settled(energy: Energy, starts: list[float]) -> list[Minimum]:
    """Return the minima near some angles."""
    found: list[Minimum] = []
    for start in starts:
        minimum, step = _polished(energy, start)
        if step < 1e-6 and all(angle_between(minimum.theta, other.theta) > 1e-7 for other in found):
            found.append(minimum)
    return found


def _polished(energy: Energy, theta: float) -> tuple[Minimum, float]:
    """Take Newton steps on the gradient while the energy does not rise; return abs(the next step) too."""
    noise = 1e-14 * (energy.rest + energy.slope_energy)
    now, step = energy.at(theta), math.inf
    for _ in range(_POLISH):
        if not now.curvature > 0:
            step = math.inf
            break
        step = -now.gradient / now.curvature
        then = energy.at(theta + step)
        # where energies differ by rounding alone, the gradient still decides
        if then.value > now.value + noise or not abs(then.gradient) < abs(now.gradient):
            break
        theta, now = theta + step, then
    return Minimum(principal(theta), now.value), abs(step)
