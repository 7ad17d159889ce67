"""A sample of a map's pixels on a regular grid, and how the disparity changes from each to its neighbours."""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Bools, Grid, Singles, rows_and_columns
from rollcli.estimator.tuning import SampleTuning

NO_STEP = np.float32(np.inf)  # to a neighbour without data: it agrees with no road
LEAST_PIXELS = 50  # away from the border; fewer hold no road
_LEAST_VALUES = 12  # that have a median
_TWICE = np.float32(2.001)  # and a little: scaled steps of whole pixels differ in their last digits
_SMALLEST, _LARGEST = 1e-12, 1e12  # typical disparities whose squares single precision can add up
_STEEP = np.float32(1e6)  # times the largest disparity; squares of slopes stay finite


class Spacing(NamedTuple):
    """How far apart pixels are sampled, px: their rows, and their columns."""

    rows: int
    columns: int

    @classmethod
    def of(cls, pixels: float) -> "Spacing":
        """Return that of one pixel in so many, or a few more; the rows are no multiple of 3 apart.

        Matchers prefer whole pixels, and from row to row a road's disparity grows by baseline over camera
        height, which is about a third of a pixel in most cars: every third row has the same part of that
        error.
        """
        rows = max(1, int(math.sqrt(pixels)))
        rows -= rows % 3 == 0
        return cls(rows, max(1, int(pixels / rows)))

    def view(self, array: NDArray[Any], reach: int) -> NDArray[Any]:
        """Return the pixels of an array (H, W) that are so far apart, and have neighbours on all sides."""
        top, left = self.first(reach)
        height, width = array.shape
        return array[top : height - reach : self.rows, left : width - reach : self.columns]

    def first(self, reach: int) -> tuple[int, int]:
        """Return the first row and column of these."""
        return reach + self.rows // 2, reach + self.columns // 2


@dataclass(frozen=True)
class Sample:
    """Valid pixels on a regular grid of a map, N, and every so many of them with neighbours, M.

    Attributes
    ----------
    grid : Grid
        Of x and y.
    x, y : ndarray of float32, shape (N,)
        Normalised coordinates (p and q of `Grid`), right and down.
    d : ndarray of float32, shape (N,)
        Disparity, px of the map's own unit; more than 0.
    tolerance : ndarray of float32, shape (N,)
        How far a road's disparity may be off here: matching noise and uneven ground, px.
    places : ndarray of int, shape (N,)
        Where each pixel is in the map, counted row by row.
    few : slice
        Which of the pixels planes are drawn through and judged by: M of them.
    column : ndarray of uint16, shape (M,)
        Their columns among those sampled.
    coherent : ndarray of bool, shape (M,)
        Whether half of the neighbours that are valid have the same disparity within tolerance: no noise.
    slopes : ndarray of float32, shape (2, M)
        Derivatives of d along x and y, px per unit, the mean of both sides, or the smaller one where these
        differ: the other may be an edge. Very large where no neighbour has data: that agrees with no road.
    noise : float
        The part of the tolerance that does not grow with the disparity, px.
    quantum : float
        The smallest step between neighbours, px: 1 in a map of whole pixels.
    disparity : ndarray, shape (H, W)
        The map.
    usable : ndarray of bool, shape (H, W), or None
        Its pixels that may be taken, where not all may.
    reach : int
        How far away neighbours are, and the border at least, px.
    spacing : Spacing
    lowest : float
        The y of the lowest row that is looked at.
    """

    grid: Grid
    x: Singles
    y: Singles
    d: Singles
    tolerance: Singles
    places: NDArray[np.intp]
    few: slice
    column: NDArray[np.uint16]
    coherent: Bools
    slopes: Singles
    noise: float
    quantum: float
    disparity: NDArray[Any]
    usable: Bools | None
    reach: int
    spacing: Spacing
    lowest: float

    @property
    def sides(self) -> tuple[float, float]:
        """How far the first column is to the left of the origin, and the last one to the right, units."""
        left = self.grid.centre_u / self.grid.scale
        return left, (self.disparity.shape[1] - 1) / self.grid.scale - left


