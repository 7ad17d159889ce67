"""Noise of a drive: weights of frames, blocks of them, and the intervals that follow."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from rollcli.rig.drive.tuning import TUNING

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MAD_TO_SD = 1.4826  # of a normal distribution
_STEPS = 60
_PRECISION = 1e-9  # of tau^2; the steps' errors square


def between_variance(values: Floats, variances: Floats) -> float:
    """Return the variance between frames, beyond their own errors [Paule, Mandel 1982].

    Parameters
    ----------
    values : ndarray of float, shape (N,)
        One value a frame.
    variances : ndarray of float, shape (N,)
        The square of each value's own standard error; more than 0.

    Returns
    -------
    float
        tau^2 >= 0 for which the weighted squares about the weighted mean sum to N - 1; 0 where the own
        errors explain them all.
    """
    tau2 = 0.0
    for _ in range(_STEPS):
        weights = 1 / (variances + tau2)
        squares = weights * (values - weights @ values / weights.sum()) ** 2
        excess = float(squares.sum()) - (len(values) - 1)
        if excess <= 0:  # the sum is convex and falls, so that Newton's steps come from below
            break
        step = excess / float(weights @ squares)
        tau2 += step
        if step <= _PRECISION * tau2:
            break
    return tau2


def frame_weights(residuals: Floats, variances: Floats) -> tuple[Floats, float]:
    """Weigh frames by their own error and the variance between them, doubtful ones less.

    Parameters
    ----------
    residuals : ndarray of float, shape (N,)
        About the mounting angle.
    variances : ndarray of float, shape (N,)
        The square of each frame's own standard error.

    Returns
    -------
    weights : ndarray of float, shape (N,)
        huber(residual / sd) / (variance + tau^2).
    tau2 : float
        The variance between frames, of residuals that are cut at Huber's bound.
    """
    spread = float(np.median(np.abs(residuals))) * _MAD_TO_SD
    tau2 = spread**2
    for _ in range(2):  # the bound depends on tau^2, and tau^2 on what is beyond the bound
        bound = TUNING.huber * np.sqrt(variances + tau2)
        tau2 = between_variance(np.clip(residuals, -bound, bound), variances)
    deviations = np.sqrt(variances + tau2)
    share = np.minimum(1.0, TUNING.huber * deviations / np.maximum(np.abs(residuals), 1e-300))
    return share / deviations**2, tau2


def gross_outliers(values: Floats, variances: Floats) -> Flags:
    """Find the values that are far from those of the frames beside them.

    Parameters
    ----------
    values : ndarray of float, shape (N,)
        In order, without gaps.
    variances : ndarray of float, shape (N,)
        The square of each frame's own standard error.

    Returns
    -------
    ndarray of bool, shape (N,)
        What to leave out. A frame beside a jump is not among it: it is like those of one side.
    """
    residuals = _off_neighbours(values)
    standardised = residuals / np.sqrt(variances + _wander(residuals, variances))
    scale = _MAD_TO_SD * float(np.median(standardised)) if len(values) else 0.0
    if not scale > 0 or not math.isfinite(scale):
        return np.zeros(len(values), dtype=bool)
    return np.asarray(standardised > TUNING.gross * scale)


def _off_neighbours(values: Floats) -> Floats:
    """How far each value is from the median of those before it, or of those after it, whichever is nearer."""
    width = TUNING.neighbours
    if len(values) <= width:
        return np.abs(values - np.median(values)) if len(values) else values
    medians = np.median(sliding_window_view(values, width), axis=1)
    before = np.concatenate([np.full(width, np.nan), medians[:-1]])
    after = np.concatenate([medians[1:], np.full(width, np.nan)])
    return np.asarray(np.fmin(np.abs(values - before), np.abs(values - after)))


def _wander(residuals: Floats, variances: Floats) -> float:
    """Return the variance about the neighbours' median that the frames' own errors do not explain.

    It shows in the frames with small errors; where large errors are too large, it is not seen in the others.
    """
    most = 0.0
    for part in np.array_split(np.argsort(variances, kind="stable"), min(4, len(residuals) // 20 + 1)):
        if len(part):
            spread = _MAD_TO_SD * float(np.median(residuals[part]))
            most = max(most, spread**2 - float(np.median(variances[part])))
    return most


_FIRST_BINS = 24  # ordinates that stand alone: the slowest ones tell of the correlation length
_BINS = 90
_LEAST_DECAY = 1e-4
_ONE_SIGMA = 1.0  # of the deviance
_SEEN = 8.0  # gain in deviance below which no correlation is seen: a single slow ordinate brings as much
_UNSEEN = 2.0  # frames: the longest correlation time where none is seen, so that 32 single frames suffice
_SLOW_MATTERS = 3.0  # a slow share of a third governs the means of blocks


@dataclass(frozen=True, slots=True)
class Noise:
    """Stationary noise: a share that decays by `phi` from frame to frame, the rest white.

    Attributes
    ----------
    variance : float
        Of a single frame, of the series that it was fitted to.
    phi : float
        Correlation of the slow part from one frame to the next, 0 <= phi < 1.
    share : float
        Of the variance that is slow, 0 to 1.
    correlation_time : float
        Integrated autocorrelation time of the slow part, frames: after so many it is forgotten. At the upper
        end of its standard error, since blocks must not be too short; 1 where nothing is slow.
    """

    variance: float
    phi: float
    share: float
    correlation_time: float

    def variance_of_mean(self, frames: float) -> float:
        """Return the variance of the mean of so many frames in a row."""
        if self.phi <= 0 or self.share <= 0:
            return self.variance / frames
        decay, m = 1 - self.phi, frames
        slow = 1 + 2 * self.phi / decay - 2 * self.phi * (1 - self.phi**m) / (m * decay**2)
        return float(self.variance / m * (1 - self.share + self.share * slow))


def fit_noise(series: Floats) -> Noise:
    """Fit AR(1) plus white noise to a series.

    Parameters
    ----------
    series : ndarray of float, shape (N,)
        In order; 0 where a frame is missing, so that time is kept.

    Returns
    -------
    Noise
    """
    n = len(series)
    variance = float(np.mean(series**2)) if n else 0.0
    if n < 4 or not variance > 0:
        return Noise(variance, 0.0, 0.0, 1.0)
    power, omega, counts = _periodogram(series / np.sqrt(variance))
    decays = np.geomspace(max(_LEAST_DECAY, 0.5 / n), 1.0, 48)
    shares = np.linspace(0.0, 1.0, 21)
    deviance, _ = _deviance(power, omega, counts, decays, shares)
    at = np.unravel_index(int(deviance.argmin()), deviance.shape)
    if deviance[-1, 0] - deviance[at] < _SEEN:
        at = (np.intp(len(decays) - 1), np.intp(0))
    longest = _longest(deviance, decays, shares, at)
    if decays[at[0]] == 1:
        return Noise(variance, 0.0, 0.0, min(longest, _UNSEEN))
    decays = np.minimum(1.0, decays[at[0]] * np.geomspace(0.8, 1.25, 25))
    shares = np.clip(shares[at[1]] + np.linspace(-0.06, 0.06, 13), 0.0, 1.0)
    deviance, scale = _deviance(power, omega, counts, decays, shares)
    at = np.unravel_index(int(deviance.argmin()), deviance.shape)
    phi, share = 1 - float(decays[at[0]]), float(shares[at[1]])
    time = max(float(_forgotten(1 - phi, share)), min(longest, n / 2))
    return Noise(variance * float(scale[at]), phi, share, time)


def _forgotten(decay: ArrayLike, share: ArrayLike) -> Floats:
    """Frames that are worth one independent frame of the slow part; fewer where hardly any is slow."""
    slow = 2 * (1 - np.asarray(decay)) / np.asarray(decay)
    return np.asarray(1 + slow * np.minimum(1.0, _SLOW_MATTERS * np.asarray(share)))


def _periodogram(series: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the mean power in bins of frequency: single ordinates first, then wider and wider bins."""
    n = len(series)
    power = np.abs(np.fft.rfft(series)[1 : (n + 1) // 2]) ** 2 / n
    edges = np.geomspace(_FIRST_BINS, max(len(power), _FIRST_BINS + 1), _BINS)
    starts = np.unique(np.concatenate([np.arange(_FIRST_BINS), edges.astype(int)]))
    starts = starts[starts < len(power)]
    counts = np.diff(np.append(starts, len(power))).astype(float)
    centres = 2 * np.pi * (starts + 1 + (counts - 1) / 2) / n
    return np.add.reduceat(power, starts) / counts, centres, counts


def _deviance(
    power: Floats, omega: Floats, counts: Floats, decays: Floats, shares: Floats
) -> tuple[Floats, Floats]:
    """Whittle's -2 log likelihood over a grid, the scale at its best; and that scale."""
    phi = (1 - decays)[:, None]
    # 1 - 2 phi cos + phi^2, without loss for low frequencies
    slow = (1 - phi**2) / ((1 - phi) ** 2 + 4 * phi * np.sin(omega / 2) ** 2)
    shape = shares[None, :, None] * slow[:, None, :] + (1 - shares)[None, :, None]
    scale = (counts * power / shape).sum(-1) / counts.sum()
    deviance = 2 * (counts.sum() * np.log(np.maximum(scale, 1e-300)) + (counts * np.log(shape)).sum(-1))
    return deviance, scale


def _longest(deviance: Floats, decays: Floats, shares: Floats, at: tuple[np.intp, ...]) -> float:
    """Return the longest correlation time within one standard error, the slow share no smaller."""
    seen = decays[at[0]] < 0.95 and shares[at[1]] > 0
    least = shares[at[1]] if seen else 1.0
    times = _forgotten(decays[:, None], shares[None, :])
    fits = (deviance <= deviance[at] + _ONE_SIGMA) & (shares[None, :] >= least - 1e-12)
    return float(times[fits].max()) if fits.any() else 1.0


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
