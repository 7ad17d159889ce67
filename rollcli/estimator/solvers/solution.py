"""What every solver is given and returns."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from rollcli.estimator.energy import Energy
from rollcli.estimator.request import Request


class SolverStatus(Enum):
    """How a solver ended; the value is what a user reads."""

    CONVERGED = "converged"
    STEP_LIMIT = "no convergence within the iterations allowed"
    STUCK = "no step lowers the energy, yet its gradient is not zero"
    DRIFTED = "the areas that agree do not look like a road"

    @property
    def converged(self) -> bool:
        """Whether the angle is a solution."""
        return self is SolverStatus.CONVERGED


@dataclass(frozen=True)
class Solution:
    """A roll angle, and how it was reached.

    Attributes
    ----------
    theta : float
        Radians, in (-pi/2, pi/2].
    iterations : int
        As the method's paper counts them; 0 for closed forms.
    status : SolverStatus
    """

    theta: float
    iterations: int
    status: SolverStatus = SolverStatus.CONVERGED


Solver = Callable[[Energy, Request], Solution]


def principal(theta: float) -> float:
    """Return the angle in (-pi/2, pi/2] that describes the same rotation of rows as `theta`."""
    wrapped = math.remainder(theta, math.pi)
    return wrapped if wrapped > -math.pi / 2 + 1e-12 else math.pi / 2


def angle_between(theta: float, other: float) -> float:
    """Return the angle between two rolls, at most pi / 2."""
    return abs(math.remainder(theta - other, math.pi))
