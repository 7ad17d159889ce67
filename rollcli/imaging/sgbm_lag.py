"""Correct what SGBM's paths make too small: the disparity of a surface that rises down the image, as a road.

Semi-global matching [Hirschmueller 2008] adds up costs along paths. OpenCV's `3way` and `sgbm` follow paths
from above and from the sides, `hh` also from below. A path from above pays for each step up of the disparity:
on a road, whose disparity grows downward, it lags behind. Walls do not rise and are not affected; in `hh` the
lags of both directions cancel.

Measured on rendered roads that rise by 0.07 to 0.6 px per row, the lag grows and levels off. On KITTI 2012
against lidar, `3way` lies 0.14 px and `sgbm` 0.30 px below `hh`, as there.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Lag:
    """The lag of one mode, most rise / (rise + half_at).

    Attributes
    ----------
    most : float
        Of a surface that rises ever more steeply, px.
    half_at : float
        The rise with half of that, px of disparity per row.
    """

    most: float
    half_at: float

    def of(self, rise: NDArray[Any]) -> NDArray[Any]:
        """Return the lag, px, at a rise, px per row; 0 where nothing rises."""
        up = np.maximum(rise, 0)
        lag: NDArray[Any] = self.most * up / (up + self.half_at)
        return lag


# 0.1 px is 0.025 degrees of pitch at KITTI's size, and 0.045 at 640x480
LAGS = {"3way": Lag(0.25, 0.22), "sgbm": Lag(0.50, 0.25)}
_REACH = 6  # rows above and below: SGBM's steps of 1/16 px are then a hundredth of a road's rise
STEEPEST = 1.0  # px per px: more is an edge between two things
_STEP = 4  # of the grid on which the rise is taken: the lag is smooth
_AROUND = 9  # cells of the grid: where the rise is not known, it is that around


def without_lag(disparity: NDArray[np.float32], mode: str) -> NDArray[np.float32]:
    """Add to each pixel what SGBM lags behind there.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        As SGBM finds it, px; no data is <= 0 and stays.
    mode : str
        One of `stereo_options.MODES`.

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    height, width = disparity.shape
    lag = LAGS.get(mode)
    if lag is None or height <= 2 * _REACH:
        return disparity
    upper, lower = disparity[: -2 * _REACH : _STEP, ::_STEP], disparity[2 * _REACH :: _STEP, ::_STEP]
    rise = (lower - upper) / (2 * _REACH)
    known = ((upper > 0) & (lower > 0) & (np.abs(rise) < STEEPEST)).astype(np.float32)
    lags = lag.of(rise).astype(np.float32) * known
    around = cv2.blur(known, (_AROUND, _AROUND))
    filled = np.where(known > 0, lags, cv2.blur(lags, (_AROUND, _AROUND)) / np.maximum(around, 1e-3))
    added = cv2.resize(filled, (width, height), interpolation=cv2.INTER_LINEAR)
    added *= disparity > 0
    corrected: NDArray[np.float32] = np.add(disparity, added, out=added)
    return corrected
