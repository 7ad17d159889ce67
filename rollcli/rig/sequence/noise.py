"""How frames of a drive are correlated: AR(1), which is the car and the road, and white noise on top.

The spectrum of both is fitted to the periodogram by Whittle's likelihood, which needs no loop over frames
and is blind to the mean [Whittle 1953].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rollcli.rig.sequence.weights import Floats

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
