"""The roll angle of the best plane of some pixels [Plane].

[Plane]: Ozgunalp, Fan, Ai, Dahnoun, "Multiple lane detection algorithm based on novel dense vanishing point
estimation", IEEE T-ITS 18(3) (2017). The plane d = c0 + c1 u + c2 v gives theta = atan(-c1 / c2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.energy import Energy
from rollcli.estimator.methods import AreaSettings
from rollcli.estimator.moments import map_moments
from rollcli.estimator.solvers.exact import exact
from rollcli.estimator.solvers.solution import Solution, SolverStatus
from rollcli.estimator.validity import require_pixels


@dataclass(frozen=True)
class AreaPixels:
    """The pixels that a method chose.

    Attributes
    ----------
    used : ndarray of bool, shape (H, W)
        All of them have a disparity.
    iterations : int
        How often the method chose anew.
    status : SolverStatus
        Whether its choice settled.
    """

    used: NDArray[np.bool_]
    iterations: int = 0
    status: SolverStatus = SolverStatus.CONVERGED


# from a map (H, W), px, and which of its pixels are valid and may be used, (H, W) of bool
AreaMethod = Callable[[NDArray[Any], NDArray[np.bool_], AreaSettings], AreaPixels]


class PlaneFit(NamedTuple):
    """The energy of the line model over some pixels, and its minimum."""

    energy: Energy
    solution: Solution


def fit_plane(disparity: NDArray[Any], pixels: AreaPixels) -> PlaneFit:
    """Fit a plane to the chosen pixels of a map (H, W) by least squares.

    Raises
    ------
    EstimationError
        When the pixels do not determine a plane.
    """
    require_pixels(pixels.used)
    peak = float(disparity.max(where=pixels.used, initial=0))
    energy = Energy.of(map_moments(disparity, pixels.used), peak, parabolic=False)
    return PlaneFit(energy, Solution(exact(energy).theta, pixels.iterations, pixels.status))
