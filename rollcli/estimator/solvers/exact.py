"""The global minimum of the energy, without a start value.

E_min = d'd - N/D, where N and D = det(Y'Y) are homogeneous of degree 6 in cos(theta) and sin(theta). Its
derivative is (N D' - N' D) / D^2, and this numerator is a trigonometric polynomial of degree 5 in 2 theta:
a polynomial of degree 10 in tan(theta), but well conditioned at every angle, 90 degrees included. Samples of
N and D give it without error, and its zeros are all the angles at which E_min can have a minimum.

[TITS]: Fan, Liu, "Road Damage Detection Based on Unsupervised Disparity Map Segmentation", IEEE T-ITS (2019).
"""

import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.energy import Energy
from rollcli.estimator.methods import DEFAULT_SOLVER, SolverSettings
from rollcli.estimator.moments import Floats
from rollcli.estimator.solvers.solution import Solution, angle_between, principal
from rollcli.estimator.solvers.trigonometric import SAMPLES, derivative, rising_zeros, zeros

# of the polynomial: twice those of a frame
_ANGLES: Floats = np.linspace(0, 2 * np.pi, SAMPLES, endpoint=False, dtype=np.float64)
_CIRCLE = np.stack([np.cos(_ANGLES / 2), np.sin(_ANGLES / 2)])
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
    frame = _even_frame(energy)
    numerator = _numerator(energy, frame)
    rising = rising_zeros(numerator)
    found = _settled(energy, _thetas(frame, rising or []))
    if not rising or len(found) < len(rising):
        found = _searched(energy, frame, numerator)
    same = 1e-12 * (energy.rest + energy.slope_energy)
    lowest = min(found, key=lambda m: m.energy)
    return sorted(found, key=lambda m: (m.energy if m.energy > lowest.energy + same else -1.0, abs(m.theta)))


def _line_minimum(energy: Energy) -> Minimum:
    """Solve the quadratic in tan(theta) of a2 = 0 [TITS]: its minimum is the angle of the best plane."""
    _, c1, c2 = energy.plane
    theta = principal(math.atan2(-c1, c2))
    return Minimum(theta, float(energy.at(theta).value))


def _numerator(energy: Energy, frame: Floats) -> Floats:
    """Return the numerator of the derivative at even angles of a frame, shape (SAMPLES,)."""
    over, under = energy.as_quotient(*(frame.dot(_CIRCLE)))
    numerator: Floats = derivative(over) * under - over * derivative(under)
    return numerator


def _even_frame(energy: Energy) -> Floats:
    """Return the matrix (2, 2) to cosine and sine from those in a frame where pixels spread alike everywhere.

    There the polynomial is well conditioned even if all pixels lie in a narrow strip.
    """
    xx, xy, yy = energy.forms[:3, 0].tolist()
    root = math.sqrt(xx * yy - xy * xy)
    # (C + root I) / size is the square root of C = [[xx, xy], [xy, yy]]; this is its inverse, up to a factor
    size = math.sqrt(root * (xx + yy + 2 * root))
    return np.array([[xx + root, xy], [xy, yy + root]]) / size


def _thetas(frame: Floats, doubled: list[float]) -> list[float]:
    """Return the thetas of some angles in a frame, given twice as large, as the polynomial has them."""
    half = [angle / 2 for angle in doubled]
    (a, b), (_, c) = frame.tolist()
    return [
        math.atan2(b * math.cos(each) + c * math.sin(each), a * math.cos(each) + b * math.sin(each))
        for each in half
    ]


def _searched(energy: Energy, frame: Floats, numerator: Floats) -> list[Minimum]:
    """Return the minima near all zeros of the derivative: a degenerate one may hide some."""
    found = _settled(energy, _thetas(frame, zeros(numerator)))
    coarse = [Minimum(theta, energy.at(theta).value) for theta in _thetas(frame, _ANGLES.tolist())]
    low = min(coarse, key=lambda m: m.energy)
    same = 1e-12 * (energy.rest + energy.slope_energy)
    if min((minimum.energy for minimum in found), default=math.inf) > low.energy + same:  # no root led to it
        found += _settled(energy, [low.theta]) or [low]
    return found


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
