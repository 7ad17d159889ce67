"""What every solver returns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """How a solver ended; the value is what a user reads."""

    CONVERGED = "converged"
    STEP_LIMIT = "no convergence within the iterations allowed"
    STUCK = "no step lowers the energy, yet its gradient is not zero"
    DRIFTED = "the areas that agree do not look like a road"

    @property
    def converged(self) -> bool:
        """Whether the angle is a solution."""
        return self is Outcome.CONVERGED


@dataclass(frozen=True)
class Solution:
    """A roll angle, and how it was reached.

    Attributes
    ----------
    theta : float
        Radians, in (-pi/2, pi/2].
    iterations : int
        As the method's paper counts them; 0 for closed forms.
    outcome : Outcome
    """

    theta: float
    iterations: int
    outcome: Outcome = Outcome.CONVERGED


def principal(theta: float) -> float:
    """Return the angle in (-pi/2, pi/2] that describes the same rotation of rows as `theta`."""
    wrapped = math.remainder(theta, math.pi)
    return wrapped if wrapped > -math.pi / 2 + 1e-12 else math.pi / 2


def apart(theta: float, other: float) -> float:
    """Return the angle between two rolls, at most pi / 2."""
    return abs(math.remainder(theta - other, math.pi))
