"""A series in a few hundred cells, and generalised least squares of steps and a line in it.

Frames of a drive are correlated, so that a mean level says little, but how the angle goes on from one frame
to the next says much: a step of the mount is seen in both. Generalised least squares weighs them as they
deserve [Aitken 1936]; its scan for a step at every place costs one pass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.rig.sequence.noise import Noise
from rollcli.rig.sequence.weights import Floats

_LEAST_WHITE = 1e-3  # of the slow variance: what keeps the covariance well conditioned


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Weighted means of stretches of frames and the inverse of their covariance.

    Attributes
    ----------
    first : ndarray of int, shape (C,)
        The first frame of each cell.
    values : ndarray of float, shape (C,)
    precision : ndarray of float, shape (C, C)
    log_determinant : float
        Of the covariance.
    decay : float
        Correlation of the slow part from one cell to the next.
    """

    first: NDArray[np.intp]
    values: Floats
    precision: Floats
    log_determinant: float
    decay: float

    def design(self, starts: Sequence[int], drift: bool) -> Floats:
        """Columns: the mean, a line if asked for, and a step at each of `starts` (cells)."""
        count = len(self.values)
        columns = [np.ones(count)]
        if drift:
            columns.append((self.first - self.first.mean()) / max(float(np.ptp(self.first)), 1.0))
        columns += [(np.arange(count) >= start).astype(float) for start in starts]
        return np.stack(columns, axis=1)

    def solve(self, design: Floats) -> tuple[Floats, Floats, float]:
        """Return coefficients, their covariance, and the weighted sum of squares that is left."""
        weighted = self.precision @ design
        covariance: Floats = np.asarray(np.linalg.pinv(design.T @ weighted, hermitian=True), dtype=float)
        beta = covariance @ (weighted.T @ self.values)
        left = self.values - design @ beta
        return beta, covariance, float(left @ self.precision @ left)

    def gains(self, design: Floats) -> Floats:
        """Return by how much a further step at each cell would lower the weighted sum of squares."""
        weighted = self.precision @ design
        inverse = np.linalg.pinv(design.T @ weighted, hermitian=True)
        left = self.values - design @ (inverse @ (weighted.T @ self.values))
        score = _tail(self.precision @ left)
        crossed = _tail(weighted)
        own = np.diagonal(_tail(_tail(self.precision).T))
        information = own - np.einsum("ij,jk,ik->i", crossed, inverse, crossed)
        gains = score**2 / np.maximum(information, 1e-12 * own.max())
        return np.where(information > 1e-9 * own.max(), gains, 0.0)

    def fading(self, start: int) -> Floats:
        """Return a kick at a cell that fades as the slow noise does."""
        distance = np.arange(len(self.values)) - start
        return np.where(distance >= 0, self.decay ** np.maximum(distance, 0), 0.0)


def _tail(array: Floats) -> Floats:
    """Return sums from each row to the last."""
    return np.asarray(np.cumsum(array[::-1], axis=0)[::-1])


def make_cells(
    values: Floats, weights: Floats, white: Floats, slow_variance: float, phi: float, width: int
) -> Cells:
    """Average a series in cells of `width` frames.

    Parameters
    ----------
    values, weights : ndarray of float, shape (N,)
        Weight 0 where a frame is missing.
    white : ndarray of float, shape (N,)
        Variance of each frame that it shares with no other.
    slow_variance, phi : float
        Of the AR(1) part.
    width : int
        Frames.

    Returns
    -------
    Cells
        Those that hold a frame.
    """
    starts = np.arange(0, len(values), width)
    total = np.add.reduceat(weights, starts)
    there = total > 0
    sums = np.add.reduceat(weights * values, starts)[there]
    own = np.add.reduceat(weights**2 * white, starts)[there] / total[there] ** 2
    first = starts[there]
    distance = np.abs(first[:, None] - first[None, :]) / width
    covariance = slow_variance * _mean_correlation(distance, phi, width)
    covariance[np.diag_indices(len(first))] += np.maximum(own, _LEAST_WHITE * slow_variance + 1e-18)
    determinant = 2 * float(np.log(np.diagonal(np.linalg.cholesky(covariance))).sum())
    precision = np.asarray(np.linalg.inv(covariance), dtype=float)
    return Cells(first, sums / total[there], precision, determinant, phi**width)


def _mean_correlation(distance: Floats, phi: float, width: int) -> Floats:
    """Correlation of AR(1) averaged over two cells, `distance` cells apart."""
    if phi <= 0:
        return np.where(distance == 0, 1.0 / width, 0.0)
    within = Noise(1.0, phi, 1.0, 1.0).variance_of_mean(width)
    ends = ((1 - phi**width) / (width * (1 - phi))) ** 2 * phi ** (1 - width) if width > 1 else 1.0
    return np.where(distance == 0, within, ends * phi ** (width * np.maximum(distance, 1)))
