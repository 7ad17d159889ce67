"""Least squares of a few parameters in different units, some of which may be missing."""

from functools import cache

import numpy as np

from rollcli.estimator.moments import Floats

_RIDGE = 1e-10  # of each diagonal element: a parameter that the pixels do not determine stays finite


def solve_normal(normal: Floats, pull: Floats) -> Floats:
    """Solve normal equations.

    Parameters
    ----------
    normal : ndarray, shape (..., N, N)
        Where a parameter is missing, its row and column are 0.
    pull : ndarray, shape (..., N)
        The right-hand sides.

    Returns
    -------
    ndarray, shape (..., N)
        0 for what is missing.
    """
    added = np.einsum("...ii->...i", normal) * _RIDGE
    added[added <= 0] = 1.0
    return np.asarray(
        np.linalg.solve(normal + added[..., None] * unit(len(added.T)), pull[..., None])[..., 0]
    )


def regular(normal: Floats, like: Floats) -> Floats:
    """Return normal matrices that can be inverted though parameters are missing, or not determined.

    Parameters
    ----------
    normal : ndarray, shape (..., N, N)
        Where a parameter is missing, its row and column are 0, and the solution is.
    like : ndarray, shape (N, N)
        A normal matrix of such parameters, for their units.

    Returns
    -------
    ndarray, shape (..., N, N)
    """
    diagonal = like.diagonal()
    added: Floats = np.where(diagonal > 0, _RIDGE * diagonal, 1.0) * unit(len(diagonal))
    return normal + added


@cache
def unit(size: int) -> Floats:
    """Return the unit matrix of this size."""
    return np.eye(size)
