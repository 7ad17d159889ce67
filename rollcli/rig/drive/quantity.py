"""One quantity over one drive: its mounting value, its drift and its jumps, with intervals that hold.

Frames of a drive repeat each other: the car rolls and the road turns for many frames, so that an interval of
independent frames covers 5 to 30 % instead of 95. The posterior knows of it, from eight frames on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from rollcli.rig.drive.jumps import bounds_of, search
from rollcli.rig.drive.posterior import TUNING, Estimate, Fit, Flags, Floats, Likelihood, Series, make_cells

Status = Literal["stable", "drift", "jump", "few"]
_MAD_TO_SD = 1.4826  # of a normal distribution


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
    mean, begin, end : Estimate
        Over its frames, at its first and at its last one; alike where nothing drifts.
    """

    first: int
    last: int
    used: int
    mean: Estimate
    begin: Estimate
    end: Estimate


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
        Standard deviation between frames, beyond their own errors; None without frames.
    series : Series
        What was assessed.
    unit : float
        See `assess_sequence`.
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
    series: Series
    unit: float

    @property
    def now(self) -> Estimate:
        """The rig as it is at the end of the drive."""
        return self.segments[-1].end if self.segments else Estimate()

    @property
    def searched(self) -> bool:
        """Whether there are frames enough to look for jumps and a drift."""
        return self.used >= TUNING.searched

    @property
    def from_ends(self) -> int:
        """Frames before and behind a jump, without which it is not told."""
        return math.ceil(TUNING.apart(len(self.series.values)))

    def means(self, starts: Sequence[int]) -> list[Estimate]:
        """Return the mean of each stretch between such frames."""
        if not self.used:
            return [Estimate()] * (len(starts) + 1)
        edges = sorted({*starts, *(each.frame for each in self.jumps)})
        likelihood = Likelihood(make_cells(self.series, edges), self.unit)
        fitted = _Fitted(self.series, likelihood, edges, self.drifts)
        return [fitted.mean_over(first, end) for first, end in bounds_of(starts, self.frames)]


def assess_sequence(values: ArrayLike, errors: ArrayLike, unit: float = 1.0) -> SequenceAssessment:
    """Assess one quantity over the frames of one drive.

    Parameters
    ----------
    values : array_like of float, shape (N,)
        In the order of the frames; NaN where a frame is left out.
    errors : array_like of float, shape (N,)
        Standard error of each value, in its unit; NaN where it is not known, which takes the others' median,
        or where there are none, what neighbouring frames differ by.
    unit : float
        What of the quantity is as much as a degree of an angle: 0.1 m of a height.

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
    series, outliers = _prepared(given, np.asarray(errors, dtype=float), unit)
    used = int(series.used.sum())
    if not used:
        nothing = Estimate()
        return SequenceAssessment(len(given), 0, outliers, (), (), nothing, False, "few", None, series, unit)
    likelihood = Likelihood(make_cells(series), unit)
    found = search(series, likelihood)
    if found.starts:
        likelihood = Likelihood(make_cells(series, found.starts), unit)
    fitted = _Fitted(series, likelihood, found.starts, found.drift)
    segments = tuple(fitted.segments())
    jumps = tuple(
        Jump(start, fitted.estimate(fitted.level(place + 1, start) - fitted.level(place, start)))
        for place, start in enumerate(found.starts)
    )
    status: Status = "jump" if jumps else "drift" if found.drift else "stable"
    return SequenceAssessment(
        frames=len(given),
        used=used,
        outliers=outliers,
        segments=segments,
        jumps=jumps,
        drift=(fitted if found.drift else _Fitted(series, likelihood, found.starts, True)).drift(),
        drifts=found.drift,
        status="few" if used < TUNING.fewest else status,
        between_sd=fitted.between_sd(segments),
        series=series,
        unit=unit,
    )


class _Fitted:
    """A series with its levels and its line."""

    def __init__(self, series: Series, likelihood: Likelihood, starts: Sequence[int], drift: bool) -> None:
        self._series, self._starts, self._drift = series, starts, drift
        self._cells = likelihood.cells
        design = self._cells.design(starts, drift)
        self._there: Flags = np.asarray(design.any(axis=0))  # a stretch may have no frame that counts
        # frames that count may all lie in a cell or two, which do not tell a drift
        if drift and np.linalg.matrix_rank(design[:, self._there]) < self._there.sum():
            self._there[-1] = False
        self._fit: Fit = likelihood.fit(design[:, self._there])

    def level(self, place: int, frame: float) -> Floats:
        """Return the contrast of a stretch's level, drawn out by the line, at a frame."""
        row = np.zeros(len(self._there))
        row[place] = 1
        if self._drift:
            row[-1] = self._cells.share(frame)
        return row

    def estimate(self, contrast: Floats) -> Estimate:
        """Return a combination of levels; unknown where one of them is, without interval of few frames."""
        if (contrast != 0)[~self._there].any():
            return Estimate()
        found = self._fit.estimate(contrast[self._there])
        return found if self._series.used.sum() >= TUNING.fewest else Estimate(found.value)

    def drift(self) -> Estimate:
        """Return the change over the drive; unknown of a few frames."""
        if self._series.used.sum() < TUNING.fewest or not self._there[-1]:
            return Estimate()
        return self.estimate(np.eye(len(self._there))[-1])

    def segments(self) -> list[Segment]:
        """Return the stretches with their values."""
        found = []
        for place, (first, end) in enumerate(bounds_of(self._starts, self._cells.frames)):
            mean, last = self.estimate(self.level(place, (first + end - 1) / 2)), end - 1
            ends = [self.estimate(self.level(place, each)) for each in (first, last) if self._drift]
            used = int(self._series.used[first:end].sum())
            found.append(Segment(first, last, used, mean, *(ends or [mean, mean])))
        return found

    def mean_over(self, first: int, end: int) -> Estimate:
        """Return the mean of frames whose ends are ends of stretches."""
        within = {
            place: int(self._series.used[begin:stop].sum())
            for place, (begin, stop) in enumerate(bounds_of(self._starts, self._cells.frames))
            if first <= begin and stop <= end and self._there[place]
        }
        middle, total = (first + end - 1) / 2, sum(within.values())
        levels = [count / total * self.level(place, middle) for place, count in within.items() if total]
        return self.estimate(np.sum(levels, axis=0)) if levels else Estimate()

    def between_sd(self, segments: Sequence[Segment]) -> float:
        """Return the standard deviation of frames from the fitted level, beyond their own errors."""
        used, frames = self._series.used, np.arange(self._cells.frames)
        level = np.zeros(self._cells.frames)
        for each in segments:
            part = slice(each.first, each.last + 1)
            if each.begin.value is not None and each.end.value is not None:
                level[part] = np.interp(
                    frames[part], [each.first, each.last], [each.begin.value, each.end.value]
                )
        squares = (self._series.values - level)[used] ** 2 - self._series.variances[used]
        return math.sqrt(max(0.0, float(squares.mean())))


