"""The profile across a road: how far to the sides the ground still belongs to the lane ahead.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. Pavements,
verges and the far side of a crown lie higher or lower than the lane. Nothing is cut off: weights fade, so
that a kerb that is a little lower, or half a bin farther away, turns the angle a little and not at once.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.moments import Floats
from rollcli.estimator.road.model import Reals
from rollcli.estimator.road.tuning import ProfileTuning

_MOST_OFF = 10  # times `off_level`: ground that is farther over or under the lane weighs nothing


@dataclass(frozen=True, eq=False)
class Profile:
    """How much the ground counts, by how far to the side it lies.

    Attributes
    ----------
    weights : ndarray, shape (2 * bins,)
        From left to right, 0 to 1.
    tuning : ProfileTuning
    """

    weights: Floats
    tuning: ProfileTuning

    def at(self, side: Reals) -> Reals:
        """Return the weights of pixels that lie this far to the right of the middle, in camera heights."""
        # to the power of 8: a square is three times as fast as a power
        fade = np.minimum(np.square(side / self.tuning.width), 4)
        fade *= fade
        fade *= fade
        weights: Reals = self.level(side)
        weights *= np.exp(-fade)
        return weights

    def level(self, side: Reals) -> Reals:
        """Return how much of the lane's level the ground there has, 0 to 1, however far it is."""
        # np.interp takes three times as long
        weights = self.weights.astype(side.dtype)
        rises = np.empty_like(weights)
        np.subtract(weights[1:], weights[:-1], out=rises[:-1])
        rises[-1] = 0
        last = len(weights) - 1
        places = np.fmin(np.fmax(side / self.tuning.bin_width + last / 2, 0), last)
        below = np.floor(places)
        level: Reals = places - below
        below = below.astype(np.intp)
        level *= rises.take(below)
        level += weights.take(below)
        return level


def read_profile(side: Reals, height: Reals, tuning: ProfileTuning) -> Profile:
    """Read the profile across the lane ahead.

    Parameters
    ----------
    side : ndarray, shape (N,)
        How far to the right of the middle each pixel lies, camera heights; infinite where it does not count.
    height : ndarray, shape (N,)
        Its height over the lane, camera heights.
    tuning : ProfileTuning

    Returns
    -------
    Profile
    """
    level = np.array(_outward(_medians(side, height, tuning), tuning)) / tuning.off_level
    return Profile(1 / (1 + np.square(np.square(level))), tuning)


def _medians(sides: Reals, heights: Reals, tuning: ProfileTuning) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins, and for one more to each side; of 16 bits it takes a quarter of the time
    of_bin = 2**16 // (2 * tuning.bins + 2)
    level = of_bin // 2
    step, most = tuning.off_level / ((level - 1) // _MOST_OFF), _MOST_OFF * tuning.off_level
    steps = np.minimum(np.maximum(heights, -most), most) / step + (level + 0.5)
    places = np.floor(sides / tuning.bin_width) + (tuning.bins + 1)
    keys = (np.minimum(np.maximum(places, 0), 2 * tuning.bins + 1) * of_bin).astype(np.uint16)
    keys += steps.astype(np.uint16)
    keys.sort(kind="stable")
    starts = np.arange(1, 2 * tuning.bins + 2) * of_bin
    bounds = itertools.pairwise(keys.searchsorted(starts.astype(np.uint16)).tolist())
    return [
        (int(keys[(low + high) // 2]) - start - level) * step if high - low >= tuning.bin_pixels else math.nan
        for start, (low, high) in zip(starts.tolist(), bounds, strict=False)
    ]


def _outward(heights: list[float], tuning: ProfileTuning) -> list[float]:
    """Return the heights of all bins: the lane is level, and where nothing is seen it goes on outward."""
    first, end = tuning.bins - tuning.core_bins, tuning.bins + tuning.core_bins
    filled = [*heights[:first], *[0.0] * (end - first), *heights[end:]]
    for place in range(first - 1, -1, -1):
        if math.isnan(filled[place]):
            filled[place] = filled[place + 1]
    for place in range(end, len(filled)):
        if math.isnan(filled[place]):
            filled[place] = filled[place - 1]
    return filled
