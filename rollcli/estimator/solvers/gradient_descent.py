"""Gradient descent with the paper's adaptive learning rate [GD eq. 11, 14], guarded.

[GD]: Fan, Wang, Liu, Pitas, "A Robust Roll Angle Estimation Algorithm Based on Gradient Descent",
arXiv:1906.01894.
"""

import math

from rollcli.estimator.energy import Energy
from rollcli.estimator.request import DEFAULT_REQUEST, LAMBDA0, Request
from rollcli.estimator.solvers.solution import Solution, SolverStatus, principal

_MAX_ITERATIONS = 100
_MAX_STEP = math.radians(20)


def gradient_descent(energy: Energy, request: Request = DEFAULT_REQUEST) -> Solution:
    """Descend from theta = 0 until a step is shorter than the tolerance.

    Parameters
    ----------
    energy : Energy
        E_min as a function of theta.
    request : Request
        A first learning rate "auto" is 1 / curvature at the start (Newton's step) where the energy curves
        upward there, else the default.

    Returns
    -------
    Solution
        `iterations` counts the angles at which the energy was evaluated after the start.

    Notes
    -----
    Eq. 14 is the secant rule on the gradient: it is superlinear near a minimum, and runs to a maximum where
    the energy curves downward. So E must fall (else the step is halved), lambda stays positive (else it is
    doubled), and a step is at most 20 degrees.
    """
    # half the mean squared residual of d / max(d) is the unit in which lambda(0) = 26 holds
    unit, tolerance = 1 / (2 * energy.weight * energy.peak**2), request.tolerance
    theta, now = 0.0, energy.at(0.0)
    rate = LAMBDA0 if request.lambda0 == "auto" else request.lambda0
    if request.lambda0 == "auto" and now.curvature > 0:
        rate = 1 / (unit * now.curvature)
    noise = 1e-14 * (energy.rest + energy.slope_energy)
    for iteration in range(1, _MAX_ITERATIONS + 1):
        step = -rate * unit * now.gradient
        bounded = max(-_MAX_STEP, min(_MAX_STEP, step))
        if bounded != step:
            step, rate = bounded, rate * bounded / step
        then = energy.at(theta + step)
        if then.value > now.value + noise:
            if abs(step) < tolerance * 1e-3:
                return Solution(principal(theta), iteration, SolverStatus.STUCK)
            rate /= 2
            continue
        change = unit * (now.gradient - then.gradient)
        theta += step
        if abs(step) < tolerance:
            return Solution(principal(theta), iteration)
        if change != 0:  # equal gradients keep the rate
            secant = rate * unit * now.gradient / change
            rate = secant if secant > 0 else 2 * rate
        now = then
    return Solution(principal(theta), _MAX_ITERATIONS, SolverStatus.STEP_LIMIT)
