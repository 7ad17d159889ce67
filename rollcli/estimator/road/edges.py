"""The profile across a road: where a verge or a kerb ends it.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. A kerb is
a step; a verge starts at the road's height and rises or falls from there, until it is lost: only pixels near
the road are looked at.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.model import Reals, RoadModel
from rollcli.estimator.road.tuning import EdgeTuning


class Edges(NamedTuple):
    """How far the road reaches to the left and to the right, in camera heights; inf where no edge is seen."""

    left: float
    right: float

    def hold(self, side: Reals) -> NDArray[np.bool_]:
        """Return which pixels lie between the edges; `side` is how far to the right each is."""
        held: NDArray[np.bool_] = (side > -self.left) & (side < self.right)
        return held


NO_EDGES = Edges(math.inf, math.inf)


def find_edges(
    x: Reals, y: Reals, d: Reals, used: NDArray[np.bool_], road: RoadModel, tuning: EdgeTuning
) -> Edges:
    """Find where the road ends: at a verge, which falls or rises from its edge, or at a kerb that is not low.

    Parameters
    ----------
    x, y, d : ndarray, shape (N,)
        Normalised coordinates and disparity of the pixels near the road, px.
    used : ndarray of bool, shape (N,)
        Pixels to look at.
    road : RoadModel
    tuning : EdgeTuning

    Returns
    -------
    Edges
    """
    expected = road.disparity(x, y)
    used = used & (expected > 0)  # above the horizon there is no profile
    if not used.any():
        return NO_EDGES
    x, y, d, expected = x[used], y[used], d[used], expected[used]
    bins = np.floor(road.side(x, y, expected) / tuning.bin_width) + tuning.bins
    medians = _medians(bins, d / expected - 1, tuning)
    return Edges(_edge(medians[tuning.bins - 1 :: -1], tuning), _edge(medians[tuning.bins :], tuning))


def _medians(places: Reals, heights: Reals, tuning: EdgeTuning) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins: heights, far below 1, are the fractions
    keys = np.sort(places + 0.5 + np.clip(heights, -0.4, 0.4))
    bins = np.arange(2 * tuning.bins)
    bounds = np.searchsorted(keys, np.arange(2 * tuning.bins + 1))
    counts = np.diff(bounds)
    middles = keys[np.minimum(bounds[:-1] + counts // 2, len(keys) - 1)] - bins - 0.5
    medians: list[float] = np.where(counts >= tuning.bin_pixels, middles, math.nan).tolist()
    return medians


def _edge(heights: list[float], tuning: EdgeTuning) -> float:
    """Return where the road ends, by the first bins that are off its level, from the middle outward."""
    for first in range(tuning.core_bins, len(heights) - 2):
        beside = list(itertools.takewhile(math.isfinite, heights[first : first + 3]))
        if not beside or abs(beside[0]) <= tuning.level:
            continue
        if len(beside) < 3 and abs(beside[-1]) < tuning.lost:
            continue
        before = heights[first - 1] if math.isfinite(heights[first - 1]) else 0.0
        if first < tuning.lane_bins:
            break
        if not _ends(heights[first - 2] - heights[first - 3], beside[0] - before, beside, tuning):
            break
        level = min(abs(before), tuning.level)
        crossing = (tuning.level - level) / (abs(beside[0]) - level)  # bins from the middle of the one before
        return (first - 0.5 + crossing - tuning.margin) * tuning.bin_width
    return math.inf


def _ends(inner: float, jump: float, beside: list[float], tuning: EdgeTuning) -> bool:
    """Return whether the road ends where its profile jumps, by the heights beside it.

    It goes on where it slopes within by nearly as much, `inner` from bin to bin: that is camber. It also goes
    on at a low kerb with nearly level ground behind it.
    """
    if inner * jump > 0 and abs(inner) > tuning.camber * abs(jump):
        return False
    if len(beside) == 1 or abs(jump) > tuning.kerb_height:
        return True
    rise = max(((height - beside[0]) / bins for bins, height in enumerate(beside[1:], 1)), key=abs)
    if jump * rise <= 0 or abs(rise) < tuning.verge_slope * tuning.bin_width:
        return False
    gone = len(beside) == 2 and abs(beside[1] + rise) > tuning.gone
    return gone or abs(jump) < tuning.kerb_ratio * abs(rise)
