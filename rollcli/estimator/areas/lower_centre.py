"""The roll angle of the best plane in one chosen area [Plane].

[Plane]: Ozgunalp, Fan, Ai, Dahnoun, "Multiple lane detection algorithm based on novel dense vanishing point
estimation", IEEE T-ITS 18(3) (2017). The plane d = c0 + c1 u + c2 v gives theta = atan(-c1 / c2).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import map_moments
from rollcli.estimator.solvers.exact import exact
from rollcli.estimator.solvers.solution import Outcome, Solution
from rollcli.estimator.validity import require_pixels

_ROWS = (0.6, 0.9)  # below the horizon, above a bonnet
_COLUMNS = (0.35, 0.65)


@dataclass(frozen=True)
class AreaSolution(Solution):
    """A roll angle that rests on a part of the map.

    Attributes
    ----------
    energy : Energy
        Of the line model over the pixels used; `theta` is its minimum.
    used : ndarray of bool, shape (H, W)
        The pixels used.
    """

    energy: Energy = field(kw_only=True)
    used: NDArray[np.bool_] = field(kw_only=True, repr=False)


def lower_centre(height: int, width: int) -> tuple[slice, slice]:
    """Return the rows and columns of the default area, where a road most often is."""
    rows, columns = (
        slice(round(low * n), round(high * n)) for (low, high), n in ((_ROWS, height), (_COLUMNS, width))
    )
    return rows, columns


def plane_fit(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None = None,
    area: tuple[slice, slice] | None = None,
) -> AreaSolution:
    """Fit a plane to one area of the map by least squares.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px; values <= 0, NaN and inf are no data.
    weights : ndarray, shape (H, W), optional
        Finite and not negative (or bool); all ones by default.
    area : tuple of slice, optional
        The rows and columns of the area. By default 60 to 90 % of the height and 35 to 65 % of the width;
        give the whole map where the weights are the chosen area.

    Returns
    -------
    AreaSolution
        With 0 iterations.

    Raises
    ------
    EstimationError
        When the pixels of the area do not determine a plane.
    """
    height, width = disparity.shape
    rows, columns = area or lower_centre(height, width)
    used = np.zeros((height, width), np.bool_)
    inside = disparity[rows, columns]
    used[rows, columns] = (inside > 0) & (inside < np.inf)
    if weights is not None:
        used &= weights > 0
    return plane_of(disparity, weights, used)


def plane_of(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None,
    used: NDArray[np.bool_],
    iterations: int = 0,
    outcome: Outcome = Outcome.CONVERGED,
) -> AreaSolution:
    """Fit a plane to the pixels `used` (H, W); the rest says how they were chosen."""
    require_pixels(used)
    peak = float(disparity.max(where=used, initial=0))
    energy = Energy.of(
        map_moments(disparity, used if weights is None else used * weights), peak, parabolic=False
    )
    return AreaSolution(exact(energy).theta, iterations, outcome, energy=energy, used=used)
