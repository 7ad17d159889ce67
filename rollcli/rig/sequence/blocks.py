"""Means of blocks of frames, and the intervals that follow from how much they differ."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from rollcli.rig.sequence.noise import Noise
from rollcli.rig.sequence.tuning import TUNING
from rollcli.rig.sequence.weights import Floats


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and how sure it is.

    Attributes
    ----------
    value : float or None
        In the unit of the series; None where nothing is known.
    ci95 : float or None
        Half-width of the 95 % interval; None where there are too few blocks.
    error : float or None
        Standard error; None with `ci95`.
    freedom : float
        Degrees of freedom of `error`.
    needed : int
        Frames that an interval would take; 0 where there is one.
    """

    value: float | None = None
    ci95: float | None = None
    error: float | None = None
    freedom: float = 0.0
    needed: int = 0


def t_quantile(freedom: float, chance: float = 0.05) -> float:
    """Return the two-sided quantile of Student's t, within 0.1 % from five degrees of freedom on.

    Notes
    -----
    Cornish-Fisher expansion [Abramowitz, Stegun 1964, 26.7.5].
    """
    z, v = NormalDist().inv_cdf(1 - chance / 2), freedom
    terms = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160,
    )
    return z + sum(term / v**power for power, term in enumerate(terms, 1))


def with_interval(value: float, error: float, freedom: float) -> Estimate:
    """Return a value whose standard error has so many degrees of freedom."""
    return Estimate(value, t_quantile(freedom) * error, error, freedom)


def block_length(frames: int, noise: Noise) -> float:
    """Frames of a block: several correlation lengths, so that blocks hardly know of each other."""
    time = noise.correlation_time
    least, most = TUNING.fewest_times * time, TUNING.most_times * time
    return max(1.0, frames / TUNING.most_blocks, least, min(most, frames / TUNING.enough_blocks))


def block_count(frames: int, noise: Noise) -> int:
    """How many blocks a stretch of so many frames is cut into."""
    return int(frames / block_length(frames, noise))


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Means of equal stretches of frames.

    Attributes
    ----------
    means, weights, centres : ndarray of float, shape (K,)
        Of the blocks that hold a frame; centres are frames.
    """

    means: Floats
    weights: Floats
    centres: Floats


def make_blocks(values: Floats, weights: Floats, count: int) -> Blocks:
    """Average a series in `count` stretches of equal length; weight 0 where a frame is missing."""
    starts = np.linspace(0, len(values), max(count, 1) + 1).astype(int)[:-1]
    total = np.add.reduceat(weights, starts)
    there = total > 0
    frames = np.arange(len(values), dtype=float)
    means, centres = (
        np.add.reduceat(weights * each, starts)[there] / total[there] for each in (values, frames)
    )
    return Blocks(means, total[there], centres)


def mean_of_blocks(
    values: Floats, weights: Floats, noise: Noise, slope: float = 0.0, fitted: int = 1
) -> Estimate:
    """Return the mean of a stretch of a drive, with an interval from the spread of its blocks.

    Parameters
    ----------
    values, weights : ndarray of float, shape (N,)
        Weight 0 where a frame is missing.
    noise : Noise
        Gives the blocks' length, and what their remaining correlation hides.
    slope : float
        Of a drift that is known, per frame: it is no spread.
    fitted : int
        Parameters that the blocks' spread was taken about.

    Returns
    -------
    Estimate
    """
    if not weights.any():
        return Estimate(needed=frames_needed(noise))
    value = float(np.average(values, weights=weights))
    count = block_count(len(values), noise)
    frames = np.arange(len(values))
    blocks = make_blocks(values - slope * (frames - np.average(frames, weights=weights)), weights, count)
    if count < TUNING.fewest_blocks or len(blocks.means) < TUNING.fewest_blocks:
        return Estimate(value, needed=max(frames_needed(noise), len(values) + 1))
    k = len(blocks.means)
    share = blocks.weights / blocks.weights.sum()
    spread = float(share**2 @ (blocks.means - value) ** 2) * k / (k - fitted)
    error = math.sqrt(spread * hidden(noise, len(values), count))
    return with_interval(value, error, k - fitted)


def hidden(noise: Noise, frames: int, count: int) -> float:
    """By how much the variance of a mean is larger than its blocks' spread says.

    Neighbouring blocks are still a little alike: their spread about the common mean is too small by what the
    fitted noise tells, a factor that goes to 1 as blocks grow.
    """
    length = frames / count
    whole, one = noise.variance_of_mean(frames), noise.variance_of_mean(length)
    apart = (one - whole) / (count - 1)
    return whole / apart if apart > 0 else 1.0


def frames_needed(noise: Noise) -> int:
    return math.ceil(TUNING.fewest_blocks * TUNING.fewest_times * noise.correlation_time)
