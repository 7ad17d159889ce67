"""How a map's disparity changes from a pixel to those around it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]

NO_SLOPE = np.float32(np.inf)  # agrees with no road
_TOWARDS = np.array([[-1], [1], [-1], [1]], np.float32)  # left, right, up and down along x or y


def to_sides(reach: int, width: int) -> NDArray[np.intp]:
    """Return how far the neighbours of a pixel are, counted row by row: left, right, up and down, (4, 1)."""
    down = reach * width
    return np.array([[-reach], [reach], [-down], [down]])


def steps_to(there: NDArray[np.intp], disparity: NDArray[Any], d: Singles) -> Singles:
    """Return how the disparity changes from some pixels to others.

    Parameters
    ----------
    there : ndarray of int, shape (M, N)
        Where M others of each are in the map, counted row by row.
    disparity : ndarray, shape (H, W)
        The map; contiguous, or this takes time.
    d : ndarray of float32, shape (N,)
        The disparities of the pixels.

    Returns
    -------
    ndarray of float32, shape (M, N)
        px; `NO_SLOPE` where the other is no data.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps: Singles = disparity.reshape(-1).take(there, mode="clip").astype(np.float32, copy=False)
        unknown = ~(steps > 0)
    steps -= d
    np.copyto(steps, NO_SLOPE, where=unknown)
    return steps


def to_slopes(steps: Singles, per_unit: float) -> Singles:
    """Return the one-sided derivatives (4, N) along x and y, from steps over 1 / per_unit units."""
    slopes: Singles = steps * (_TOWARDS * np.float32(per_unit))
    return slopes


def rising(slopes: Singles) -> NDArray[np.bool_]:
    """Return where the disparity grows downward, above the pixel or below it."""
    grows = slopes[2:] > 0
    grows &= slopes[2:] < NO_SLOPE
    either: NDArray[np.bool_] = grows[0] | grows[1]
    return either


def count_true(agreeing: NDArray[np.bool_]) -> Singles:
    """Return how many of a pixel's neighbours agree, from bool (neighbours, N)."""
    counts: NDArray[np.uint8] = agreeing.view(np.uint8).sum(0, dtype=np.uint8)  # a sum of bool takes longer
    return counts.astype(np.float32)


def smallest_step(jumps: Singles, part: int) -> float:
    """Return the 1/part quantile of the steps to the right and down, px: 0 if there are none."""
    some: Singles = jumps[1::2, ::2].ravel()
    some = some.compress((some > 0) & (some < NO_SLOPE))
    place = len(some) // part
    return float(np.partition(some, place)[place]) if len(some) else 0.0
