"""A sample of a map's pixels on a regular grid, and how the disparity changes from each to its neighbours."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Grid
from rollcli.estimator.tuning import ROAD_TUNING, RoadTuning, SampleTuning

Singles = NDArray[np.float32]


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


def strided(array: NDArray[Any], reach: int, spacing: Spacing) -> NDArray[Any]:
    """Return a view of the pixels so far apart that have neighbours at `reach` on all sides."""
    height, width = array.shape
    top, left = _first(reach, spacing)
    return array[top : height - reach : spacing.rows, left : width - reach : spacing.columns]


class Lattice(NamedTuple):
    """All pixels that can be sampled, row by row; arrays as in `Sample` and `CoarseSample`."""

    places: NDArray[np.intp]
    column: NDArray[np.uint16]
    x: Singles
    y: Singles


@lru_cache(maxsize=4)
def lattice_of(height: int, width: int, reach: int, spacing: Spacing) -> Lattice:
    """Lay out the pixels of maps of one size; most maps of a batch have the same."""
    grid, (top, left) = Grid.of_shape(height, width), _first(reach, spacing)
    v, u = np.arange(top, height - reach, spacing.rows), np.arange(left, width - reach, spacing.columns)
    x, y = (u - grid.centre_u) / grid.scale, (v - grid.centre_v) / grid.scale
    places = v[:, None] * width + u
    column = np.broadcast_to(np.arange(len(u)).astype(np.uint16), places.shape)
    x_of, y_of = (np.broadcast_to(each, places.shape) for each in (x, y[:, None]))
    return Lattice(
        places.ravel(), column.ravel(), *(each.astype(np.float32).ravel() for each in (x_of, y_of))
    )


def _first(reach: int, spacing: Spacing) -> tuple[int, int]:
    """Return the first row and column that are sampled."""
    rows, columns = (reach + (each // 2) % each for each in spacing)
    return rows, columns


NO_SLOPE = np.float32(np.inf)  # agrees with no road
_TOWARDS = np.array([[-1], [1], [-1], [1]], np.float32)  # left, right, up and down along x or y


def to_sides(reach: int, width: int) -> NDArray[np.intp]:
    """Return how far the neighbours of a pixel are, counted row by row: left, right, up and down, (4, 1)."""
    down = reach * width
    return np.array([[-reach], [reach], [-down], [down]])


def steps_to(there: NDArray[np.intp], disparity: NDArray[Any], d: Singles) -> Singles:
    """Return how the disparity changes from some pixels to others.

    Parameters
    ----------
    there : ndarray of int, shape (M, N)
        Where M others of each are in the map, counted row by row.
    disparity : ndarray, shape (H, W)
        The map; contiguous, or this takes time.
    d : ndarray of float32, shape (N,)
        The disparities of the pixels.

    Returns
    -------
    ndarray of float32, shape (M, N)
        px; `NO_SLOPE` where the other is no data.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps: Singles = disparity.reshape(-1).take(there, mode="clip").astype(np.float32, copy=False)
        unknown = ~(steps > 0)
    steps -= d
    np.copyto(steps, NO_SLOPE, where=unknown)
    return steps


def to_slopes(steps: Singles, per_unit: float) -> Singles:
    """Return the one-sided derivatives (4, N) along x and y, from steps over 1 / per_unit units."""
    slopes: Singles = steps * (_TOWARDS * np.float32(per_unit))
    return slopes


def rising(slopes: Singles) -> NDArray[np.bool_]:
    """Return where the disparity grows downward, above the pixel or below it."""
    grows = slopes[2:] > 0
    grows &= slopes[2:] < NO_SLOPE
    either: NDArray[np.bool_] = grows[0] | grows[1]
    return either


def count_true(agreeing: NDArray[np.bool_]) -> Singles:
    """Return how many of a pixel's neighbours agree, from bool (neighbours, N)."""
    counts: NDArray[np.uint8] = agreeing.view(np.uint8).sum(0, dtype=np.uint8)  # a sum of bool takes longer
    return counts.astype(np.float32)


