"""The profile across a road: how far to the sides the ground still belongs to the lane ahead.

Heights above the road, in camera heights, are relative differences of disparity: h = d / road - 1. A kerb is
a step; a verge or the far side of a crown starts at the lane's height and rises or falls from there.
Nothing is cut off: weights fade, so that a kerb that is a little lower, or half a bin farther away, turns the
angle a little and not at once.
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
        bins = len(self.weights) // 2
        middles = (np.arange(-bins, bins) + 0.5) * self.tuning.bin_width
        level: Floats = np.interp(side, middles, self.weights)
        return level


def read_profile(side: Reals, height: Reals, tuning: ProfileTuning) -> Profile:
    """Read the profile across the lane ahead, outward from its middle.

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
    left, right = _outward(heights[tuning.bins - 1 :: -1], tuning), _outward(heights[tuning.bins :], tuning)
    return Profile(np.array([*reversed(left), *right]), tuning)


def _medians(places: Reals, heights: Reals, tuning: ProfileTuning) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins: heights, far below 1, are the fractions
    keys = np.sort(places + 0.5 + np.clip(heights, -0.4, 0.4))
    if len(keys) == 0:
        return [math.nan] * (2 * tuning.bins)
    bins = np.arange(2 * tuning.bins)
    bounds = np.searchsorted(keys, np.arange(2 * tuning.bins + 1))
    counts = np.diff(bounds)
    middles = keys[np.minimum(bounds[:-1] + counts // 2, len(keys) - 1)] - bins - 0.5
    medians: list[float] = np.where(counts >= tuning.bin_pixels, middles, math.nan).tolist()
    return medians


def _outward(heights: list[float], tuning: ProfileTuning) -> list[float]:
    """Return the weight of each bin of one side, from the middle outward."""
    weights: list[float] = []
    reached = 1.0  # what the steps on the way leave
    seen: list[tuple[int, float]] = []
    for place, height in enumerate(heights):
        if place < tuning.core_bins or not math.isfinite(height):
            reached *= tuning.gap if place >= tuning.core_bins else 1.0
            weights.append(reached)
        else:
            if seen:
                reached /= 1 + (abs(height - _continued(seen, place, tuning)) / tuning.step) ** 6
            weights.append(reached / (1 + (height / tuning.off_level) ** 4))
        if math.isfinite(height):
            seen.append((place, height))
    return weights


def _continued(seen: list[tuple[int, float]], place: int, tuning: ProfileTuning) -> float:
    """Return the height at a bin if the ground went on from those seen so far as it came, but not steeply."""
    (first, start), (last, height) = seen[-3:][0], seen[-1]
    slope = 0.0 if first == last else (height - start) / (last - first)
    return height + max(-tuning.slope, min(tuning.slope, slope)) * (place - last)
