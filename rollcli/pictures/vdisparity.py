"""v-disparity [VD]: the histogram of each row's disparities, as counts and as a picture."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.moments import has_disparity, map_of, strips
from rollcli.estimator.road.model import Parabola
from rollcli.pictures.overlay import FONT, FONT_SIZE, INK, Pixels, round_step, unit_of_rows

_MAX_BINS, _MOST_BINS = 1024, 65535  # unless asked for; and ever, as an image of that width
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
    disparity: ArrayLike, *, bins: int | None = None, max_disparity: float | None = None
) -> VDisparity:
    """Count the disparities of each row.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Pixels; NaN, inf, <= 0, what is beyond 1e15 and what a masked array hides are no data.
    bins : int, optional
        At most 65535; by default one a pixel for maps of whole pixels, else four a pixel and at least 256,
        within 1024.
    max_disparity : float, optional
        Pixels; by default just above the largest of the map, where a few far beyond all others do not count.

    Returns
    -------
    VDisparity

    Raises
    ------
    UsageError
        bins or max_disparity is not positive, there are too many bins, or the array is not 2-D.

    Examples
    --------
    >>> import numpy as np
    >>> v_disparity(np.array([[1, 2, 2], [0, 3, 3]])).counts
    array([[0, 1, 2, 0],
           [0, 0, 0, 2]], dtype=int32)
    """
    values = map_of(disparity)
    if values.ndim != 2 or values.dtype.kind not in "fiub":
        raise UsageError(f"a disparity map is 2-D and real, not of shape {values.shape} and {values.dtype}")
    blocks = [values[rows] for rows in strips(len(values), _BLOCK // max(1, values.shape[1]))]
    asked = bins is None or max_disparity is None  # else nothing depends on it
    whole = asked and all(bool((pixels == np.rint(pixels)).all()) for pixels in map(_pixels, blocks))
    if max_disparity is None:
        max_disparity = _end_of(blocks, 1 if whole else 4)
    if not 0 < max_disparity < math.inf or not (bins is None or 0 < bins <= _MOST_BINS):
        most = f"at most {_MOST_BINS} bins"
        raise UsageError(f"bins {bins} and max-disparity {max_disparity}: both must be positive, {most}")
    if bins is None:
        bins = math.ceil(min(max_disparity if whole else max(256, 4 * max_disparity), _MAX_BINS))
    return _histogram(blocks, bins, max_disparity)


def _end_of(blocks: Sequence[NDArray[Any]], per_pixel: int) -> float:
    """Find the right end of a histogram with so many bins a pixel: those beyond may be a few far outliers."""
    end = math.floor(max((_pixels(each).max(initial=0) for each in blocks), default=0)) + 1.0
    while end * per_pixel > _MAX_BINS:
        near = 2 * shown_end(_histogram(blocks, _MAX_BINS, end))
        if near >= end:
            break
        end = near
    return end


def _histogram(blocks: Sequence[NDArray[Any]], bins: int, max_disparity: float) -> VDisparity:
    counts = [_counts(_pixels(each), bins, max_disparity) for each in blocks]
    return VDisparity(np.concatenate([np.zeros((0, bins), np.int32), *counts]), max_disparity)


def _pixels(values: NDArray[Any]) -> NDArray[np.float64]:
    """Disparities; what is no data is 0."""
    return np.where(has_disparity(values), values, 0).astype(np.float64)


def _counts(pixels: NDArray[np.float64], bins: int, max_disparity: float) -> NDArray[np.int32]:
    """Return the histogram of each row; the last bin also holds what lies beyond."""
    # divided last: 15 / 22 * 22 is less than 15
    cells = np.minimum(np.minimum(pixels, max_disparity) * bins / max_disparity, bins - 1).astype(np.int64)
    cells[pixels == 0] = bins  # one bin more, for what is no data
    cells += np.arange(len(pixels))[:, None] * (bins + 1)
    counts = np.bincount(cells.ravel(), minlength=len(pixels) * (bins + 1)).reshape(len(pixels), bins + 1)
    return np.ascontiguousarray(counts[:, :-1], dtype=np.int32)


class MiddleColumn(NamedTuple):
    """The middle column of a map, along which y of the method is start + step * row, pixels.

    y = v cos - u sin is measured from the top-left pixel of the map as it was.
    """

    start: float
    step: float

    @classmethod
    def of_map(cls, theta: float, width: int) -> "MiddleColumn":
        """Return that of a map as it is, rolled by `theta`, radians, and so many pixels wide."""
        return cls(-(width - 1) / 2 * math.sin(theta), math.cos(theta))

    @classmethod
    def of_level(cls, theta: float, width: int, height: int) -> "MiddleColumn":
        """Return that of the same map once it is de-rotated about its centre, as `derotate` does."""
        u, v = (width - 1) / 2, (height - 1) / 2
        return cls(v * math.cos(theta) - u * math.sin(theta) - v, 1.0)

    def profile(self, alpha: Parabola) -> Parabola:
        """Return the road's disparity along it, as a parabola of the row, from that of y; pixels."""
        (a0, a1, a2), (start, step) = alpha, self
        return a0 + a1 * start + a2 * start**2, (a1 + 2 * a2 * start) * step, a2 * step**2

    def row(self, y: float) -> float:
        """Return the row where y is this, pixels."""
        return (y - self.start) / self.step


