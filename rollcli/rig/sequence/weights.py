"""What each frame counts: its own error, the variance between frames, and how far off it is."""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rollcli.rig.sequence.tuning import TUNING

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
