"""A sample of a map's pixels, each with its tolerance, its agreement with its neighbours, and slopes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Grid
from rollcli.estimator.road.tuning import ROAD_TUNING, RoadTuning, SampleTuning

Singles = NDArray[np.float32]

_SMALLEST, _LARGEST = 1e-12, 1e12  # typical disparities whose squares single precision can add up
NO_SLOPE = np.float32(np.inf)  # agrees with no road


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
    coherence : ndarray of float32
        The share of the valid ones among four neighbours whose disparity is within tolerance.
    slopes : ndarray of float32, shape (4, N)
        One-sided derivatives of d to the left, right, up and down, px per unit of x or y; infinite
        where the neighbour is no data.
    slope_noise : float
        What the noise makes of a slope, px per unit.
    row : ndarray of int
        Row of each pixel among the sampled ones.
    column : ndarray of uint16
        Column of each pixel among the sampled ones.
    pitch : float
        Distance between neighbouring columns of the sample, units of x.
    quantum : float
        The smallest step between neighbours, px: 1 in a map of whole pixels.
    disparity : ndarray, shape (H, W)
        The map.
    usable : ndarray of bool, shape (H, W), or None
        Its pixels that may be taken, where not all may.
    reach, step : int
        How far every pixel is from the border at least, and how far apart they are, px.
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
    coherence: Singles
    slopes: Singles
    slope_noise: float
    row: NDArray[np.intp]
    column: NDArray[np.uint16]
    pitch: float
    quantum: float
    disparity: NDArray[Any]
    usable: NDArray[np.bool_] | None
    reach: int
    step: int
    tuning: RoadTuning

    def about(self, pixels: int) -> slice:
        """Return a slice that takes about so many of the pixels, evenly."""
        return slice(None, None, max(1, round(len(self.d) / pixels)))

    def places(self, some: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return where some of the pixels are in the map, counted row by row."""
        width = self.disparity.shape[1]
        first = _first(self.reach, self.step) * (width + 1)
        places: NDArray[np.intp] = self.row[some] * width
        places += self.column[some]
        places *= self.step
        places += first
        return places


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
    step = _step(math.sqrt(height * width / numbers.pixels))
    taken = _taken(disparity, usable, reach, step)
    count = int(np.count_nonzero(taken))
    if count < numbers.sparse_share * numbers.pixels and step > 1:
        aimed = numbers.finer_share * numbers.pixels
        step = _step(step * math.sqrt(max(count, numbers.least_pixels) / aimed))
        taken = _taken(disparity, usable, reach, step)
    chosen = np.flatnonzero(taken)
    if len(chosen) < numbers.least_pixels:
        raise EstimationError(
            f"only {len(chosen)} valid pixels away from the border: too few to find a road in"
        )
    first = _first(reach, step)

    def at(dv: int, du: int) -> "NDArray[Any]":  # evaluated at each call, it would take time
        return _strided(disparity, reach, step, dv, du).ravel()[chosen]

    rows = chosen // taken.shape[1]  # divmod would take longer
    columns = chosen - rows * taken.shape[1]
    with np.errstate(over="ignore"):
        d = at(0, 0).astype(np.float32, copy=False)
    typical = _median(d)
    if not _SMALLEST < typical < _LARGEST:
        raise EstimationError(f"disparities of about {typical:g}: they have to be in pixels, or nearly so")
    steps = _steps(d, at(0, -reach), at(0, reach), at(-reach, 0), at(reach, 0))
    jumps = np.abs(steps)
    known = jumps < NO_SLOPE
    quantum = _quantum(jumps, numbers)
    noise, tolerance = _tolerance(d, typical, quantum, numbers)
    near = jumps <= np.maximum(tolerance, np.float32(numbers.coherent_share * typical))
    coherence = count_true(near)
    coherence /= np.maximum(count_true(known), 1)
    coherent = d.compress(coherence >= numbers.coherent_from)
    if len(coherent):  # again, without the noise, which has another median
        noise, tolerance = _tolerance(d, typical := _median(coherent), quantum, numbers)
    per_unit = grid.scale / reach
    steps *= np.array([-per_unit, per_unit, -per_unit, per_unit], np.float32)[:, None]
    xs = (np.arange(first, width, step) - grid.centre_u) / grid.scale
    ys = (np.arange(first, height, step) - grid.centre_v) / grid.scale
    return Sample(
        grid=grid,
        x=xs.astype(np.float32)[columns],
        y=ys.astype(np.float32)[rows],
        d=d,
        tolerance=tolerance,
        typical=typical,
        noise=noise,
        coherence=coherence,
        slopes=steps,
        slope_noise=noise * per_unit,
        row=rows,
        column=columns.astype(np.uint16),
        pitch=step / grid.scale,
        quantum=quantum,
        disparity=disparity,
        usable=usable,
        reach=reach,
        step=step,
        tuning=tuning,
    )


