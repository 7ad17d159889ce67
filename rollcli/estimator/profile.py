"""The profile across a road: what the ground beside it does.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. A kerb is
a step; a verge starts at the road's height and rises or falls from there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats

_BIN = 0.25  # camera heights
_BINS = 10  # to each side
_MIN_PIXELS = 12  # of a bin
_LEVEL = 0.006  # a bin within this height belongs to the road
_SLOPE = 0.032  # a verge rises or falls at least this much
_STEP = 1.6  # a first bin that differs by this many times the rise of the next ones is a kerb


def falls_away(
    x: Floats,
    y: Floats,
    d: Floats,
    used: NDArray[np.bool_],
    theta: float,
    alpha: tuple[float, float, float],
) -> bool:
    """Tell whether the ground falls away or rises from an edge of the road, without a kerb.

    Parameters
    ----------
    x, y, d : ndarray, shape (N,)
        Normalised coordinates and disparity of the pixels near the road, px.
    used : ndarray of bool, shape (N,)
        Pixels to look at.
    theta : float
        Roll of the road, radians.
    alpha : tuple of float
        Its parabola on the rolled, normalised y.

    Returns
    -------
    bool
    """
    level = y * math.cos(theta) - x * math.sin(theta)
    road = alpha[0] + level * (alpha[1] + level * alpha[2])
    used = used & (road > 0.1 * d)
    height = d[used] / road[used] - 1
    side = (x * math.cos(theta) + y * math.sin(theta))[used] * abs(alpha[1]) / road[used]
    medians = _medians(np.floor(side / _BIN) + _BINS, height)
    return _is_verge(medians[_BINS:]) or _is_verge(medians[_BINS - 1 :: -1])


def _medians(places: Floats, heights: Floats) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    order = np.lexsort((heights, places))
    bounds = np.searchsorted(places[order], np.arange(2 * _BINS + 1))
    counts = np.diff(bounds)
    middles = np.minimum(bounds[:-1] + counts // 2, len(order) - 1)
    medians: list[float] = np.where(counts >= _MIN_PIXELS, heights[order[middles]], math.nan).tolist()
    return medians


def _is_verge(heights: list[float]) -> bool:
    """Judge the first three bins that are off the road, from the middle outward."""
    for first in range(2, len(heights) - 2):
        beside = heights[first : first + 3]
        if not abs(beside[0]) > _LEVEL or any(map(math.isnan, beside)):
            continue
        rise = (beside[2] - beside[0]) / 2
        edge = heights[first - 1]
        jump = beside[0] - (0.0 if math.isnan(edge) else edge)
        return abs(rise) > _SLOPE * _BIN and jump * rise > 0 and abs(jump) < _STEP * abs(rise)
    return False
