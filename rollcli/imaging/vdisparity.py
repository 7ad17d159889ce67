"""v-disparity: the histogram of each row of a disparity map [Labayrade, Aubert, Tarel 2002]."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError


@dataclass(frozen=True)
class VDisparity:
    """Counts of disparities, row by row.

    Attributes
    ----------
    counts : ndarray of int32, shape (H, bins)
        counts[v, b]: valid pixels of row v with a disparity in bin b; a row sums to its valid pixels.
    max_disparity : float
        Pixels; the bins divide 0..max_disparity evenly, the last one also holds what lies beyond.
    """

    counts: NDArray[np.int32]
    max_disparity: float


def v_disparity(
    disparity: NDArray[Any], *, bins: int | None = None, max_disparity: float | None = None
) -> VDisparity:
    """Count the disparities of each row.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.
    bins : int, optional
        Number of bins; by default one a pixel of disparity, 256 at least, 1024 at most.
    max_disparity : float, optional
        Pixels; by default the largest of the map.

    Raises
    ------
    UsageError
        bins or max_disparity is not positive.
    """
    valid = np.isfinite(disparity) & (disparity > 0)
    if max_disparity is None:
        max_disparity = float(disparity[valid].max()) if valid.any() else 1.0
    if bins is None:
        bins = int(np.clip(np.ceil(max_disparity), 256, 1024))
    if bins < 1 or not max_disparity > 0:
        raise UsageError(f"bins {bins} and max-disparity {max_disparity}: both must be positive")
    rows, _ = np.nonzero(valid)
    columns = np.minimum((disparity[valid] * (bins / max_disparity)).astype(np.int64), bins - 1)
    height = disparity.shape[0]
    counts = np.bincount(rows * bins + columns, minlength=height * bins).reshape(height, bins)
    return VDisparity(counts.astype(np.int32), max_disparity)


def draw_v_disparity(
    histogram: VDisparity, alpha: tuple[float, float, float] | None = None, offset: float = 0.0
) -> NDArray[np.uint8]:
    """A picture of the counts: log scale, bright where many; the road's parabola over it.

    Parameters
    ----------
    histogram : VDisparity
        Of a de-rotated map, where the road is a thin line.
    alpha : tuple of float, optional
        The road: d = a0 + a1 y + a2 y^2, pixels, with y = row + offset.
    offset : float
        See `row_offset`.

    Returns
    -------
    ndarray of uint8, shape (H, bins, 3)
        BGR.
    """
    scale = np.log1p(histogram.counts)
    grey = (scale * (255 / max(float(scale.max()), 1.0))).astype(np.uint8)
    picture = cv2.applyColorMap(grey, cv2.COLORMAP_INFERNO).astype(np.uint8, copy=False)
    if alpha is not None:
        rows = np.arange(len(picture))
        y = rows + offset
        columns = (alpha[0] + alpha[1] * y + alpha[2] * y**2) * (picture.shape[1] / histogram.max_disparity)
        points = np.column_stack([columns, rows])[(columns >= 0) & (columns < picture.shape[1])]
        cv2.polylines(picture, [np.rint(points).astype(np.int32)], False, (120, 255, 80), 1, cv2.LINE_AA)
    return picture


def row_offset(theta: float, width: int, height: int) -> float:
    """What to add to a row of the map de-rotated about its centre to get y of the method, pixels.

    y = v cos - u sin is measured from the top-left pixel of the map as it was; `derotate` keeps the centre.
    """
    u, v = (width - 1) / 2, (height - 1) / 2
    return float(v * np.cos(theta) - u * np.sin(theta) - v)
