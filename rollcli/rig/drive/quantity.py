"""One quantity over one drive: its mounting value, its drift and its jumps, with intervals that hold.

Frames of a drive repeat each other: the car rolls and the road turns for many frames, so that an interval of
independent frames covers 5 to 30 % instead of 95. Blocks of several correlation lengths are independent.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rollcli.rig.drive.jumps import Fit, Series, bounds_of, fit_residuals, place_jump, search
from rollcli.rig.drive.noise import (
    Estimate,
    Floats,
    Noise,
    block_count,
    frames_needed,
    gross_outliers,
    hidden,
    make_blocks,
    mean_of_blocks,
    t_quantile,
)
from rollcli.rig.drive.tuning import TUNING

Status = Literal["stable", "drift", "jump", "few"]


@dataclass(frozen=True, slots=True)
class Jump:
    """A change of the mounting value from one frame to the next.

    Attributes
    ----------
    frame : int
        The first frame after it, from 0.
    change : Estimate
        How much is added.
    """

    frame: int
    change: Estimate


@dataclass(frozen=True, slots=True)
class Segment:
    """Frames between two jumps.

    Attributes
    ----------
    first, last : int
        Frames, both included, from 0.
    used : int
        Frames that the mean is taken of.
    mean : Estimate
    """

    first: int
    last: int
    used: int
    mean: Estimate


@dataclass(frozen=True, slots=True, eq=False)
class SequenceAssessment:
    """What the frames of one drive say about one quantity of the rig.

    Attributes
    ----------
    frames, used, outliers : int
        Frames of the drive; those that count; those left out since they are far off their neighbours.
    segments : tuple of Segment
        One more than there are jumps.
    jumps : tuple of Jump
    drift : Estimate
        Change from the first frame to the last, jumps aside.
    drifts : bool
        Whether a line explains the frames better than chance, and better than jumps.
    status : {"stable", "drift", "jump", "few"}
        few: too few frames for an interval, or none.
    between_sd : float or None
        Standard deviation between frames, beyond their own errors.
    noise : Noise or None
        How frames are correlated; None without frames.
    values, weights : ndarray of float, shape (N,)
        What was assessed: 0 where a frame is left out.
    """

    frames: int
    used: int
    outliers: int
    segments: tuple[Segment, ...]
    jumps: tuple[Jump, ...]
    drift: Estimate
    drifts: bool
    status: Status
    between_sd: float | None
    noise: Noise | None
    values: Floats
    weights: Floats

    def mean_over(self, first: int, last: int) -> Estimate:
        """Return the mean of some frames, both ends included; with the interval of their blocks."""
        if self.noise is None:
            return Estimate()
        part = slice(first, last + 1)
        return mean_of_blocks(self.values[part], self.weights[part], self.noise)

    @property
    def now(self) -> Estimate:
        """The mean of the last segment: the rig as it is at the end of the drive."""
        return self.segments[-1].mean if self.segments else Estimate()


def assess_sequence(values: ArrayLike, errors: ArrayLike) -> SequenceAssessment:
    """Assess one quantity over the frames of one drive.

    Parameters
    ----------
    values : array_like of float, shape (N,)
        In the order of the frames; NaN where a frame is left out.
    errors : array_like of float, shape (N,)
        Standard error of each value, in its unit; NaN where it is not known, which takes the others' median.

    Returns
    -------
    SequenceAssessment

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> found = assess_sequence(rng.normal(1.0, 0.1, 400), np.full(400, 0.05))
    >>> found.status, round(found.now.value, 1)
    ('stable', 1.0)
    """
    given = np.asarray(values, dtype=float)
    series, outliers = _prepared(given, np.asarray(errors, dtype=float))
    if not series.used.any():
        none = np.zeros(len(given))
        return SequenceAssessment(
            len(given), 0, outliers, (), (), Estimate(), False, "few", None, None, none, none
        )
    short, width = _thinned(series)
    found = search(short)
    starts = [place_jump(series, found, place, width) for place in range(len(found.starts))]
    return _assessment(series, outliers, found, starts, width)


def _prepared(values: Floats, errors: Floats) -> tuple[Series, int]:
    """Zeros where nothing is used, errors where none is known, and gross outliers left out."""
    used = np.isfinite(values)
    known = np.isfinite(errors) & (errors >= 0)
    usual = float(np.median(errors[known & used])) if (known & used).any() else 0.0
    own = np.maximum(np.where(known, errors, usual), TUNING.least_error) ** 2
    gross = np.zeros(len(values), dtype=bool)
    gross[used] = gross_outliers(values[used], own[used])
    kept = used & ~gross
    return Series(np.where(kept, values, 0.0), own, kept), int(gross.sum())


def _thinned(series: Series) -> tuple[Series, int]:
    """Averages of neighbours, where frames are too many to search one by one; and how many make one."""
    width = -(-len(series.values) // TUNING.longest)
    if width == 1:
        return series, 1
    middle = float(np.median(series.values[series.used]))
    spread = float(np.median((series.values[series.used] - middle) ** 2))
    weights = np.where(series.used, 1 / (series.variances + spread), 0.0)
    starts = np.arange(0, len(series.values), width)
    total = np.add.reduceat(weights, starts)
    safe = np.where(total > 0, total, 1.0)
    values = np.add.reduceat(weights * series.values, starts) / safe
    variances = np.add.reduceat(weights**2 * series.variances, starts) / safe**2
    used = total > 0
    return Series(values, np.where(used, variances, 1.0), used), width


def _assessment(
    series: Series, outliers: int, found: Fit, starts: list[int], width: int
) -> SequenceAssessment:
    n = len(series.values)
    bounds = bounds_of(starts, n)
    slope = _slope(found, width) if found.drift else 0.0
    weights, tau2, noise, _, _ = fit_residuals(series, _level(series, found.weights, bounds, slope, width))
    segments = tuple(
        Segment(
            first,
            end - 1,
            int(series.used[first:end].sum()),
            mean_of_blocks(
                series.values[first:end], weights[first:end], noise, slope, 2 if found.drift else 1
            ),
        )
        for first, end in bounds
    )
    drift = _drift(series, weights, bounds, noise)
    jumps = tuple(Jump(start, _change(found, place, n, noise)) for place, start in enumerate(starts))
    enough = segments[-1].mean.ci95 is not None
    status: Status = "jump" if jumps else "few" if not enough else "drift" if found.drift else "stable"
    used = int(series.used.sum())
    return SequenceAssessment(
        n,
        used,
        outliers,
        segments,
        jumps,
        drift,
        found.drift,
        status,
        math.sqrt(tau2),
        noise,
        series.values,
        weights,
    )


def _level(
    series: Series, weights: Floats, bounds: list[tuple[int, int]], slope: float, width: int
) -> Floats:
    """Return the mounting value at each frame."""
    n = len(series.values)
    known = np.where(series.used, np.repeat(weights, width)[:n] if width > 1 else weights, 0.0)
    level, frames = np.zeros(n), np.arange(n, dtype=float)
    for first, end in bounds:
        part = slice(first, end)
        if known[part].any():
            middle = np.average(frames[part], weights=known[part])
            level[part] = np.average(series.values[part], weights=known[part]) + slope * (
                frames[part] - middle
            )
    return level


def _slope(found: Fit, width: int) -> float:
    """Change per frame of the line that was fitted."""
    beta, _, _ = found.cells.solve(found.cells.design(found.starts, True))
    return float(beta[1]) / max(float(np.ptp(found.cells.first)), 1.0) / width


def _change(found: Fit, place: int, frames: int, noise: Noise) -> Estimate:
    """How large a jump is, by generalised least squares."""
    cells = found.cells
    design = cells.design(found.starts, found.drift)
    beta, covariance, squares = cells.solve(design)
    at = design.shape[1] - len(found.starts) + place
    scale = squares / max(len(cells.values) - design.shape[1], 1)
    error = math.sqrt(float(covariance[at, at]) * scale)
    freedom = max(block_count(frames, noise), TUNING.fewest_blocks) - 1.0
    return Estimate(float(beta[at]), t_quantile(freedom) * error, error, freedom)


def _drift(series: Series, weights: Floats, bounds: list[tuple[int, int]], noise: Noise) -> Estimate:
    """Return a weighted line through the blocks of all segments, each with a level of its own."""
    n = len(series.values)
    columns, values, shares = [], [], []
    for place, (first, end) in enumerate(bounds):
        if not weights[first:end].any():
            continue
        blocks = make_blocks(
            series.values[first:end], weights[first:end], max(1, block_count(end - first, noise))
        )
        level = np.zeros((len(blocks.means), len(bounds)))
        level[:, place] = 1
        columns.append(np.column_stack([(blocks.centres + first) / max(n - 1, 1), level]))
        values.append(blocks.means)
        shares.append(blocks.weights)
    design, means, share = np.concatenate(columns), np.concatenate(values), np.concatenate(shares)
    design = design[:, design.any(axis=0)]
    freedom = len(means) - design.shape[1]
    if len(means) < TUNING.fewest_blocks or freedom < TUNING.fewest_blocks - 2:
        return Estimate(needed=frames_needed(noise))
    covariance = np.linalg.pinv(design.T @ (share[:, None] * design), hermitian=True)
    beta = covariance @ (design.T @ (share * means))
    variance = float(share @ (means - design @ beta) ** 2) / freedom
    error = math.sqrt(float(covariance[0, 0]) * variance * hidden(noise, n, len(means)))
    return Estimate(float(beta[0]), t_quantile(freedom) * error, error, float(freedom))
