"""What a drive says of a mounting value: the posterior under noise that is not known.

The car's and the road's own movement is AR(1) of unknown correlation and size, alone or with a faster one
on top, seen with each frame's own error. For every noise of a grid, levels and a line are fitted
by generalised least squares [Aitken 1936], with the likelihood of what is left once they are integrated out;
the normal distributions that follow are mixed by it. So there is an interval for few frames as for many, wide
where the noise could be slow.

One eigendecomposition a correlation makes every covariance of the grid diagonal: with R the correlations
and D the own variances, s^2 R + c D = D^1/2 Q (s^2 L + c) Q' D^1/2.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BISECTIONS = 40
_LEAST_PROBABILITY = 1e-6  # of the likeliest noise: what is less likely is left out
_ROOM = 3.0  # times the spread of the frames must fit into the grid


@dataclass(frozen=True, slots=True)
class SequenceTuning:
    """The numbers that the assessment of a sequence depends on, with the effects that were measured.

    Effects are those of `python tests/benchmarks/bench_rig.py` on the seeds that it tunes on.

    Attributes
    ----------
    gross : float
        Robust standard deviations from the neighbouring frames beyond which a frame is a gross outlier.
    neighbours : int
        Frames on each side whose median a frame is compared with; odd.
    sway : float
        95 % of a car's sway, in units of the quantity: of fewer than `fewest` frames none is gross that is
        nearer, for two of three are close by chance. Of drives of 3 frames that differ by 0.2
        degrees, 0.13 lost one, and 0.01 do. In 98 % of trials some of 30 drives of one rig, of 5
        frames each, differed without it, and in 3 % with it.
    least_error, most_error : float
        Smallest and largest own standard error of a frame, in units of the quantity: an interval of nothing
        must not take all the weight, and one of 1e7 of them made a covariance that has no inverse.
    correlations : tuple of float
        What of the car's and the road's own movement is left in the next cell: 0, and even in log correlation
        time.
    independent : float
        Prior probability of the first of them, as of single frames; the others are alike. With all alike (and
        a power of 0.25) the half-width of 20 frames that differ by 0.1 degrees, independently, was 0.26.
    slow : tuple of float
        What of a slow movement is left in the next cell that has a faster one on top.
    fast : tuple of (float, float)
        What of the faster one is left, and its period, cells: bumps, short waves, and a body that swings on
        its springs. One movement alone looks like the faster one: of 40 drives of 400 frames, 0.2 degrees
        each, half were covered, and 0.40 had a jump that is none; of 50 with two, 0.96 and 0.04.
    slow_share : float
        Of the variance of both, that of the slow one. With 0.5, drives of 120 frames that have one movement
        of a correlation of 0.5 have half-widths of 0.11 in place of 0.10, with 0.35 0.86 of drives with bumps
        are covered in place of 0.90.
    two : float
        Prior probability of two movements, of those with kinks. With all alike, 0.82 in place of 0.93 of
        drives of 8 frames and a correlation of 0.97 are covered.
    smooth_cells : tuple of float
        How far a movement without kinks reaches, cells, as of a body that sways on a road that banks slowly.
    smooth : float
        Prior probability of such a movement. Without it the drift's interval leaves out 0 in 0.42 of drives
        of 8 frames and in 0.38 of 20 that sway smoothly with a period of 40 frames, with it in 0.19 and 0.12.
        Of 8 frames that differ independently half-widths are 0.05 degrees more, of 60 and more none.
    spreads : tuple of float
        Least and most standard deviation of that movement, in units of the quantity; even in log between.
    spread_steps : int
        How many there are: at 13 neighbours differ by a factor of 1.5.
    spread_power : float
        The prior of a spread grows with this power of it, so that few frames do not hide a slow movement:
        intervals of 20 frames with a correlation of 0.97 cover 0.01 more than with half of it.
    error_factors, error_priors : tuple of float
        What the frames' own variances may have to be multiplied by, and the prior probability of it. Where
        they are right, doubting them widens intervals by nothing from 20 frames on. Steps of 4 above 1 would
        cover 0.83 in place of 0.96 of 120 frames whose errors are said three times too small.
    cells : int
        Stretches into which a longer drive is cut; their covariance is dense, so cost grows as the cube.
    fewest : int
        Frames below which there is no interval, but the spread of the frames.
    shortest : int
        Frames of the shortest stretch between two jumps, or between a jump and an end.
    shortest_share : float
        The same as a share of the drive: what is gone sooner is a bend of the road.
    jump_penalty : float
        Log odds against a jump at any one place, before the frames are seen.
    drift_penalty : float
        Log odds against a drift.
    most_jumps : int
        Jumps beyond which the search stops: a drive with more is not a mounted rig.
    """

    gross: float = 8.0
    neighbours: int = 7
    sway: float = 0.6
    least_error: float = 1e-3
    most_error: float = 1e4
    correlations: tuple[float, ...] = (
        *(0.0, 0.3, 0.5, 0.65, 0.75, 0.82, 0.87),
        *(0.91, 0.94, 0.96, 0.975, 0.985, 0.993),
    )
    independent: float = 1 / 3
    slow: tuple[float, ...] = (0.91, 0.96, 0.985, 0.993)
    fast: tuple[tuple[float, float], ...] = ((0.0, math.inf), (0.5, math.inf), (0.8, 7.0))
    slow_share: float = 0.4
    two: float = 0.15
    smooth_cells: tuple[float, ...] = (3.0, 6.0, 12.0)
    smooth: float = 0.2
    spreads: tuple[float, float] = (0.01, 1.0)
    spread_steps: int = 13
    spread_power: float = 0.5
    error_factors: tuple[float, ...] = (1 / 16, 1 / 4, 1, 3, 8, 16)
    error_priors: tuple[float, ...] = (0.1, 0.2, 0.4, 0.12, 0.1, 0.08)
    cells: int = 240
    fewest: int = 8
    shortest: int = 8
    shortest_share: float = 0.03
    jump_penalty: float = 5.0
    drift_penalty: float = 2.0
    most_jumps: int = 12

    @property
    def searched(self) -> int:
        """Frames that two stretches have: in fewer no jump and no drift is looked for."""
        return 2 * self.fewest

    def apart(self, frames: int) -> float:
        """Return how many frames two jumps of a drive are apart at least, and a jump and an end."""
        return max(self.shortest, self.shortest_share * frames)


TUNING = SequenceTuning()


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and how sure it is.

    Attributes
    ----------
    value : float or None
        In the unit of the series; None where nothing is known.
    ci95 : float or None
        Half-width of the 95 % interval; None where there are too few frames.
    """

    value: float | None = None
    ci95: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One quantity over the frames of one drive.

    Attributes
    ----------
    values : ndarray of float, shape (N,)
        0 where a frame is left out.
    variances : ndarray of float, shape (N,)
        The square of each frame's own standard error.
    used : ndarray of bool, shape (N,)
    """

    values: Floats
    variances: Floats
    used: Flags

    def part(self, first: int, end: int) -> "Series":
        """Return some of the frames."""
        return Series(self.values[first:end], self.variances[first:end], self.used[first:end])


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Weighted means of stretches of frames; where there are few frames, the frames themselves.

    Attributes
    ----------
    first : ndarray of int, shape (C,)
        The first frame of each cell; cells without a frame that is used are left out.
    centres : ndarray of float, shape (C,)
        Frames.
    width : int
        Frames of a cell.
    values, variances : ndarray of float, shape (C,)
    frames : int
        Of the drive.
    """

    first: NDArray[np.intp]
    centres: Floats
    width: int
    values: Floats
    variances: Floats
    frames: int

    def design(self, starts: Sequence[int], drift: bool) -> Floats:
        """Return the level of each stretch between jumps, shape (C, stretches).

        If asked for, the drift is a further column; levels are then drawn out to the last frame of the drive.
        """
        stretch = np.searchsorted(np.asarray(starts), self.first, side="right")
        columns: Floats = (stretch[:, None] == np.arange(len(starts) + 1)).astype(float)
        return np.column_stack([columns, self.share(self.centres)]) if drift else columns

    def share(self, frame: Any) -> Any:
        """Return the share of the drive that lies between its last frame and this one; of frames alike."""
        return (frame - (self.frames - 1)) / max(self.frames - 1, 1)