def rising(slopes: Singles) -> NDArray[np.bool_]:
    """Return where the disparity grows downward, above the pixel or below it."""
    up, down = slopes[2:]
    grows: NDArray[np.bool_] = ((up > 0) & (up < NO_SLOPE)) | ((down > 0) & (down < NO_SLOPE))
    return grows


def reach_of(height: int, width: int, numbers: SampleTuning) -> int:
    """Return how far away a pixel's neighbours are looked for, px."""
    wanted = max(numbers.neighbour_least, round(max(height, width) / numbers.neighbour_part))
    return min(numbers.neighbour_most, wanted, max(1, min(height, width) // numbers.border_part))


def _step(wanted: float) -> int:
    """Return how many rows and columns apart pixels are sampled: as many as wanted, but no multiple of 3.

    Matchers prefer whole pixels, and from row to row a road's disparity grows by baseline over camera height,
    which is about a third of a pixel in most cars: every third row has the same part of that error.
    """
    step = max(1, int(wanted))
    return step - (step % 3 == 0)


def _first(reach: int, step: int) -> int:
    """Return the first row and column that is sampled."""
    return reach + (step // 2) % step


def _strided(array: NDArray[Any], reach: int, step: int, dv: int = 0, du: int = 0) -> NDArray[Any]:
    """Return every step-th pixel, moved by (dv, du), that has neighbours at `reach` on all sides."""
    height, width = array.shape
    first = _first(reach, step)
    return array[first + dv : height - reach + dv : step, first + du : width - reach + du : step]


def _taken(
    disparity: NDArray[Any], usable: NDArray[np.bool_] | None, reach: int, step: int
) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        taken: NDArray[np.bool_] = _strided(disparity, reach, step) > 0
    return taken if usable is None else taken & _strided(usable, reach, step)


def _steps(d: Singles, *around: NDArray[Any]) -> Singles:
    """Return the differences to the neighbours, NO_SLOPE where there is none: shape (neighbours, N)."""
    steps = np.empty((len(around), len(d)), np.float32)
    for row, neighbour in zip(steps, around, strict=True):
        row[:] = neighbour
    with np.errstate(invalid="ignore"):
        unknown = ~(steps > 0)
    steps -= d
    np.copyto(steps, NO_SLOPE, where=unknown)
    return steps


def count_true(agreeing: NDArray[np.bool_]) -> Singles:
    """Return how many of a pixel's neighbours agree, from bool (neighbours, N)."""
    counts: NDArray[np.uint8] = agreeing.view(np.uint8).sum(0, dtype=np.uint8)  # a sum of bool takes longer
    return counts.astype(np.float32)


def _median(values: Singles) -> float:
    few = values[::4]  # it is a scale: all would take time
    middle = len(few) // 2
    return float(np.partition(few, middle)[middle])


def _tolerance(d: Singles, typical: float, quantum: float, numbers: SampleTuning) -> tuple[float, Singles]:
    """Return the noise, px, and the tolerance of each pixel."""
    noise = max(numbers.noise_share * typical, numbers.quantum_share * quantum)
    tolerance: Singles = np.sqrt(np.float32(noise) ** 2 + np.square(np.float32(numbers.uneven_share) * d))
    return noise, tolerance


def _quantum(jumps: Singles, numbers: SampleTuning) -> float:
    """Return the smallest step between neighbours (5th percentile): 1 in a map of whole pixels, 0 if none."""
    some: Singles = jumps[1::2, ::4].ravel()
    some = some.compress((some > 0) & (some < NO_SLOPE))
    place = len(some) // numbers.quantum_part
    return float(np.partition(some, place)[place]) if len(some) else 0.0
