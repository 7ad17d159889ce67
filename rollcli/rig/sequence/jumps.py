"""When the mount moved: steps and a line are proposed, fitted with their own noise, and compared.

Exact dynamic programming on block means proposes sets of jumps, a scan by generalised least squares proposes
one more; a set is taken when it lowers -2 log likelihood by more than its penalty, with the noise refitted
for each: noise that was fitted about a jump calls it noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rollcli.rig.sequence.blocks import make_blocks
from rollcli.rig.sequence.cells import Cells, make_cells
from rollcli.rig.sequence.noise import Noise, fit_noise
from rollcli.rig.sequence.segmentation import best_partitions
from rollcli.rig.sequence.tuning import TUNING
from rollcli.rig.sequence.weights import Floats, frame_weights

_PROPOSAL_BLOCKS = 200
_MOVES = 2
_ROUNDING = 1e-9  # degrees or metres: what equal frames differ by is arithmetic, and would look correlated
_REACH = 1.0  # shortest stretches that a proposed jump may move


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
    used: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Steps, and a line or none, with the noise about them.

    Attributes
    ----------
    starts : tuple of int
        The first cell after each jump.
    drift : bool
        Whether there is a line.
    cells : Cells
    weights : ndarray of float, shape (N,)
        Of the frames; 0 where one is left out.
    noise : Noise
        Of the weighted residuals.
    slow_variance, white_scale : float
        Of the AR(1) part; and what the frames' own variances are multiplied by.
    tau2 : float
        Variance between frames.
    score : float
        -2 log likelihood and the penalties: lower is better.
    """

    starts: tuple[int, ...]
    drift: bool
    cells: Cells
    weights: Floats
    noise: Noise
    slow_variance: float
    white_scale: float
    tau2: float
    score: float


def search(series: Series) -> Fit:
    """Find the jumps of a series, and whether it drifts.

    Parameters
    ----------
    series : Series
        At least one frame is used.

    Returns
    -------
    Fit
        Of the lowest score with a line or without one.
    """
    if series.used.sum() < TUNING.fewest_to_search:
        return fit_steps(series, (), drift=False)
    level, line = _search(series, drift=False), fit_steps(series, (), drift=True)
    if not level.starts and line.score >= level.score:
        return level
    line = _search(series, drift=True)
    if level.starts or line.starts:
        return line if line.score + TUNING.told_apart < level.score else level
    return line if line.score < level.score else level


