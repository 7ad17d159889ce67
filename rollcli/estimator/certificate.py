"""Whether a solution is the minimum that is meant, and the global one."""

import math
from dataclasses import dataclass, replace

from rollcli.estimator.energy import Energy
from rollcli.estimator.solvers.exact import Minimum, minima
from rollcli.estimator.solvers.solution import Solution, angle_between

_SAME_BASIN = math.radians(0.01)  # a solver that converged ends far nearer to its minimum


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
        Whether no minimum is lower than the solution.
    replaced : float or None
        The angle that the solver found, radians, where another minimum was meant.
    """

    solution: Solution
    energy: float
    minima: list[Minimum]
    is_global: bool
    replaced: float | None = None


def certify(energy: Energy, solution: Solution) -> CertifiedSolution:
    """Compare a solution with all minima of the energy."""
    return _beside(minima(energy), energy, solution)


def certify_near(
    energy: Energy, solution: Solution, road_theta: float, tolerance: float
) -> CertifiedSolution:
    """Replace a solution that is not the road's minimum by the one that is, and compare it with all.

    A thin strip of road can have a deeper minimum elsewhere.

    Parameters
    ----------
    energy : Energy
    solution : Solution
    road_theta : float
        The road's roll as found otherwise, radians.
    tolerance : float
        Of the solver, radians.
    """
    found, replaced = minima(energy), None
    meant = min(found, key=lambda minimum: angle_between(minimum.theta, road_theta)).theta
    if angle_between(solution.theta, meant) > max(10 * tolerance, _SAME_BASIN):
        replaced = solution.theta
        solution = replace(solution, theta=meant)
    return _beside(found, energy, solution, replaced)


def _beside(
    found: list[Minimum], energy: Energy, solution: Solution, replaced: float | None = None
) -> CertifiedSolution:
    """Put a solution beside the minima that were found."""
    value = float(energy.at(solution.theta).value)
    slack = 1e-9 * (energy.rest + energy.slope_energy)
    return CertifiedSolution(solution, value, found, value <= found[0].energy + slack, replaced)
