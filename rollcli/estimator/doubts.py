"""Why an angle may be doubtful, in words."""

from __future__ import annotations

import math

from rollcli.estimator.energy import Energy
from rollcli.estimator.road.find import RIVAL_ANGLE, Road
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.solvers.exact import Minimum
from rollcli.estimator.solvers.solution import Solution, apart

WIDEST_INTERVAL = math.radians(0.25)
LEAST_SCORE = 0.18
RIVAL_SHARE = 0.75
MOST_NOISE = 0.25
LONGEST_MOVE = math.radians(1)
NEAR_MINIMUM = 1.1
BOUND_SHARE = 0.99


def doubts_of_solution(
    solution: Solution, energy: Energy, basins: list[Minimum], *, is_global: bool
) -> list[str]:
    """Doubts that the energy raises; `basins` are its minima, the lowest first."""
    doubts = []
    if not solution.outcome.converged:
        doubts.append(solution.outcome.value)
    lowest = basins[0]
    if not is_global:
        doubts.append(f"a lower minimum of the energy lies at {math.degrees(lowest.theta):.4f} degrees")
    for other in basins[1:]:
        near = other.energy < NEAR_MINIMUM * lowest.energy
        if is_global and near and apart(other.theta, solution.theta) > RIVAL_ANGLE:
            doubts.append(f"the energy is nearly as low at {math.degrees(other.theta):.2f} degrees")
    _, c1, c2 = energy.plane
    if c2 * math.cos(solution.theta) - c1 * math.sin(solution.theta) < 0:
        doubts.append("the disparity grows upward, as it does in a depth map")
    return doubts


def doubts_of_road(road: Road, surface: Surface, max_roll: float) -> list[str]:
    """Doubts about which surface was found."""
    doubts = []
    if road.score < LEAST_SCORE:
        doubts.append("little of what lies ahead looks like a road")
    elif road.rival > RIVAL_SHARE * road.score:
        doubts.append("another plane, with another roll, explains the map nearly as well")
    if road.noise > MOST_NOISE:
        doubts.append(f"noise fills {road.noise:.0%} of what lies ahead")
    if surface.moved > LONGEST_MOVE:
        doubts.append(f"the road's pixels moved the roll by {math.degrees(surface.moved):.1f} degrees")
    if abs(surface.theta) > BOUND_SHARE * max_roll:
        doubts.append("the roll is at its bound, --max-roll")
    return doubts


def doubts_of_interval(ci95: float | None) -> list[str]:
    """Doubts about the precision."""
    if ci95 is None or ci95 <= WIDEST_INTERVAL:
        return []
    return [f"the interval is wide: +-{math.degrees(ci95):.2f} degrees"]