def smallest_step(jumps: Singles, part: int) -> float:
    """Return the 1/part quantile of the steps to the right and down, px: 0 if there are none."""
    some: Singles = jumps[1::2, ::2].ravel()
    some = some.compress((some > 0) & (some < NO_SLOPE))
    place = len(some) // part
    return float(np.partition(some, place)[place]) if len(some) else 0.0


_SMALLEST, _LARGEST = 1e-12, 1e12  # typical disparities whose squares single precision can add up


@dataclass(frozen=True)
class CoarseSample:
    """The pixels of a sample that planes are drawn through and judged by; arrays of shape (M,) unless said.

    Attributes
    ----------
    x, y, d, tolerance : ndarray of float32
        As in `Sample`.
    column : ndarray of uint16
        Column of each pixel among all that are sampled; of this type a sort takes a quarter of the time.
    coherence : ndarray of float32
        The share of the valid ones among four neighbours whose disparity is within tolerance.
    slopes : ndarray of float32, shape (4, M)
        One-sided derivatives of d to the left, right, up and down, px per unit of x or y; infinite where the
        neighbour is no data.
    """

    x: Singles
    y: Singles
    d: Singles
    tolerance: Singles
    column: NDArray[np.uint16]
    coherence: Singles
    slopes: Singles


@dataclass(frozen=True)
class Sample:
    """Valid pixels on a regular grid of a map; arrays of shape (N,) unless said otherwise.

    Attributes
    ----------
    grid : Grid
        Of x and y.
    x, y : ndarray of float32
        Normalised coordinates (p and q of `Grid`), right and down.
    d : ndarray of float32
        Disparity, px of the map's own unit; more than 0.
    tolerance : ndarray of float32
        How far a road's disparity may be off here: matching noise and uneven ground, px.
    typical : float
        The median disparity, px.
    noise : float
        The part of it that does not grow with the disparity, px.
    places : ndarray of int
        Where each pixel is in the map, counted row by row.
    coarse : CoarseSample
        Every so many of the pixels, with their neighbours.
    pitch : float
        Distance between neighbouring columns of the sample, units of x.
    quantum : float
        The smallest step between neighbours, px: 1 in a map of whole pixels.
    disparity : ndarray, shape (H, W)
        The map.
    usable : ndarray of bool, shape (H, W), or None
        Its pixels that may be taken, where not all may.
    reach : int
        How far every pixel is from the border at least, px.
    spacing : Spacing
    tuning : RoadTuning
        The numbers by which the map was sampled, and by which its road is to be found.
    """

    grid: Grid
    x: Singles
    y: Singles
    d: Singles
    tolerance: Singles
    typical: float
    noise: float
    places: NDArray[np.intp]
    coarse: CoarseSample
    pitch: float
    quantum: float
    disparity: NDArray[Any]
    usable: NDArray[np.bool_] | None
    reach: int
    spacing: Spacing
    tuning: RoadTuning

    @property
    def slope_noise(self) -> float:
        """What the noise makes of a slope, px per unit."""
        return self.noise * self.grid.scale / self.reach


