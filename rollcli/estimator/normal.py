"""Normal equations of a few parameters in different units, some of which may be missing."""

import numpy as np

from rollcli.estimator.moments import Floats

_RIDGE = 1e-10  # of each diagonal element: a parameter that the pixels do not determine stays finite


def solve_normal(rows: list[list[float]]) -> list[float]:
    """Solve normal equations by elimination, in plain Python: so few numbers take NumPy twice as long.

    Parameters
    ----------
    rows : list of list of float
        N rows of N + 1: a normal matrix, and the right-hand side. Where a parameter is missing, its row and
        column are 0.

    Returns
    -------
    list of float
        0 for what is missing.
    """
    size = len(rows)
    upper = [row[k:] for k, row in enumerate(rows)]  # a normal matrix is symmetric
    for row in upper:
        row[0] *= 1 + _RIDGE
    for k, top in enumerate(upper):
        if top[0] > 0:
            for below in range(1, size - k):
                factor, row = top[below] / top[0], upper[k + below]
                for j in range(len(row)):
                    row[j] -= factor * top[below + j]
    found = [0.0] * size
    for k in range(size - 1, -1, -1):
        row = upper[k]
        if row[0] > 0:
            rest = row[-1]
            for j in range(k + 1, size):
                rest -= row[j - k] * found[j]
            found[k] = rest / row[0]
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
    added: Floats = np.diag(np.where(diagonal > 0, _RIDGE * diagonal, 1.0))
    return normal + added
