"""Frames that are far off those beside them: no mount moves for a single frame."""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rollcli.rig.drive.tuning import TUNING

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MAD_TO_SD = 1.4826  # of a normal distribution


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