def _prepared(values: Floats, errors: Floats, unit: float) -> tuple[Series, int]:
    """Zeros where nothing is used, errors where none is known, and gross outliers left out."""
    used = np.isfinite(values)
    known = np.isfinite(errors) & (errors >= 0)
    if (known & used).any():
        usual = float(np.median(errors[known & used]))
    else:
        steps = np.abs(np.diff(values[used]))
        usual = float(np.median(steps)) if len(steps) else 0.0
    least, most = TUNING.least_error * unit, TUNING.most_error * unit
    own = np.clip(np.where(known, errors, usual), least, most) ** 2
    gross = np.zeros(len(values), dtype=bool)
    gross[used] = gross_outliers(values[used], own[used], unit)
    kept = used & ~gross
    return Series(np.where(kept, values, 0.0), own, kept), int(gross.sum())


def gross_outliers(values: Floats, variances: Floats, unit: float = 1.0) -> Flags:
    """Find the values that are far from those of the frames beside them.

    Parameters
    ----------
    values : ndarray of float, shape (N,)
        In order, without gaps.
    variances : ndarray of float, shape (N,)
        The square of each frame's own standard error.
    unit : float
        Of the quantity.

    Returns
    -------
    ndarray of bool, shape (N,)
        What to leave out. A frame beside a jump is not among it: it is like those of one side.
    """
    residuals = _off_neighbours(values)
    standardised = residuals / np.sqrt(variances + _wander(residuals, variances))
    scale = _MAD_TO_SD * float(np.median(standardised)) if len(values) else 0.0
    if not scale and len(values) >= TUNING.fewest:  # most frames are alike, as of a rig that stands still
        scale = 1.0  # that of their own errors
    if not scale > 0 or not math.isfinite(scale):
        return np.zeros(len(values), dtype=bool)
    least = TUNING.sway * unit if len(values) < TUNING.fewest else 0.0
    return np.asarray((standardised > TUNING.gross * scale) & (residuals > least))


def _off_neighbours(values: Floats) -> Floats:
    """How far each value is from the median of those before it, or of those after it, whichever is nearer.

    At an end more than half as many are enough: those of a jump eight frames from it are like each other.
    """
    width = TUNING.neighbours
    if len(values) <= width:
        return np.abs(values - np.median(values)) if len(values) else values
    medians, few = np.median(sliding_window_view(values, width), axis=1), range(width // 2 + 1, width)
    begin, end = ([np.median(each[:count]) for count in few] for each in (values, values[::-1]))
    none = np.full(few[0], np.nan)
    before = np.concatenate([none, begin, medians[:-1]])
    after = np.concatenate([medians[1:], end[::-1], none])
    return np.asarray(np.fmin(np.abs(values - before), np.abs(values - after)))


def _wander(residuals: Floats, variances: Floats) -> float:
    """Return the variance about the neighbours' median that the frames' own errors do not explain.

    It shows in the frames with small errors; where large errors are too large, it is not seen in the others.
    """
    most = 0.0
    for part in np.array_split(np.argsort(variances, kind="stable"), min(4, len(residuals) // 20 + 1)):
        if len(part):
            spread = _MAD_TO_SD * float(np.median(residuals[part]))
            most = max(most, spread**2 - float(np.median(variances[part])))
    return most