# sizes below are pixels, times `unit_of_rows`
LEFT_MARGIN, BOTTOM_MARGIN = 40, 32  # the first rows of a picture are the rows of the map
_SHOWN = 0.998  # share of the pixels within the shown range: a few outliers must not squeeze the road
_ROUND_PX = 16.0  # the range ends at a multiple of this, so that frames of one drive share their scale
_WIDTH = 320  # of the chart: all pictures of one size of map have the same size
_LABEL_EVERY = (60, 40)  # pixels between labels, along the disparities and along the rows
_DASH = 8
_SHIFT = 4  # bits of a coordinate after the point
_ROAD = (255, 255, 0)  # BGR: cyan, which the colours of the counts do not have
_HORIZON = (120, 220, 120)


def draw_v_disparity(
    histogram: VDisparity,
    curve: Parabola | None = None,
    horizon: float | None = None,
    end: float | None = None,
) -> Pixels:
    """Draw counts: log scale, bright where many, with the road's parabola and the horizon over them.

    Parameters
    ----------
    histogram : VDisparity
        Of a de-rotated map, where the road is a thin line.
    curve : tuple of float, optional
        The road: d = a0 + a1 row + a2 row^2, pixels; see `MiddleColumn.profile`.
    horizon : float, optional
        The row of the road's horizon, pixels.
    end : float, optional
        The disparity at the right end of the picture, pixels; by default `shown_end`.

    Returns
    -------
    ndarray of uint8, shape (H + BOTTOM_MARGIN, LEFT_MARGIN + width, 3)
        BGR. Its first H rows are the rows of the map; the margins name rows and disparities, in pixels.
        Width, margins and letters are twice as large for 960 rows, three times for 1440, and so on.
    """
    unit = unit_of_rows(len(histogram.counts))
    counts, top = shown_counts(histogram, _WIDTH * unit, end or shown_end(histogram))
    light = np.log1p(counts)
    brightest = float(np.percentile(light[counts > 0], 99.9)) if counts.any() else 1.0
    grey = np.minimum(light * (255 / brightest), 255).astype(np.uint8)
    chart = cv2.applyColorMap(grey, cv2.COLORMAP_INFERNO).astype(np.uint8, copy=False)
    if horizon is not None and 0 <= horizon <= len(chart) - 1:
        _draw_horizon(chart, round(horizon), unit)
    if curve is not None:
        _draw_road(chart, curve, top, unit)
    return _with_margins(chart, top, unit)


