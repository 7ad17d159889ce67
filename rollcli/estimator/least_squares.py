"""Normal equations of a few parameters in different units, some of which may be missing."""

from functools import cache

import numpy as np

from rollcli.estimator.moments import Floats

_RIDGE = 1e-10  # of each diagonal element: a parameter that the pixels do not determine stays finite


def solve_normal(rows: list[list[float]]) -> list[float]:
    """Solve normal equations by elimination, in plain Python: so few numbers take NumPy twice as long.

    Parameters
    ----------
    rows : list of list of float
        N rows of N + 1: a normal matrix, and the right-hand side; they are overwritten. Where a parameter is
        missing, its row and column are 0.

    Returns
    -------
    list of float
        0 for what is missing.
    """
    size = len(rows)
    for k, top in enumerate(rows):  # a normal matrix is symmetric: what is left of the diagonal is not read
        top[k] *= 1 + _RIDGE
        if top[k] > 0:
            for i in range(k + 1, size):
                factor, row = top[i] / top[k], rows[i]
                for j in range(i, size + 1):
                    row[j] -= factor * top[j]
    found = [0.0] * size
    for k in range(size - 1, -1, -1):
        row = rows[k]
        if row[k] > 0:
            rest = row[size]
            for j in range(k + 1, size):
                rest -= row[j] * found[j]
            found[k] = rest / row[k]
    return found


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
