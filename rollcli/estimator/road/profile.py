"""The profile across a road: how far to the sides the ground still belongs to the lane ahead.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. Pavements,
verges and the far side of a crown lie higher or lower than the lane. Nothing is cut off: weights fade, so
that a kerb that is a little lower, or half a bin farther away, turns the angle a little and not at once.
"""

import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.moments import Floats
from rollcli.estimator.road.model import Reals
from rollcli.estimator.road.tuning import ProfileTuning


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

    def at(self, side: Reals) -> Floats:
        """Return the weights of pixels that lie this far to the right of the middle, in camera heights."""
        # to the power of 8: a square is three times as fast as a power
        fade = np.square(np.square(np.square(np.clip(side / self.tuning.width, -2, 2))))
        weights: Floats = self.level(side) * np.exp(-fade)
        return weights

    def level(self, side: Reals) -> Floats:
        """Return how much of the lane's level the ground there has, 0 to 1, however far it is."""
        # np.interp takes three times as long
        last = len(self.weights) - 1
        places = np.fmin(np.fmax(side / self.tuning.bin_width + last / 2, 0), last)
        below = places.astype(np.intp)
        level: Floats = self.weights[below] + (places - below) * np.diff(self.weights, append=0)[below]
        return level


def read_profile(side: Reals, height: Reals, tuning: ProfileTuning) -> Profile:
    """Read the profile across the lane ahead.

    Parameters
    ----------
    side : ndarray, shape (N,)
        How far to the right of the middle each pixel lies, camera heights; finite.
    height : ndarray, shape (N,)
        Its height over the lane, camera heights.
    tuning : ProfileTuning

    Returns
    -------
    Profile
    """
    heights = _medians(np.floor(side / tuning.bin_width) + tuning.bins, height, tuning)
    left, right = heights[tuning.bins - 1 :: -1], heights[tuning.bins :]
    both = np.concatenate([_outward(left, tuning)[::-1], _outward(right, tuning)])
    return Profile(1 / (1 + (both / tuning.off_level) ** 4), tuning)


def _medians(places: Reals, heights: Reals, tuning: ProfileTuning) -> Floats:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins: heights, far below 1, are the fractions
    keys = np.sort(places + 0.5 + np.clip(heights, -0.4, 0.4))
    if len(keys) == 0:
        return np.full(2 * tuning.bins, math.nan)
    bins = np.arange(2 * tuning.bins)
    bounds = np.searchsorted(keys, np.arange(2 * tuning.bins + 1))
    counts = np.diff(bounds)
    middles = keys[np.minimum(bounds[:-1] + counts // 2, len(keys) - 1)] - bins - 0.5
    medians: Floats = np.where(counts >= tuning.bin_pixels, middles, math.nan)
    return medians


def _outward(heights: Floats, tuning: ProfileTuning) -> Floats:
    """Return the heights outward from the middle: the lane is level, and where nothing is seen it goes on."""
    seen = np.where(np.arange(len(heights)) < tuning.core_bins, 0, heights)
    last = np.maximum.accumulate(np.where(np.isnan(seen), 0, np.arange(len(seen))))
    filled: Floats = seen[last]
    return filled
