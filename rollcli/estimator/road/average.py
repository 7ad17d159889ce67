"""Disparities of sampled pixels, each averaged with pixels around it that were not sampled.

Most of what a matcher gets wrong differs from pixel to pixel and from row to row, among other things because
it prefers whole pixels. A mean of five has less of it, at a few operations for each pixel of the fit.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.lattice import Spacing
from rollcli.estimator.road.neighbours import Singles, count_true
from rollcli.estimator.road.subsample import Sample

# in fifths of the sample's spacing: with the pixel itself, each row and column of its 5 by 5 cell has one
_AROUND = ((2, 1), (-2, -1), (1, -2), (-1, 2))


def averaged(sample: Sample, plane: NDArray[np.float64], near: NDArray[np.intp]) -> Singles:
    """Return the disparities of some of a sample's pixels, each the mean of those around it that agree.

    Parameters
    ----------
    sample : Sample
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y, whose slopes are taken from the differences.
    near : ndarray of int, shape (N,)
        Which pixels of the sample.

    Returns
    -------
    ndarray of float32, shape (N,)
        Pixels around agree that are within the tolerance, or within a step of a map of whole pixels; others
        belong to another surface, or are wrong.
    """
    d = sample.d[near]
    moves = _moves(sample.spacing, sample.reach)
    if not len(moves):
        return d
    there = sample.places[near] + moves @ np.array([[sample.disparity.shape[1]], [1]])
    expected = (moves @ (plane[:0:-1, None] / sample.grid.scale)).astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        off = sample.disparity.reshape(-1).take(there).astype(np.float32, copy=False)
        agrees = off > 0
        off -= d
        off -= expected
    if sample.usable is not None:
        agrees &= sample.usable.reshape(-1).take(there)
    agrees &= np.abs(off) <= np.maximum(sample.tolerance[near], np.float32(sample.quantum))
    np.copyto(off, 0, where=~agrees)
    mean: Singles = off.sum(0)
    mean /= 1 + count_true(agrees)
    mean += d
    return mean


@lru_cache(maxsize=8)
def _moves(spacing: Spacing, reach: int) -> NDArray[np.intp]:
    """Return how far down and right of a pixel others are averaged with it, px (M, 2); nothing at 1 by 1."""
    moves = np.rint(np.array(_AROUND) * spacing / 5).clip(-reach, reach).astype(np.intp)
    return moves[moves.any(axis=1)]
