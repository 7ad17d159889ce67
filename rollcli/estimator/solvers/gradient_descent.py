"""Gradient descent with the paper's adaptive learning rate [GD eq. 11, 14], guarded."""

from __future__ import annotations

import math
from typing import Literal

from rollcli.estimator.energy import Energy
from rollcli.estimator.solvers.solution import Outcome, Solution, principal

LAMBDA0 = 26.0
TOLERANCE = math.radians(1e-4)
_MAX_ITERATIONS = 100
_MAX_STEP = math.radians(20)


def gradient_descent(
    energy: Energy, tolerance: float = TOLERANCE, lambda0: float | Literal["auto"] = LAMBDA0
) -> Solution:
    """Descend from theta = 0 until a step is shorter than `tolerance`.

    Parameters
    ----------
    energy : Energy
        E_min as a function of theta.
    tolerance : float
        delta_theta of the paper, radians; more than 0.
    lambda0 : float or "auto"
        The first learning rate, rad^2 per unit of the normalised energy; "auto" is 1 / curvature at the
        start (Newton's step) where the energy curves upward there, else 26.

    Returns
    -------
    Solution
        `iterations` counts the angles at which the energy was evaluated after the start.

    Notes
    -----
    Eq. 14 is the secant rule on the gradient: superlinear near a minimum, and bound for a maximum where the
    energy curves downward. So E must fall (else the step is halved), lambda stays positive (else it is
    doubled), and a step is at most 20 degrees.
    """
    unit = energy.normaliser
    theta, now = 0.0, energy.at(0.0)
    rate = float(lambda0) if lambda0 != "auto" else LAMBDA0
    if lambda0 == "auto" and now.curvature > 0:
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
                return Solution(principal(theta), iteration, Outcome.STUCK)
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
    return Solution(principal(theta), _MAX_ITERATIONS, Outcome.STEP_LIMIT)
