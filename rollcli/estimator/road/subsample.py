"""A sample of a map's pixels: all for the fit, and fewer, with their neighbours, for finding the road."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Grid
from rollcli.estimator.road.lattice import Spacing, lattice_of, strided
from rollcli.estimator.road.neighbours import (
    NO_SLOPE,
    Singles,
    count_true,
    smallest_step,
    steps_to,
    to_sides,
    to_slopes,
)
from rollcli.estimator.road.tuning import ROAD_TUNING, RoadTuning, SampleTuning

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