def make_cells(series: Series, starts: Sequence[int] = (), most: int = TUNING.cells) -> Cells:
    """Average a series in at most so many cells, and one more for each jump: no cell reaches across one."""
    count = len(series.values)
    width = max(1, -(-count // most))
    edges = np.unique(np.concatenate([np.arange(0, count, width), np.asarray(starts, dtype=np.intp)]))
    spread = float(np.var(series.values[series.used])) if width > 1 else 0.0
    weights = np.where(series.used, 1 / (series.variances + spread), 0.0)
    total = np.add.reduceat(weights, edges)
    there = total > 0
    frames = np.arange(count, dtype=float)
    values, centres = (
        np.add.reduceat(weights * each, edges)[there] / total[there] for each in (series.values, frames)
    )
    variances = np.add.reduceat(weights**2 * series.variances, edges)[there] / total[there] ** 2
    return Cells(edges[there], centres, width, values, variances, count)


@cache
def _normal() -> tuple[Floats, Floats]:
    """Return the normal distribution at steps of a thousandth of its deviation."""
    at = np.linspace(-9, 9, 18_001)
    return at, np.array(list(map(NormalDist().cdf, at.tolist())))


def _below(deviations: Floats) -> Floats:
    """Return the share of a normal distribution below so many of its deviations, to 3e-8."""
    return np.interp(deviations, *_normal())


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Coefficients for every noise of the grid; the grid has the shape (P, G).

    Attributes
    ----------
    beta : ndarray of float, shape (P, G, M)
    covariance : ndarray of float, shape (P, G, M, M)
    log_evidence : ndarray of float, shape (P, G)
        Of the noise and the design; coefficients beyond the first have the prior of one unit, or of the
        cells' spread where that is more.
    """

    beta: Floats
    covariance: Floats
    log_evidence: Floats

    @property
    def evidence(self) -> float:
        """The logarithm of the likelihood of the design, whatever the noise."""
        return float(np.logaddexp.reduce(self.log_evidence, axis=None))

    def estimate(self, contrast: Sequence[float] | Floats) -> Estimate:
        """Return a combination of the coefficients, with the 95 % interval of the mixture."""
        share = np.exp(self.log_evidence - self.log_evidence.max()).ravel()
        kept = share > _LEAST_PROBABILITY
        share = share[kept] / share[kept].sum()
        row = np.asarray(contrast, dtype=float)
        means = (self.beta @ row).ravel()[kept]
        deviations = np.sqrt(np.maximum(self.covariance @ row @ row, 1e-300)).ravel()[kept]
        middle = float(share @ means)
        low, high = 0.0, float(np.abs(means - middle).max() + 9 * deviations.max())
        for _ in range(_BISECTIONS):
            half = (low + high) / 2
            above, below = ((middle + side * half - means) / deviations for side in (1, -1))
            inside = float(share @ (_below(above) - _below(below)))
            low, high = (low, half) if inside > 0.95 else (half, high)
        return Estimate(middle, high)


def correlations_at(cells: Floats) -> Floats:
    """Return the correlations of the grid at distances of so many cells, shape (P, ...).

    First those of one movement, independent frames before the others; then those of two; then smooth ones
    [Matern 3/2: Rasmussen, Williams 2006, eq. 4.17].
    """
    alone = [each**cells for each in TUNING.correlations]
    faster = [each**cells * np.cos(2 * math.pi / period * cells) for each, period in TUNING.fast]
    share = TUNING.slow_share
    both = (share * slow**cells + (1 - share) * each for slow in TUNING.slow for each in faster)
    smooth = [(1 + cells / reach) * np.exp(-cells / reach) for reach in TUNING.smooth_cells]
    return np.stack([*alone, *both, *smooth])


def _priors() -> Floats:
    """Return the prior probability of each of `correlations_at`, shape (P,)."""
    kinked = 1 - TUNING.smooth
    alone, two = kinked * (1 - TUNING.two), kinked * TUNING.two
    kinds = (
        (1, alone * TUNING.independent),
        (len(TUNING.correlations) - 1, alone * (1 - TUNING.independent)),
        (len(TUNING.slow) * len(TUNING.fast), two),
        (len(TUNING.smooth_cells), TUNING.smooth),
    )
    return np.concatenate([np.full(count, share / count) for count, share in kinds])


class Likelihood:
    """The likelihood of cells for every noise of the grid.

    Parameters
    ----------
    cells : Cells
    unit : float
        Of the quantity: what of it is as much as a degree of an angle.
    """

    def __init__(self, cells: Cells, unit: float = 1.0) -> None:
        places = cells.centres / cells.width
        distance = np.abs(places[:, None] - places)
        correlations = correlations_at(distance)
        root = 1 / np.sqrt(cells.variances)
        values, vectors = np.linalg.eigh(correlations * root[:, None] * root)
        self._rotate = np.swapaxes(vectors, 1, 2) * root  # (P, C, C): Q' D^-1/2
        low, high = TUNING.spreads
        spread = float(np.std(cells.values))
        largest = max(high * unit, _ROOM * spread)
        squares = np.geomspace(low * unit, largest, TUNING.spread_steps)[:, None] ** 2
        slow, own = (each.ravel()[:, None] for each in np.broadcast_arrays(squares, TUNING.error_factors))
        self._weights = 1 / (slow * np.maximum(values, 0)[:, None, :] + own)  # (P, G, C)
        priors = TUNING.spread_power / 2 * np.log(squares) + np.log(TUNING.error_priors)
        self._base = np.log(_priors())[:, None] + priors.ravel() + np.log(self._weights).sum(-1) / 2
        self.cells, self.unit = cells, unit
        # wider noise leaves a step or a line open by more than a unit, which would speak for it
        self._prior = math.log(max(unit, spread))
        self._values = self.rotated(cells.values[:, None])

    def rotated(self, columns: Floats) -> Floats:
        """Return columns in the coordinates in which all covariances are diagonal, shape (P, C, M)."""
        return np.asarray(self._rotate @ columns)

    def fit(self, design: Floats) -> Fit:
        """Fit the columns of a design, shape (C, M), for every noise; without evidence where they depend."""
        if np.linalg.matrix_rank(design) < design.shape[1]:
            grid, size = self._base.shape, design.shape[1]
            return Fit(np.zeros((*grid, size)), np.zeros((*grid, size, size)), np.full(grid, -np.inf))
        columns = self.rotated(design)
        normal = self._products(columns[..., :, None] * columns[..., None, :])
        pull = self._products(columns * self._values)
        covariance = np.asarray(np.linalg.inv(normal))
        beta = (covariance @ pull[..., None])[..., 0]
        left = self._products(self._values**2)[..., 0] - (beta * pull).sum(-1)
        determinant = np.linalg.slogdet(normal)[1]
        priors = (design.shape[1] - 1) * self._prior
        return Fit(beta, covariance, self._base - left / 2 - determinant / 2 - priors)

    def scan(self, design: Floats, fit: Fit) -> Floats:
        """Return the evidence of one more step, at the beginning of each cell, shape (C,)."""
        steps, columns = self._steps, self.rotated(design)
        left = self._products(steps * self._values)  # (P, G, C)
        own = self._own_of_steps.copy()
        crossed = np.stack(
            [self._products(steps * columns[..., place, None]) for place in range(design.shape[1])], -1
        )
        left -= (crossed * fit.beta[:, :, None, :]).sum(-1)
        own -= ((crossed @ fit.covariance) * crossed).sum(-1)
        known = own > 1e-9 * self._own_of_steps.max(axis=-1, keepdims=True)
        safe = np.where(known, own, 1.0)
        gain = np.where(known, left**2 / safe / 2 - np.log(safe) / 2 - self._prior, -np.inf)
        return np.asarray(np.logaddexp.reduce(fit.log_evidence[..., None] + gain, axis=(0, 1)))

    def pairs(self, design: Floats, fit: Fit) -> Floats:
        """Return the gain of two more steps in log likelihood, shape (C, C), with the likeliest noise.

        A rise and a fall that cancel are not seen by one step alone.
        """
        at, noise = np.unravel_index(int(fit.log_evidence.argmax()), fit.log_evidence.shape)
        weights = self._weights[at, noise][:, None]
        steps, columns = self._steps[at], self.rotated(design)[at]
        crossed = steps.T @ (weights * columns)
        left = steps.T @ (weights * self._values[at])[:, 0] - crossed @ fit.beta[at, noise]
        normal = steps.T @ (weights * steps) - crossed @ fit.covariance[at, noise] @ crossed.T
        own = np.diagonal(normal)
        determinant = own[:, None] * own - normal**2
        safe = determinant > 1e-9 * own[:, None] * own
        squares = left[:, None] ** 2 * own + left**2 * own[:, None] - 2 * np.outer(left, left) * normal
        return np.where(safe, squares / np.where(safe, determinant, 1.0) / 2, -np.inf)

    @cached_property
    def _steps(self) -> Floats:
        return np.asarray(np.cumsum(self._rotate[..., ::-1], axis=-1)[..., ::-1])

    @cached_property
    def _own_of_steps(self) -> Floats:
        return self._products(self._steps**2)

    def _products(self, columns: Floats) -> Floats:
        """Weigh products of rotated columns, shape (P, C, ...), for every noise: (P, G, ...)."""
        flat = self._weights @ columns.reshape(*columns.shape[:2], -1)
        return np.asarray(flat.reshape(*flat.shape[:2], *columns.shape[2:]))
