"""The global minimum of the energy, without a start value, and whether a solution is that.

E_min = d'd - N/D, where N and D = det(Y'Y) are homogeneous of degree 6 in cos(theta) and sin(theta). Its
derivative is (N D' - N' D) / D^2, and this numerator is a trigonometric polynomial of degree 5 in 2 theta:
a polynomial of degree 10 in tan(theta), but well conditioned at every angle, 90 degrees included. Samples of
N and D give it without error, and its zeros, the roots of an ordinary polynomial, are all the angles at which
E_min can have a minimum.

[TITS]: Fan, Liu, "Road Damage Detection Based on Unsupervised Disparity Map Segmentation", IEEE T-ITS (2019).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Floats
from rollcli.estimator.request import DEFAULT_REQUEST, Request
from rollcli.estimator.solvers.solution import Solution, angle_between, principal

DEGREE = 5
SAMPLES = 16  # more than 2 DEGREE + 1
_SAME_BASIN = math.radians(0.01)  # a solver that converged ends far nearer to its minimum
# of the polynomial: twice those of a frame
_ANGLES: Floats = np.linspace(0, 2 * np.pi, SAMPLES, endpoint=False, dtype=np.float64)
_CIRCLE = np.stack([np.cos(_ANGLES / 2), np.sin(_ANGLES / 2)])
_ORDERS = np.fft.fftfreq(SAMPLES, 1 / SAMPLES) * (np.abs(np.fft.fftfreq(SAMPLES, 1 / SAMPLES)) <= DEGREE)
# takes samples of a polynomial of degree `DEGREE` at most to those of its derivative
_TO_DERIVATIVE = np.fft.ifft(1j * _ORDERS[:, None] * np.fft.fft(np.eye(SAMPLES), axis=0), axis=0).real.copy()
_POLISH = 8


def zeros(samples: Floats) -> list[float]:
    """Return every angle near which the polynomial is zero, radians, and perhaps some more.

    Parameters
    ----------
    samples : ndarray, shape (SAMPLES,)
        Values of a polynomial of degree `DEGREE` at angles that divide the circle evenly, from 0 on.
    """
    spectrum = np.fft.fft(samples)
    # z^5 times the series is a polynomial in z; numpy wants the highest power first
    coefficients = np.concatenate([spectrum[DEGREE::-1], spectrum[: -DEGREE - 1 : -1]])
    largest = np.abs(coefficients).max()
    roots = np.roots(np.where(np.abs(coefficients) > 1e-15 * largest, coefficients, 0))
    # rounding moves a double root off the circle by its square root
    near = roots[np.abs(np.log(np.maximum(np.abs(roots), 1e-300))) < 0.1]
    angles: list[float] = np.angle(near).tolist()
    return angles


@dataclass(frozen=True)
class Minimum:
    """A local minimum of the energy: theta in radians, in (-pi/2, pi/2], and E_min there, px^2."""

    theta: float
    energy: float


def exact(energy: Energy, request: Request = DEFAULT_REQUEST) -> Solution:
    """Return the global minimum; of equal ones, the angle nearest to 0.

    It is polished to machine precision, whatever the tolerance in the request.
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
    if not energy.parabolic:  # a quadratic in tan(theta) [TITS]; its minimum is the angle of the best plane
        _, c1, c2 = energy.plane
        theta = principal(math.atan2(-c1, c2))
        return [Minimum(theta, energy.at(theta).value)]
    frame = _even_frame(energy)
    over, under = energy.as_quotient(*frame.dot(_CIRCLE))
    starts = zeros(_TO_DERIVATIVE.dot(over) * under - over * _TO_DERIVATIVE.dot(under))
    found, same = _settled(energy, _thetas(frame, starts)), 1e-12 * (energy.rest + energy.slope_energy)
    if 2 * len(found) != len(starts):  # else there is a maximum between two minima
        coarse = [Minimum(theta, energy.at(theta).value) for theta in _thetas(frame, _ANGLES.tolist())]
        low = min(coarse, key=lambda m: m.energy)
        if min((m.energy for m in found), default=math.inf) > low.energy + same:  # no root led to it
            found += _settled(energy, [low.theta]) or [low]
    lowest = min(found, key=lambda m: m.energy)
    return sorted(found, key=lambda m: (m.energy if m.energy > lowest.energy + same else -1.0, abs(m.theta)))


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


def _settled(energy: Energy, starts: list[float]) -> list[Minimum]:
    """Return the minima near some angles."""
    found: list[Minimum] = []
    for start in starts:
        minimum, step = _polished_minimum(energy, start)
        if step < 1e-6 and all(angle_between(minimum.theta, other.theta) > 1e-7 for other in found):
            found.append(minimum)
    return found


def _polished_minimum(energy: Energy, theta: float) -> tuple[Minimum, float]:
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


@dataclass(frozen=True)
class CertifiedSolution:
    """A solution beside every minimum of the energy.

    Attributes
    ----------
    solution : Solution
    energy : float
        E_min at the solution, px^2.
    minima : list of Minimum
        Of the energy, the lowest first.
    is_global : bool
        Whether no minimum is lower than the one that the solution is at, to ten times the solver's tolerance.
    off : float
        How far the solution is from the nearest minimum, radians.
    replaced : float or None
        The angle that the solver found, radians, where another minimum was meant.
    """

    solution: Solution
    energy: float
    minima: list[Minimum]
    is_global: bool
    off: float
    replaced: float | None = None


def certify(
    energy: Energy, solution: Solution, road_theta: float | None = None, tolerance: float = 0.0
) -> CertifiedSolution:
    """Compare a solution with all minima of the energy; one that is not the road's minimum is replaced by it.

    A thin strip of road can have a deeper minimum elsewhere.

    Parameters
    ----------
    energy : Energy
    solution : Solution
    road_theta : float or None
        The road's roll as found otherwise, radians; None: the solution stays.
    tolerance : float
        Of the solver, radians.
    """
    found, replaced = minima(energy), None
    if road_theta is not None:
        meant = min(found, key=lambda minimum: angle_between(minimum.theta, road_theta)).theta
        if angle_between(solution.theta, meant) > max(10 * tolerance, _SAME_BASIN):
            replaced = solution.theta
            solution = replace(solution, theta=meant)
    value = energy.at(solution.theta).value
    slack = 1e-9 * (energy.rest + energy.slope_energy)
    nearest = min(found, key=lambda minimum: angle_between(minimum.theta, solution.theta))
    off = angle_between(nearest.theta, solution.theta)
    is_global = value <= found[0].energy + slack or (nearest is found[0] and off <= 10 * tolerance)
    return CertifiedSolution(solution, value, found, is_global, off, replaced)
