"""v-disparity: the histogram of each row of a disparity map [Labayrade, Aubert, Tarel 2002]."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError

_MAX_BINS = 1024
_BLOCK = 1 << 22  # pixels counted at a time: a large map would take 40 bytes a pixel


@dataclass(frozen=True)
class VDisparity:
    """Counts of disparities, row by row.

    Attributes
    ----------
    counts : ndarray of int32, shape (H, bins)
        counts[v, b]: valid pixels of row v with a disparity in bin b; a row sums to its valid pixels.
    max_disparity : float
        Pixels; the bins divide 0..max_disparity evenly, and the last also holds what lies beyond.
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
        By default one a pixel for maps of whole pixels, else four a pixel and at least 256; at most 1024.
    max_disparity : float, optional
        Pixels; by default just above the largest of the map.

    Raises
    ------
    UsageError
        bins or max_disparity is not positive, or the array is not 2-D.

    Examples
    --------
    >>> import numpy as np
    >>> v_disparity(np.array([[1, 2, 2], [0, 3, 3]])).counts
    array([[0, 1, 2, 0],
           [0, 0, 0, 2]], dtype=int32)
    """
    values = np.asarray(disparity)
    if values.ndim != 2:
        raise UsageError(f"a disparity map is 2-D, not of shape {values.shape}")
    step = max(1, _BLOCK // max(1, values.shape[1]))
    blocks = [values[top : top + step] for top in range(0, len(values), step)]
    if max_disparity is None:
        max_disparity = math.floor(max((_pixels(each).max(initial=0) for each in blocks), default=0)) + 1.0
    if not 0 < max_disparity < math.inf or (bins is not None and bins < 1):
        raise UsageError(f"bins {bins} and max-disparity {max_disparity}: both must be positive")
    if bins is None:
        whole = all(bool((pixels == np.rint(pixels)).all()) for pixels in map(_pixels, blocks))
        bins = min(math.ceil(max_disparity) if whole else max(256, math.ceil(4 * max_disparity)), _MAX_BINS)
    counts = [_counts(_pixels(each), bins, max_disparity) for each in blocks]
    return VDisparity(np.concatenate([np.zeros((0, bins), np.int32), *counts]), max_disparity)


def _pixels(values: NDArray[Any]) -> NDArray[np.float64]:
    """Disparities; what is no data is 0."""
    return np.where(np.isfinite(values) & (values > 0), values, 0).astype(np.float64)


def _counts(pixels: NDArray[np.float64], bins: int, max_disparity: float) -> NDArray[np.int32]:
    """Return the histogram of each row; the last bin also holds what lies beyond."""
    shares = np.minimum(pixels, max_disparity) / max_disparity
    cells = np.minimum(shares * bins, bins - 1).astype(np.int64)
    cells[pixels == 0] = bins  # one bin more, for what is no data
    cells += np.arange(len(pixels))[:, None] * (bins + 1)
    counts = np.bincount(cells.ravel(), minlength=len(pixels) * (bins + 1)).reshape(len(pixels), bins + 1)
    return np.ascontiguousarray(counts[:, :-1], dtype=np.int32)


def row_offset(theta: float, width: int, height: int) -> float:
    """Return what to add to a row of the map de-rotated about its centre to get y of the method, pixels.

    y = v cos - u sin is measured from the top-left pixel of the map as it was; `derotate` keeps the centre.
    """
    u, v = (width - 1) / 2, (height - 1) / 2
    return v * math.cos(theta) - u * math.sin(theta) - v


def profile(alpha: tuple[float, float, float], theta: float, width: int) -> tuple[float, float, float]:
    """Return the road's disparity along the middle column of a map, as a parabola of the row.

    Parameters
    ----------
    alpha : tuple of float
        The road: d = a0 + a1 y + a2 y^2, pixels, y measured as the method does.
    theta : float
        Roll of the map, radians.
    width : int
        Of the map, pixels.
    """
    a0, a1, a2 = alpha
    start, step = _middle_column(theta, width)
    return a0 + a1 * start + a2 * start**2, (a1 + 2 * a2 * start) * step, a2 * step**2


def middle_row(y: float, theta: float, width: int) -> float:
    """Return the row where the middle column of a map has a y of the method, pixels."""
    start, step = _middle_column(theta, width)
    return (y - start) / step


def _middle_column(theta: float, width: int) -> tuple[float, float]:
    """Return start and step of y = start + step * row along the middle column of a map."""
    return -(width - 1) / 2 * math.sin(theta), math.cos(theta)
