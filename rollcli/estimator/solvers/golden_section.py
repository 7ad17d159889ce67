"""Golden section search for the roll angle [GSS].

[GSS]: Fan, Bocus, Dahnoun, "A novel disparity transformation algorithm for road segmentation", Inf. Process.
Lett. 140 (2018).
"""

import math
from collections.abc import Callable

from rollcli.estimator.energy import Energy
from rollcli.estimator.request import DEFAULT_REQUEST, Request
from rollcli.estimator.solvers.solution import Solution, principal

_RATIO = (math.sqrt(5) - 1) / 2
_FINEST = 1e-15  # radians; a narrower bracket holds no two different numbers


def golden_section(energy: Energy, request: Request = DEFAULT_REQUEST) -> Solution:
    """Shrink a bracket of one whole period until it is narrower than the tolerance.

    Parameters
    ----------
    energy : Energy
        E_min as a function of theta; has period pi.
    request : Request

    Returns
    -------
    Solution
        The middle of the final bracket; `iterations` counts how often the bracket shrank, as the paper does:
        16, 21, 26 and 30 for 0.1, 0.01, 0.001 and 0.0001 degrees, on any map.

    Notes
    -----
    Assumes one minimum in the bracket. Whole frames can have two: `exact` finds the lower one.
    """
    return shrink_bracket(lambda theta: energy.at(theta).value, request.tolerance)


def shrink_bracket(energy_at: Callable[[float], float], tolerance: float) -> Solution:
    """Search one period of a function of theta, radians, evaluating it once an iteration."""
    low, width = -math.pi / 2, math.pi
    left, right = low + (1 - _RATIO) * width, low + _RATIO * width
    at_left, at_right = energy_at(left), energy_at(right)
    iterations = 0
    while width >= max(tolerance, _FINEST):
        iterations += 1
        width *= _RATIO
        if at_left <= at_right:
            right, at_right = left, at_left
            left = low + (1 - _RATIO) * width
            at_left = energy_at(left)
        else:
            low = left
            left, at_left = right, at_right
            right = low + _RATIO * width
            at_right = energy_at(right)
    return Solution(principal(low + width / 2), iterations)
