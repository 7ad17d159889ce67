"""Least squares of a few parameters in different units, some of which may be missing."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_RIDGE = 1e-10  # of each diagonal element: a parameter that the pixels do not determine stays finite
_LEAST = 1e-200  # of a diagonal element, by which a row of zeros can be divided


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
    ridge = np.eye(normal.shape[-1])
    return np.asarray(
        np.linalg.solve(normal * (1 + _RIDGE * ridge) + _LEAST * ridge, pull[..., None])[..., 0]
    )
