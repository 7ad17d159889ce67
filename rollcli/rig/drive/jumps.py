"""Jumps between segments: dynamic programming on cells of frames, then the frame itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rollcli.rig.drive.noise import Floats, Noise, fit_noise, frame_weights, make_blocks
from rollcli.rig.drive.tuning import TUNING


def best_partitions(means: Floats, weights: Floats, most: int) -> list[list[int]]:
    """Find the partitions of least weighted squares into 1, 2, ... stretches.

    Parameters
    ----------
    means : ndarray of float, shape (K,)
        Block means, in order.
    weights : ndarray of float, shape (K,)
        Of the blocks; 0 for one that holds nothing.
    most : int
        The largest number of changes to look for.

    Returns
    -------
    list of list of int
        For 0, 1, ... changes the first block of each stretch but the first.

    Notes
    -----
    F_c[t] = min over s < t of F_{c-1}[s] + cost(s, t), in O(most K^2) [Bellman 1961; Auger, Lawrence 1989].
    """
    k = len(means)
    costs = _costs(means, weights)
    best = costs[0]  # of the first t blocks, without a change
    origins: list[list[int]] = []
    partitions: list[list[int]] = [[]]
    for changes in range(1, min(most, k - 1) + 1):
        table = best[:, None] + costs
        origin = table.argmin(axis=0)
        best = table[origin, np.arange(k + 1)]
        origins.append(origin.tolist())
        partitions.append(_trace(origins, changes, k))
    return partitions


def _costs(means: Floats, weights: Floats) -> Floats:
    """Weighted squares about the mean of blocks s to t - 1, for every s < t; infinite elsewhere."""
    centred = means - np.average(means, weights=weights)  # differences of large sums lose digits
    sums = [np.concatenate([[0.0], np.cumsum(weights * centred**power)]) for power in range(3)]
    w, wx, wxx = (each[None, :] - each[:, None] for each in sums)
    costs = wxx - wx**2 / np.where(w > 0, w, 1.0)
    costs[np.tril_indices(len(means) + 1)] = np.inf
    return np.asarray(np.maximum(costs, 0.0))


def _trace(origins: list[list[int]], changes: int, end: int) -> list[int]:
    """Return the starts of the stretches, from the last one back."""
    starts: list[int] = []
    for level in range(changes - 1, -1, -1):
        end = origins[level][end]
        starts.append(end)
    return starts[::-1]


_LEAST_WHITE = 1e-3  # of the slow variance: what keeps the covariance well conditioned


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Weighted means of stretches of frames and the inverse of their covariance.

    Attributes
    ----------
    first : ndarray of int, shape (C,)
        The first frame of each cell.
    values : ndarray of float, shape (C,)
    precision : ndarray of float, shape (C, C)
    log_determinant : float
        Of the covariance.
    decay : float
        Correlation of the slow part from one cell to the next.
    """

    first: NDArray[np.intp]
    values: Floats
    precision: Floats
    log_determinant: float
    decay: float

    def design(self, starts: Sequence[int], drift: bool) -> Floats:
        """Columns: the mean, a line if asked for, and a step at each of `starts` (cells)."""
        count = len(self.values)
        columns = [np.ones(count)]
        if drift:
            columns.append((self.first - self.first.mean()) / max(float(np.ptp(self.first)), 1.0))
        columns += [(np.arange(count) >= start).astype(float) for start in starts]
        return np.stack(columns, axis=1)

    def solve(self, design: Floats) -> tuple[Floats, Floats, float]:
        """Return coefficients, their covariance, and the weighted sum of squares that is left."""
        weighted = self.precision @ design
        covariance: Floats = np.asarray(np.linalg.pinv(design.T @ weighted, hermitian=True), dtype=float)
        beta = covariance @ (weighted.T @ self.values)
        left = self.values - design @ beta
        return beta, covariance, float(left @ self.precision @ left)

    def gains(self, design: Floats) -> Floats:
        """Return by how much a further step at each cell would lower the weighted sum of squares."""
        weighted = self.precision @ design
        inverse = np.linalg.pinv(design.T @ weighted, hermitian=True)
        left = self.values - design @ (inverse @ (weighted.T @ self.values))
        score = _tail(self.precision @ left)
        crossed = _tail(weighted)
        own = np.diagonal(_tail(_tail(self.precision).T))
        information = own - np.einsum("ij,jk,ik->i", crossed, inverse, crossed)
        gains = score**2 / np.maximum(information, 1e-12 * own.max())
        return np.where(information > 1e-9 * own.max(), gains, 0.0)

    def fading(self, start: int) -> Floats:
        """Return a kick at a cell that fades as the slow noise does."""
        distance = np.arange(len(self.values)) - start
        return np.where(distance >= 0, self.decay ** np.maximum(distance, 0), 0.0)