def fit_steps(series: Series, starts: Sequence[int], drift: bool) -> Fit:
    """Fit steps that begin at these cells, with the noise that is left."""
    width = -(-len(series.values) // TUNING.cells)
    level = _first_level(series, [start * width for start in starts], drift)
    weights, tau2, noise, slow, white = fit_residuals(series, level)
    cells = make_cells(series.values, weights, white * series.variances, slow, noise.phi, width)
    _, _, squares = cells.solve(cells.design(starts, drift))
    count = len(cells.values)
    score = count * np.log(max(squares / count, 1e-300)) + cells.log_determinant
    scarce = TUNING.scarce_penalty * noise.correlation_time / len(series.values)
    score += (TUNING.jump_penalty + scarce) * len(starts)
    score += (TUNING.drift_penalty + scarce / 2) * drift
    return Fit(tuple(starts), drift, cells, weights, noise, slow, white, tau2, float(score))


def fit_residuals(series: Series, level: Floats) -> tuple[Floats, float, Noise, float, float]:
    """Weights, variance between frames, and noise of what is left about a level.

    Returns
    -------
    weights, tau2, noise, slow_variance, white_scale
        See `Fit`.
    """
    used, residuals = series.used, series.values - level
    residuals = np.where(np.abs(residuals) > _ROUNDING, residuals, 0.0)
    weights = np.zeros(len(used))
    weights[used], tau2 = frame_weights(residuals[used], series.variances[used])
    relative = weights / weights.mean()
    noise = fit_noise(relative * residuals)
    # frames of unlike weight make slow noise look white in part
    alike = float(np.mean(relative[1:] * relative[:-1])) if len(relative) > 1 else 1.0
    slow = noise.variance * noise.share / max(alike, 1e-12)
    white = noise.variance * (1 - noise.share) - (float(np.mean(relative**2)) - alike) * slow
    own = float(np.mean(relative**2 * series.variances))
    return weights, tau2, noise, slow, max(white, 0.01 * noise.variance) / own


def _first_level(series: Series, starts: Sequence[int], drift: bool) -> Floats:
    """Weighted means between the starts, and a common line."""
    n = len(series.values)
    weights = np.where(series.used, 1 / (series.variances + np.var(series.values[series.used])), 0.0)
    bounds = [0, *starts, n]
    lengths = np.diff(bounds)
    frames = np.arange(n, dtype=float)

    def levelled(values: Floats) -> Floats:
        total = np.add.reduceat(weights, bounds[:-1])
        sums = np.add.reduceat(weights * values, bounds[:-1])
        return np.repeat(sums / np.maximum(total, 1e-300), lengths)

    level = levelled(series.values)
    if drift:
        along = frames - levelled(frames)
        squares = float(weights @ along**2)
        slope = float((weights * along) @ (series.values - level)) / squares if squares > 0 else 0.0
        level = level + slope * along
    return level


def _search(series: Series, drift: bool) -> Fit:
    fit = fit_steps(series, (), drift)
    while len(fit.starts) < TUNING.most_jumps:
        proposals = {_settled(series, starts, fit) for starts in _proposals(series, fit)} - {fit.starts, ()}
        fits = [fit_steps(series, starts, drift) for starts in sorted(proposals)]
        better = min(fits, key=lambda each: each.score, default=fit)
        if better.score >= fit.score:
            break
        fit = better
    return _pruned(series, fit)


def _pruned(series: Series, fit: Fit) -> Fit:
    """Without the jumps that the others make needless."""
    while fit.starts:
        fewer = [
            fit_steps(series, [each for each in fit.starts if each != start], fit.drift)
            for start in fit.starts
        ]
        best = min(fewer, key=lambda each: each.score)
        if best.score > fit.score and all(_persists(fit, start) for start in fit.starts):
            break
        fit = best
    return fit


def _proposals(series: Series, fit: Fit) -> list[tuple[int, ...]]:
    """Return sets of starts: one more by the scan; one or two more by dynamic programming."""
    cells, gap = fit.cells, _gap(fit)
    gains = cells.gains(cells.design(fit.starts, fit.drift))
    allowed = _allowed(fit.starts, gap, len(gains))
    proposals = []
    if allowed.any():
        at = int(np.where(allowed, gains, -1.0).argmax())
        proposals.append(tuple(sorted((*fit.starts, at))))
    for starts in _partitions(series, fit)[len(fit.starts) + 1 :]:
        if starts and min(np.diff([0, *starts, len(gains)])) >= 1:
            proposals.append(starts)
    return proposals


def _partitions(series: Series, fit: Fit) -> list[tuple[int, ...]]:
    """Return the best partitions of block means, as cells."""
    n, width = len(series.values), -(-len(series.values) // TUNING.cells)
    count = int(min(_PROPOSAL_BLOCKS, max(n / fit.noise.correlation_time, 4)))
    values = series.values
    if fit.drift:
        beta, _, _ = fit.cells.solve(fit.cells.design(fit.starts, True))
        span = max(float(np.ptp(fit.cells.first)), 1.0)
        values = values - beta[1] * np.arange(n) / span
    blocks = make_blocks(values, fit.weights, count)
    edges = (blocks.centres - n / count / 2).round() / width
    found = best_partitions(blocks.means, blocks.weights, len(fit.starts) + 2)
    return [tuple(sorted({int(edges[start]) for start in starts})) for starts in found]


def _settled(series: Series, starts: tuple[int, ...], fit: Fit) -> tuple[int, ...]:
    """Move each start to where it explains most, given the others; leave out what is too close together."""
    moved = list(starts)
    cells, gap = fit.cells, _gap(fit)
    reach = max(2, round(_REACH * gap))
    for _ in range(_MOVES):
        for place, start in enumerate(moved):
            others = moved[:place] + moved[place + 1 :]
            gains = cells.gains(cells.design(others, fit.drift))
            near = np.abs(np.arange(len(gains)) - start) <= reach
            allowed = _allowed(others, gap, len(gains)) & near
            if allowed.any():
                moved[place] = int(np.where(allowed, gains, -1.0).argmax())
    kept = [moved[0]] if moved else []
    for start in sorted(moved)[:]:
        if all(abs(start - each) >= gap for each in kept):
            kept.append(start)
    return tuple(sorted(kept))


def _allowed(starts: Sequence[int], gap: int, count: int) -> np.ndarray:
    """Cells where a further jump may be: far enough from the others and from both ends."""
    allowed = np.zeros(count, dtype=bool)
    allowed[gap : count - gap + 1] = True
    for start in starts:
        allowed[max(0, start - gap + 1) : start + gap] = False
    return allowed


def _gap(fit: Fit) -> int:
    """Return the shortest stretch between two jumps, cells."""
    width = int(fit.cells.first[1] - fit.cells.first[0]) if len(fit.cells.first) > 1 else 1
    long = float(fit.cells.first[-1] + width) / TUNING.enough_blocks  # noise about an unseen jump is too slow
    frames = max(TUNING.fewest_blocks, min(long, TUNING.apart * fit.noise.correlation_time))
    return max(1, -(-int(frames) // width))


def _width(series: Series) -> int:
    return -(-len(series.values) // TUNING.cells)


def _persists(fit: Fit, start: int) -> bool:
    """Whether the level after a jump stays changed, once a kick that fades is allowed for."""
    if fit.noise.phi <= 0:
        return True
    design = fit.cells.design(fit.starts, fit.drift)
    place = design.shape[1] - len(fit.starts) + fit.starts.index(start)
    with_step, _, _ = fit.cells.solve(design)
    with_kick, _, _ = fit.cells.solve(np.column_stack([design, fit.cells.fading(start)]))
    return bool(with_kick[place] / with_step[place] > TUNING.persistence)


def bounds_of(starts: Sequence[int], frames: int) -> list[tuple[int, int]]:
    """First and last + 1 of each stretch."""
    return list(pairwise([0, *starts, frames]))