def take_sample(
    disparity: NDArray[Any],
    usable: Bools | None,
    tuning: SampleTuning,
    middle: tuple[float, float] | None = None,
    aspect: float = 1.0,
) -> Sample:
    """Sample a map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Finite or NaN; <= 0 and NaN are no data.
    usable : ndarray of bool, shape (H, W), or None
        Pixels that may be taken; neighbours outside still count as neighbours.
    tuning : SampleTuning
    middle : tuple of float, optional
    aspect : float
        See `Request`.

    Returns
    -------
    Sample

    Raises
    ------
    EstimationError
        When the valid pixels are too few to look for a road among them, or lie in one row or column, or their
        disparities cannot be squared.
    """
    disparity = np.ascontiguousarray(disparity)
    height, width = disparity.shape
    grid, reach = Grid.of_shape(height, width, middle, aspect), reach_of(height, width, tuning)
    spacing, chosen = _chosen(disparity, usable, reach, tuning)
    lattice = _lattice(grid, height, width, reach, spacing)
    places, x, y, column = (each.take(chosen, mode="clip") for each in lattice)
    d = values_at(places, disparity)
    few = every(len(d), tuning.coarse_pixels)
    few_d = d[few].copy()
    sides = np.array([[-reach], [reach], [-reach * width], [reach * width]])  # left, right, up and down
    steps = steps_to(places[few] + sides, disparity, few_d)
    jumps, typical = np.abs(steps), quantile(few_d, 0.5)
    if not _SMALLEST < typical < _LARGEST:
        raise EstimationError(f"disparities of about {typical:g}: they have to be in pixels, or nearly so")
    known = jumps[1::2, ::2]
    known = known[(known > 0) & (known < NO_STEP)]
    quantum = quantile(known, 1 / 20) if len(known) else 0.0  # smaller ones are noise, or rounding of floats
    with_data = count(jumps < NO_STEP)
    for _ in range(2):  # again without the noise, which has another median
        noise = max(tuning.noise_share * typical, quantum / math.sqrt(12))
        tolerance = tolerances(few_d, noise, tuning)
        agree = count(jumps <= tolerance)
        coherent = (agree > 0) & (2 * agree >= with_data)
        if coherent.any():
            typical = quantile(few_d.compress(coherent), 0.5)
    return Sample(
        grid=grid,
        x=x,
        y=y,
        d=d,
        tolerance=tolerances(d, noise, tuning),
        places=places,
        few=few,
        column=column[few],
        coherent=coherent,
        slopes=_slopes(steps, _TWICE * np.maximum(tolerance, np.float32(quantum)))
        * np.float32(grid.scale / reach),
        noise=noise,
        quantum=quantum,
        disparity=disparity,
        usable=usable,
        reach=reach,
        spacing=spacing,
        lowest=float(lattice[2][-1]),
    )


def _chosen(
    disparity: NDArray[Any], usable: Bools | None, reach: int, tuning: SampleTuning
) -> tuple[Spacing, NDArray[np.intp]]:
    """Return a spacing, and which of the pixels so far apart are valid, counted row by row."""
    spacing = Spacing.of(disparity.size / tuning.pixels)
    while True:
        with np.errstate(invalid="ignore"):
            chosen = spacing.view(disparity, reach) > 0
        if usable is not None:
            chosen &= spacing.view(usable, reach)
        count = int(np.count_nonzero(chosen))
        if count >= tuning.pixels / 2 or spacing == (1, 1):
            break
        # finer, for the valid ones may be a grid themselves
        spacing = Spacing.of(spacing.rows * spacing.columns * max(count, LEAST_PIXELS) / tuning.pixels)
    rows, columns = rows_and_columns(chosen)
    if count < LEAST_PIXELS or min(rows, columns) < 2:
        found = f"{count} valid pixels away from the border, rows: {rows}, columns: {columns}"
        raise EstimationError(f"only {found}: too few to find a road in")
    return spacing, chosen.ravel().nonzero()[0]