def _tail(array: Floats) -> Floats:
    """Return sums from each row to the last."""
    return np.asarray(np.cumsum(array[::-1], axis=0)[::-1])


def make_cells(
    values: Floats, weights: Floats, white: Floats, slow_variance: float, phi: float, width: int
) -> Cells:
    """Average a series in cells of `width` frames.

    Parameters
    ----------
    values, weights : ndarray of float, shape (N,)
        Weight 0 where a frame is missing.
    white : ndarray of float, shape (N,)
        Variance of each frame that it shares with no other.
    slow_variance, phi : float
        Of the AR(1) part.
    width : int
        Frames.

    Returns
    -------
    Cells
        Those that hold a frame.
    """
    starts = np.arange(0, len(values), width)
    total = np.add.reduceat(weights, starts)
    there = total > 0
    sums = np.add.reduceat(weights * values, starts)[there]
    own = np.add.reduceat(weights**2 * white, starts)[there] / total[there] ** 2
    first = starts[there]
    distance = np.abs(first[:, None] - first[None, :]) / width
    covariance = slow_variance * _mean_correlation(distance, phi, width)
    covariance[np.diag_indices(len(first))] += np.maximum(own, _LEAST_WHITE * slow_variance + 1e-18)
    determinant = 2 * float(np.log(np.diagonal(np.linalg.cholesky(covariance))).sum())
    precision = np.asarray(np.linalg.inv(covariance), dtype=float)
    return Cells(first, sums / total[there], precision, determinant, phi**width)


def _mean_correlation(distance: Floats, phi: float, width: int) -> Floats:
    """Correlation of AR(1) averaged over two cells, `distance` cells apart."""
    if phi <= 0:
        return np.where(distance == 0, 1.0 / width, 0.0)
    within = Noise(1.0, phi, 1.0, 1.0).variance_of_mean(width)
    ends = ((1 - phi**width) / (width * (1 - phi))) ** 2 * phi ** (1 - width) if width > 1 else 1.0
    return np.where(distance == 0, within, ends * phi ** (width * np.maximum(distance, 1)))


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


_SIDE = 3  # cells on each side that are looked at again
_FEWEST = 60  # frames on each side: what is beside a jump tells its levels


def place_jump(series: Series, found: Fit, place: int, width: int) -> int:
    """Return the first frame after a jump.

    Parameters
    ----------
    series : Series
        Frames.
    found : Fit
        The jumps, in cells of `width` frames each.
    place : int
        Which of its jumps.
    width : int
        How many frames were averaged before the search.

    Returns
    -------
    int
        Between the neighbouring jumps.
    """
    firsts = found.cells.first * width
    cell = int(firsts[1] - firsts[0]) if len(firsts) > 1 else width
    starts = [int(firsts[each]) for each in found.starts]
    bounds = [0, *starts, len(series.values)]
    low, start, high = bounds[place] + 1, bounds[place + 1], bounds[place + 2] - 1
    phi = found.noise.phi ** (1 / width)
    reach = 2 * round(found.noise.correlation_time * width)
    while cell > 1:
        side = max(_SIDE * cell, reach, _FEWEST)
        begin, end = max(low - 1, start - side), min(high + 1, start + side)
        finer = max(1, min(cell // 2, -(-(end - begin) // TUNING.cells)))
        part = slice(begin, end)
        weights = np.where(series.used[part], 1 / (series.variances[part] + found.slow_variance), 0.0)
        white = found.white_scale * series.variances[part]
        cells = make_cells(series.values[part], weights, white, found.slow_variance, phi, finer)
        gains = cells.gains(cells.design((), False))
        near = np.abs(cells.first + begin - start) <= max(1.5 * cell, reach / 2)
        inside = near & (cells.first + begin >= low) & (cells.first + begin <= high)
        if not inside.any():
            break
        start = int(cells.first[int(np.where(inside, gains, -1.0).argmax())]) + begin
        cell, reach = finer, 0
    return start
