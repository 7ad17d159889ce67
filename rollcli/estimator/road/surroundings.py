"""What lies around sampled pixels: the mean of a few disparities, and whether the map rises as a road does.

Most of what a matcher gets wrong differs from pixel to pixel and from row to row, among other things because
it prefers whole pixels. A mean of five has less of it, at a few operations for each pixel of the fit. And
where a wall crosses the road's plane it is as near as the road, but it does not rise as the road does.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.lattice import Spacing
from rollcli.estimator.road.neighbours import Singles, count_true, steps_to
from rollcli.estimator.road.scoring import slope_agreement
from rollcli.estimator.road.subsample import Sample

# two pairs of opposite sides, in rows and columns of their own
_AROUND = np.array(((2, 1), (-2, -1), (1, -2), (-1, 2)))


class Surroundings(NamedTuple):
    """What lies around some pixels; arrays of shape (N,).

    Attributes
    ----------
    mean : ndarray of float32
        The mean disparity of each and of those around it that agree, px.
    agreement : ndarray of float32
        0.2 to 1: how well the map's slopes around it agree with the plane's.
    """

    mean: Singles
    agreement: Singles


def look_around(sample: Sample, plane: NDArray[np.float64], near: NDArray[np.intp]) -> Surroundings:
    """Look at the pixels around some of a sample's.

    Parameters
    ----------
    sample : Sample
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y.
    near : ndarray of int, shape (N,)
        Which pixels of the sample.

    Returns
    -------
    Surroundings
        In the mean are those that are off the plane's slope by at most the tolerance, or a step of a map of
        whole pixels; others belong to another surface, or are wrong. Slopes agree by the better one of each
        pair of opposite sides.
    """
    d, tuning = sample.d[near], sample.tuning.score
    moves, offsets, lengths = _moves(sample.spacing, sample.reach, sample.disparity.shape[1])
    there = sample.places[near] + offsets
    slope = plane[:0:-1] / sample.grid.scale
    off = steps_to(there, sample.disparity, d)
    off -= moves.dot(slope).astype(np.float32)[:, None]
    apart = np.abs(off)
    better = np.minimum(apart[::2], apart[1::2])
    steepness = tuning.slope_share**2 * float(slope.dot(slope))
    variance = steepness * lengths + sample.noise**2
    agreement = slope_agreement((-0.5 / variance).astype(np.float32).dot(np.square(better)), tuning)
    other = apart > np.maximum(sample.tolerance[near], np.float32(sample.quantum))
    if sample.usable is not None:
        other |= ~sample.usable.reshape(-1).take(there)
    np.copyto(off, 0, where=other)
    mean: Singles = off.sum(0)
    mean /= len(off) + 1 - count_true(other)
    mean += d
    return Surroundings(mean, agreement)


@lru_cache(maxsize=8)
def _moves(
    spacing: Spacing, reach: int, width: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return how far down and right of a pixel others are looked at, px (4, 2).

    They are as far away as neighbours are, or fill the spaces between sampled pixels evenly. Return these
    moves in pixels counted row by row, too, (4, 1), and the square of how far each pair is away, px^2 (2,).
    """
    unit = np.maximum(np.array(spacing) / 5, reach / 2)
    moves = np.rint(_AROUND * unit).clip(-reach, reach).astype(np.intp)
    return moves, moves @ [[width], [1]], np.square(moves[::2]).sum(1)