@lru_cache(maxsize=4)
def _lattice(grid: Grid, height: int, width: int, reach: int, spacing: Spacing) -> tuple[NDArray[Any], ...]:
    """Return the places in the map, x, y and the column in the lattice of all pixels so far apart."""
    top, left = spacing.first(reach)
    v, u = np.arange(top, height - reach, spacing.rows), np.arange(left, width - reach, spacing.columns)
    x, y = (each.astype(np.float32) for each in grid.normalised(u, v))
    places, column = v[:, None] * width + u, np.arange(len(u), dtype=np.uint16)
    return tuple(np.broadcast_to(each, places.shape).ravel() for each in (places, x, y[:, None], column))


def every(count: int, pixels: int) -> slice:
    """Return a slice that takes about so many of a number of pixels, evenly."""
    return slice(None, None, max(1, round(count / pixels)))


def count(agreeing: Bools) -> NDArray[np.uint8]:
    """Return how many of a pixel's neighbours agree, (neighbours, N), ten times as fast as a sum of bool."""
    return np.asarray(agreeing.view(np.uint8).sum(0, dtype=np.uint8))


def quantile(values: NDArray[np.floating[Any]], part: float) -> float:
    """Return the value that this part of others is below; in a tenth of the time of `np.quantile`."""
    place, values = int(len(values) * part), values.copy()
    values.partition(place)
    return float(values[place])


def medians_of(place: NDArray[np.uint16], values: Singles, bins: int) -> list[float]:
    """Return the medians of values in bins, by the place of each; NaN where a bin has too few of them."""
    ordered = values[place.argsort(kind="stable")]
    ends = np.bincount(place, minlength=bins).cumsum().tolist()
    parts = (ordered[first:end] for first, end in pairwise((0, *ends)))
    return [quantile(part, 0.5) if len(part) >= _LEAST_VALUES else math.nan for part in parts]


def reach_of(height: int, width: int, tuning: SampleTuning) -> int:
    """Return how far away a pixel's neighbours are, px; a small map needs its border."""
    wanted = max(2, round(max(height, width) * tuning.reach))
    return min(wanted, max(1, min(height, width) // 8))


def tolerances(d: NDArray[Any], noise: float, tuning: SampleTuning) -> Singles:
    """Return how far each pixel of a road may be off, px."""
    return np.asarray(np.sqrt(np.float32(noise) ** 2 + np.square(np.float32(tuning.uneven_share) * d)))


def values_at(places: NDArray[np.intp], disparity: NDArray[Any]) -> Singles:
    """Return the disparities of a map at some places, counted row by row; all are inside."""
    with np.errstate(over="ignore", invalid="ignore"):
        values: Singles = disparity.reshape(-1).take(places, mode="clip").astype(np.float32, copy=False)
    return values


def steps_to(there: NDArray[np.intp], disparity: NDArray[Any], d: Singles) -> Singles:
    """Return how the disparity changes from pixels with d (N,) to others (M, N); `NO_STEP` to no data."""
    values = values_at(there, disparity)
    with np.errstate(invalid="ignore"):
        steps: Singles = np.where(values > 0, values - d, NO_STEP)
    return steps


def _slopes(steps: Singles, same: Singles) -> Singles:
    """Return how the disparity grows to the right and down, (2, M), from steps left, right, up and down."""
    before, after = -steps[::2], steps[1::2]
    with np.errstate(invalid="ignore"):  # neither has data
        mean = np.where(np.abs(before - after) <= same, (before + after) / 2, NO_STEP)
    slopes = np.where(np.abs(before) < np.abs(after), before, after)
    slopes = np.where(np.isfinite(mean), mean, slopes)
    return np.where(np.isfinite(slopes), slopes, _STEEP)
