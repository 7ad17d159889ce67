"""When the mount moved, and whether it drifts: designs of more levels and of a line, by their evidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rollcli.rig.drive.posterior import TUNING, Flags, Likelihood, Series, correlations_at, make_cells

_SIDE = 2.5  # cells on each side of a jump that are looked at again
_NEAR = 1.5  # cells on each side that a jump is moved to then
_FEWEST = 60  # frames on each side: what is beside a jump tells its levels
# of a kick, at the end of the drive: one of which more is there has not faded, and a jump looks the same. In
# drives of 30 frames a tenth of the jumps by ten times the noise was taken for such a kick
_LEFT = 0.5


@dataclass(frozen=True, slots=True)
class Found:
    """What moved.

    Attributes
    ----------
    starts : tuple of int
        The first frame after each jump.
    drift : bool
    score : float
        Log evidence, and the log prior odds: higher is better.
    """

    starts: tuple[int, ...]
    drift: bool
    score: float


def search(series: Series, whole: Likelihood) -> Found:
    """Find the jumps of a series, and whether it drifts.

    Parameters
    ----------
    series : Series
    whole : Likelihood
        Of the cells of the series without a jump.

    Returns
    -------
    Found
        Of the highest score.
    """
    if series.used.sum() < TUNING.searched:
        return Found((), False, 0.0)
    seen = _Search(whole)
    places = np.flatnonzero(series.used)
    spanned = 2 * (places[-1] - places[0]) >= len(series.values)  # else a line would be drawn out far
    found = max((seen.jumps(drift) for drift in (False, True)[: 1 + spanned]), key=lambda each: each.score)
    return Found(tuple(_placed(series, found, whole)), found.drift, found.score)


class _Search:
    """Adds jumps one by one or two by two as long as the score grows, and takes needless ones away."""

    def __init__(self, likelihood: Likelihood) -> None:
        self.cells, self._likelihood = likelihood.cells, likelihood
        self._gap = TUNING.apart(self.cells.frames)

    def jumps(self, drift: bool) -> Found:
        """Return the best jumps with a drift, or without."""
        best = self._scored((), drift)
        while len(best.starts) < TUNING.most_jumps and best.score > -math.inf:
            proposed = [self._scored(starts, drift) for starts in self._proposals(best)]
            better = max(proposed, key=lambda each: each.score, default=best)
            if better.score <= best.score:
                break
            best = better
        while best.starts:
            fewer = [
                self._scored([each for each in best.starts if each != start], drift) for start in best.starts
            ]
            less = max(fewer, key=lambda each: each.score)
            if less.score < best.score and all(self._lasts(best, start) for start in best.starts):
                break
            best = less
        return best

    def _scored(self, starts: Sequence[int], drift: bool) -> Found:
        fit = self._likelihood.fit(self.cells.design(starts, drift))
        return Found(tuple(starts), drift, fit.evidence - self._penalty(len(starts), drift))

    @staticmethod
    def _penalty(jumps: int, drift: bool) -> float:
        return TUNING.jump_penalty * jumps + TUNING.drift_penalty * drift

    def _proposals(self, found: Found) -> list[tuple[int, ...]]:
        """Return what is there with the step that tells most, and with the two that do."""
        design, first = self.cells.design(found.starts, found.drift), self.cells.first
        fit = self._likelihood.fit(design)
        # far enough from the others and from both ends
        edges = np.array([0, *found.starts, self.cells.frames])
        allowed: Flags = np.abs(first[:, None] - edges).min(axis=1) >= self._gap
        one = self._likelihood.scan(design, fit)
        # a jump too near to an end to be told would be taken for one farther from it, with a level of both
        close = np.abs(first[:, None] - first) < self._gap
        looked_at = _NEAR * self.cells.width if self.cells.width > 1 else 0
        close &= np.minimum(first, self.cells.frames - first) < self._gap - looked_at
        allowed &= one >= np.where(close, one, -np.inf).max(axis=1)
        if not allowed.any():
            return []
        one = np.where(allowed, one, -np.inf)
        both = np.abs(first[:, None] - first) >= self._gap
        both &= allowed[:, None] & allowed
        two = np.where(both, self._likelihood.pairs(design, fit), -np.inf)
        places = [[int(one.argmax())]]
        if both.any():
            places.append([int(each) for each in np.unravel_index(int(two.argmax()), two.shape)])
        return [tuple(sorted([*found.starts, *(int(first[at]) for at in each)])) for each in places]

    def _lasts(self, found: Found, start: int) -> bool:
        """Tell whether the level after a jump stays changed, rather than being a kick that fades.

        One that returns too near to the end to be told has stayed changed for as long as can be told.
        """
        others = [each for each in found.starts if each != start]
        after = (self.cells.centres - start) / self.cells.width
        design = self.cells.design(others, found.drift)
        fit = self._likelihood.fit(design)
        at = int(np.unravel_index(int(fit.log_evidence.argmax()), fit.log_evidence.shape)[0])
        fading = np.where(after >= 0, correlations_at(np.maximum(after, 0))[at], 0.0)
        if fading[-1] > _LEFT:
            return True
        kicked = self._likelihood.fit(np.column_stack([design, fading]))
        fades = kicked.evidence - self._penalty(len(found.starts), found.drift)
        first = self.cells.first
        untold = first[first > max(self.cells.frames - self._gap, found.starts[-1])].tolist()
        returned = (self._scored((*found.starts, each), found.drift) for each in untold)
        return found.score >= fades or any(each.score >= fades for each in returned)


def _placed(series: Series, found: Found, whole: Likelihood) -> list[int]:
    """Return the frames of jumps that were found to a cell: looked at again in smaller and smaller cells."""
    starts = list(found.starts)
    for place in range(len(starts)):
        low, start, high = ([0, *starts, len(series.values)])[place : place + 3]
        cell = whole.cells.width
        while cell > 1:
            side = max(round(_SIDE * cell), _FEWEST)
            begin, end = max(low, start - side), min(high, start + side)
            part = series.part(begin, end)
            cells = make_cells(part, most=TUNING.cells // 2)
            likelihood, level = Likelihood(cells, whole.unit), np.ones((len(cells.first), 1))
            near = np.abs(cells.first + begin - start) <= _NEAR * cell
            # behind many frames that do not count, those before the jump are not in this part
            if not near.any() or near[0] or cells.width >= cell:
                break
            evidence = likelihood.scan(level, likelihood.fit(level))
            start = begin + int(cells.first[int(np.where(near, evidence, -np.inf).argmax())])
            cell = cells.width
        starts[place] = start
    return starts


def bounds_of(starts: Sequence[int], frames: int) -> list[tuple[int, int]]:
    """First and last + 1 of each stretch."""
    return list(pairwise([0, *starts, frames]))