def take_sample(
    disparity: NDArray[Any], usable: NDArray[np.bool_] | None = None, tuning: RoadTuning = ROAD_TUNING
) -> Sample:
    """Sample a map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Finite or NaN; <= 0 and NaN are no data.
    usable : ndarray of bool, shape (H, W), optional
        Pixels that may be taken; neighbours outside still count as neighbours.
    tuning : RoadTuning

    Returns
    -------
    Sample

    Raises
    ------
    EstimationError
        When too few pixels are valid to look for a road among them, or their disparities cannot be squared.
    """
    height, width = disparity.shape
    grid = Grid.of_shape(height, width)
    numbers = tuning.sample
    reach = reach_of(height, width, numbers)
    spacing = Spacing.of(height * width / numbers.pixels)
    chosen = _chosen(disparity, usable, reach, spacing)
    enough = min(numbers.sparse_share, numbers.finer_share) * numbers.pixels  # each round has to be finer
    while len(chosen) < enough and spacing != (1, 1):  # the valid ones may be a grid
        share = max(len(chosen), numbers.least_pixels) / (numbers.finer_share * numbers.pixels)
        spacing = Spacing.of(spacing.rows * spacing.columns * share)
        chosen = _chosen(disparity, usable, reach, spacing)
    if len(chosen) < numbers.least_pixels:
        raise EstimationError(
            f"only {len(chosen)} valid pixels away from the border: too few to find a road in"
        )
    disparity = np.ascontiguousarray(disparity)
    lattice = lattice_of(height, width, reach, spacing)
    places = lattice.places.take(chosen, mode="clip")  # no index is out of bounds, and none is looked for
    with np.errstate(over="ignore"):
        d: Singles = disparity.reshape(-1).take(places, mode="clip").astype(np.float32, copy=False)
    few = every(len(d), numbers.coarse_pixels)
    few_d = d[few].copy()
    typical = _median(few_d)
    if not _SMALLEST < typical < _LARGEST:
        raise EstimationError(f"disparities of about {typical:g}: they have to be in pixels, or nearly so")
    steps = steps_to(places[few] + to_sides(reach, width), disparity, few_d)
    jumps = np.abs(steps)
    quantum = smallest_step(jumps, numbers.quantum_part)
    noise = _noise(typical, quantum, numbers)
    near = jumps <= np.maximum(
        _tolerance(few_d, noise, numbers), np.float32(numbers.coherent_share * typical)
    )
    coherence = count_true(near)
    coherence /= np.maximum(count_true(jumps < NO_SLOPE), 1)
    coherent = few_d.compress(coherence >= numbers.coherent_from)
    if len(coherent):  # again, without the noise, which has another median
        typical = _median(coherent)
        noise = _noise(typical, quantum, numbers)
    tolerance = _tolerance(d, noise, numbers)
    x, y = (each.take(chosen, mode="clip") for each in (lattice.x, lattice.y))
    coarse = CoarseSample(
        x=x[few],
        y=y[few],
        d=few_d,
        tolerance=tolerance[few],
        column=lattice.column.take(chosen[few]),
        coherence=coherence,
        slopes=to_slopes(steps, grid.scale / reach),
    )
    return Sample(
        grid=grid,
        x=x,
        y=y,
        d=d,
        tolerance=tolerance,
        typical=typical,
        noise=noise,
        places=places,
        coarse=coarse,
        pitch=spacing.columns / grid.scale,
        quantum=quantum,
        disparity=disparity,
        usable=usable,
        reach=reach,
        spacing=spacing,
        tuning=tuning,
    )


def every(count: int, pixels: int) -> slice:
    """Return a slice that takes about so many of a number of pixels, evenly."""
    return slice(None, None, max(1, round(count / pixels)))


def reach_of(height: int, width: int, numbers: SampleTuning) -> int:
    """Return how far away a pixel's neighbours are looked for, px."""
    wanted = max(numbers.neighbour_least, round(max(height, width) / numbers.neighbour_part))
    return min(numbers.neighbour_most, wanted, max(1, min(height, width) // numbers.border_part))


def _chosen(
    disparity: NDArray[Any], usable: NDArray[np.bool_] | None, reach: int, spacing: Spacing
) -> NDArray[np.intp]:
    """Return which pixels of the lattice may be taken."""
    with np.errstate(invalid="ignore"):
        chosen: NDArray[np.bool_] = strided(disparity, reach, spacing) > 0
    if usable is not None:
        chosen &= strided(usable, reach, spacing)
    return chosen.ravel().nonzero()[0]


def _median(values: Singles) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def _noise(typical: float, quantum: float, numbers: SampleTuning) -> float:
    """Return what matching and rounding get wrong at any disparity, px."""
    return max(numbers.noise_share * typical, numbers.quantum_share * quantum)


def _tolerance(d: Singles, noise: float, numbers: SampleTuning) -> Singles:
    """Return how far each pixel of a road may be off, px."""
    tolerance: Singles = np.sqrt(np.float32(noise) ** 2 + np.square(np.float32(numbers.uneven_share) * d))
    return tolerance