def shown_end(histogram: VDisparity) -> float:
    """Return the disparity beyond which hardly any pixels lie, px, rounded up."""
    counts = histogram.counts
    reached = np.cumsum(counts.sum(axis=0))
    total = int(reached[-1])
    last = int(np.searchsorted(reached, _SHOWN * total)) + 1 if total else counts.shape[1]
    per_bin = histogram.max_disparity / counts.shape[1]
    return float(math.ceil(last * per_bin / _ROUND_PX) * _ROUND_PX)


def shown_counts(histogram: VDisparity, width: int, end: float) -> tuple[NDArray[np.float32], float]:
    """Return the counts up to the bin of `end`, px, `width` columns wide, and where that bin ends, px."""
    counts = histogram.counts
    per_bin = histogram.max_disparity / counts.shape[1]
    bins = min(counts.shape[1], math.ceil(end / per_bin))
    kind = cv2.INTER_AREA if bins > width else cv2.INTER_NEAREST
    shown = cv2.resize(counts[:, :bins].astype(np.float32), (width, len(counts)), interpolation=kind)
    return shown.astype(np.float32, copy=False), bins * per_bin


def _draw_road(chart: Pixels, curve: Parabola, top: float, unit: int) -> None:
    """Draw the road's curve, dashed so that what it lies on can be seen."""
    height, width = chart.shape[:2]
    for start in range(0, height, 2 * _DASH * unit):
        rows = np.arange(start, min(start + _DASH * unit, height))
        columns = np.polynomial.Polynomial(curve)(rows) * (width / top)
        points = np.column_stack([columns, rows])[(columns >= 0) & (columns < width)]
        sides = [points + np.array([side, 0.0]) for side in (-0.5 * unit, 0.5 * unit)]
        fixed = [np.rint(each * 2**_SHIFT).astype(np.int32) for each in sides]
        cv2.polylines(chart, fixed, False, _ROAD, unit, cv2.LINE_AA, _SHIFT)


def _draw_horizon(chart: Pixels, row: int, unit: int) -> None:
    dash = _DASH * unit
    for start in range(0, chart.shape[1], 2 * dash):
        cv2.line(chart, (start, row), (start + dash - 1, row), _HORIZON, unit)
    place = (4 * unit, max(row - 4 * unit, 10 * unit))
    cv2.putText(chart, "horizon", place, FONT, FONT_SIZE * unit, _HORIZON, unit, cv2.LINE_AA)


def _with_margins(chart: Pixels, top: float, unit: int) -> Pixels:
    """Return the chart with rows named on its left and disparities below it."""
    height, width = chart.shape[:2]
    left, tick = LEFT_MARGIN * unit, 4 * unit
    picture = np.full((height + BOTTOM_MARGIN * unit, left + width, 3), 255, np.uint8)
    picture[:height, left:] = chart
    for row in np.arange(0, height, round_step(_LABEL_EVERY[1] * unit)):
        cv2.line(picture, (left - tick, int(row)), (left - 1, int(row)), INK, unit)
        _write(picture, f"{row:g}", left - 7 * unit, max(int(row) + 4 * unit, 9 * unit), unit, align=1.0)
    for disparity in np.arange(0, top, round_step(_LABEL_EVERY[0] * unit * top / width)):
        column = left + round(disparity * width / top)
        cv2.line(picture, (column, height), (column, height + tick - 1), INK, unit)
        _write(picture, f"{disparity:g}", column, height + 14 * unit, unit, align=0.5)
    _write(picture, "disparity, px", left + width // 2, height + 27 * unit, unit, align=0.5)
    _write(picture, "row", left - 7 * unit, height + 27 * unit, unit, align=1.0)
    return picture


def _write(picture: Pixels, text: str, column: int, row: int, unit: int, *, align: float) -> None:
    """Write a line; `align` 0 starts at the column, 0.5 is centred there, 1 ends there."""
    (width, _), _ = cv2.getTextSize(text, FONT, FONT_SIZE * unit, unit)
    left = min(max(column - round(align * width), 0), picture.shape[1] - width)
    cv2.putText(picture, text, (left, row), FONT, FONT_SIZE * unit, INK, unit, cv2.LINE_AA)
