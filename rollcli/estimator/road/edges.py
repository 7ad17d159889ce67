"""The profile across a road: what the ground beside it does.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. A kerb is
a step; a verge starts at the road's height and rises or falls from there, until it is lost: only pixels near
the road are looked at.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.floating[Any]]

_BIN = 0.25  # camera heights
_BINS = 10  # to each side
_MIN_PIXELS = 12  # of a bin
_LEVEL = 0.008  # a bin within this height belongs to the road
_SLOPE = 0.026  # a verge rises or falls at least this much
_STEP = 1.3  # a first bin that differs by this many times the rise of the next ones is a kerb
_LOST = 0.03  # ground that was as far off as this may leave the pixels near the road altogether
_CORE, _LANE = 2, 3  # bins from the middle: not looked at; a lane has no edge before these
_CAMBER = 0.5  # of the jump beside it: what slopes as much within the road is its camber
_KERB = 0.04  # a step this high ends the road, whatever is behind it
_GONE = 0.06  # ground that goes on to more than this is not level behind a kerb, but lost
_MARGIN = 0.5  # bins: how far before it leaves the road's level the road ends


class Edges(NamedTuple):
    """How far the road reaches to the left and to the right, in camera heights; inf where no edge is seen."""

    left: float
    right: float

    def hold(self, side: Reals) -> NDArray[np.bool_]:
        """Return which pixels, this far to the right, lie between the edges."""
        held: NDArray[np.bool_] = (side > -self.left) & (side < self.right)
        return held


NO_EDGES = Edges(math.inf, math.inf)


def sides(x: Reals, y: Reals, theta: float, alpha: tuple[float, float, float]) -> Reals:
    """Return how far to the right of the middle each pixel of a road lies, in camera heights.

    Parameters
    ----------
    x, y : ndarray
        Normalised coordinates, to be broadcast.
    theta : float
        Roll of the road, radians.
    alpha : tuple of float
        Its parabola on the rolled, normalised y.

    Returns
    -------
    ndarray
    """
    return _aside(x, y, _road(x, y, theta, alpha), theta, alpha[1])


def find_edges(
    x: Reals,
    y: Reals,
    d: Reals,
    used: NDArray[np.bool_],
    theta: float,
    alpha: tuple[float, float, float],
) -> Edges:
    """Find where the road ends: at a verge, which falls away or rises from there, or at a kerb, unless low.

    Parameters
    ----------
    x, y, d : ndarray, shape (N,)
        Normalised coordinates and disparity of the pixels near the road, px.
    used : ndarray of bool, shape (N,)
        Pixels to look at.
    theta, alpha
        As in `sides`.

    Returns
    -------
    Edges
    """
    road = _road(x, y, theta, alpha)
    used = used & (road > 0.1 * d)
    if not used.any():
        return NO_EDGES
    x, y, d, road = x[used], y[used], d[used], road[used]
    side = _aside(x, y, road, theta, alpha[1])
    medians = _medians(np.floor(side / _BIN) + _BINS, d / road - 1)
    return Edges(_edge(medians[_BINS - 1 :: -1]), _edge(medians[_BINS:]))


def _road(x: Reals, y: Reals, theta: float, alpha: tuple[float, float, float]) -> Reals:
    level = y * math.cos(theta) - x * math.sin(theta)
    return alpha[0] + level * (alpha[1] + level * alpha[2])


def _aside(x: Reals, y: Reals, road: Reals, theta: float, slope: float) -> Reals:
    """Return `sides`, where the road's disparity is known already."""
    across: Reals = (x * math.cos(theta) + y * math.sin(theta)) * abs(slope)
    with np.errstate(divide="ignore", invalid="ignore"):
        return across / np.maximum(road, 0)


def _medians(places: Reals, heights: Reals) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins: heights, far below 1, are the fractions
    keys = np.sort(places + 0.5 + np.clip(heights, -0.4, 0.4))
    bounds = np.searchsorted(keys, np.arange(2 * _BINS + 1))
    counts = np.diff(bounds)
    middles = keys[np.minimum(bounds[:-1] + counts // 2, len(keys) - 1)] - np.arange(2 * _BINS) - 0.5
    medians: list[float] = np.where(counts >= _MIN_PIXELS, middles, math.nan).tolist()
    return medians


def _edge(heights: list[float]) -> float:
    """Return where the road ends, by the first bins that are off its level, from the middle outward."""
    for first in range(_CORE, len(heights) - 2):
        beside = list(itertools.takewhile(math.isfinite, heights[first : first + 3]))
        if not beside or abs(beside[0]) <= _LEVEL or (len(beside) < 3 and abs(beside[-1]) < _LOST):
            continue
        before = heights[first - 1] if math.isfinite(heights[first - 1]) else 0.0
        if first < _LANE or not _ends(heights[first - 2] - heights[first - 3], beside[0] - before, beside):
            break
        level = min(abs(before), _LEVEL)
        crossing = (_LEVEL - level) / (abs(beside[0]) - level)  # bins on from the middle of the one before
        return (first - 0.5 + crossing - _MARGIN) * _BIN
    return math.inf


def _ends(inner: float, jump: float, beside: list[float]) -> bool:
    """Return whether the road ends where its profile jumps, by the heights beside it.

    It does not where it slopes from its middle on, by `inner` from bin to bin: that is camber. Nor at a low
    kerb with ground behind it that is nearly level.
    """
    if inner * jump > 0 and abs(inner) > _CAMBER * abs(jump):
        return False
    if len(beside) == 1 or abs(jump) > _KERB:
        return True
    rise = max(((height - beside[0]) / bins for bins, height in enumerate(beside[1:], 1)), key=abs)
    if jump * rise <= 0 or abs(rise) < _SLOPE * _BIN:
        return False
    gone = len(beside) == 2 and abs(beside[1] + rise) > _GONE
    return gone or abs(jump) < _STEP * abs(rise)
