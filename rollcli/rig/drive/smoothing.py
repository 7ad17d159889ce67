"""The mounting value over the frames, smoothed: a level that hardly moves, and AR(1) of the car and the road.

Two states and a scalar measurement: the Kalman filter forward [Kalman 1960], then backward [Rauch, Tung,
Striebel 1965]. Frames are averaged in cells first: a chart cannot show more of a long drive.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.rig.drive.noise import Floats, Noise

_CELLS = 400
_STEPS = (0.0, 1e-4, 1e-3, 1e-2, 0.1)  # of the level a cell, in standard deviations of the noise
_UNKNOWN = 1e6  # variance of a level of which nothing is known, in units of the series' own


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """The mounting value at some frames.

    Attributes
    ----------
    frames : ndarray of float, shape (C,)
        Where, in frames of the stretch that was smoothed.
    level : ndarray of float, shape (C,)
    error : ndarray of float, shape (C,)
        Standard error of the level.
    cell : int
        Frames of a cell; cells without a frame are left out.
    """

    frames: NDArray[np.float64]
    level: Floats
    error: Floats
    cell: int


def smooth(values: Floats, weights: Floats, noise: Noise, steps: Sequence[float] = _STEPS) -> Smoothed:
    """Smooth one segment: the level is not carried across a jump or from one drive to another.

    Parameters
    ----------
    values, weights : ndarray of float, shape (N,)
        Weight 0 where a frame is left out.
    noise : Noise
        Of the frames.
    steps : sequence of float
        Of the level from cell to cell, standard deviations of the noise; the likeliest is taken.

    Returns
    -------
    Smoothed
        At the cells that hold a frame.
    """
    width = -(-len(values) // _CELLS)
    starts = np.arange(0, len(values), width)
    total = np.add.reduceat(weights, starts)
    there = total > 0
    centre = float(np.average(values, weights=weights))
    means = (np.add.reduceat(weights * values, starts)[there] / total[there]) - centre
    counts = np.add.reduceat((weights > 0).astype(float), starts)[there]
    white = noise.variance * (1 - noise.share) / counts
    gaps = np.diff(np.flatnonzero(there), prepend=-1)
    model = _Model(noise.variance * noise.share, noise.phi**width, gaps.astype(float))
    runs = [_filter(means, white, model, step**2 * max(noise.variance, 1e-300)) for step in steps]
    best = min(runs, key=lambda run: run.deviance)
    level, variance = _back(best)
    frames = np.minimum(starts + (width - 1) / 2, len(values) - 1)[there]
    return Smoothed(frames, level + centre, np.sqrt(np.maximum(variance, 0.0)), width)


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """AR(1) of this variance and correlation between cells; the cells since the one before."""

    slow: float
    phi: float
    gaps: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """What the filter has found: states and covariances before and after each measurement."""

    before: NDArray[np.float64]
    before_cov: NDArray[np.float64]
    after: NDArray[np.float64]
    after_cov: NDArray[np.float64]
    moves: NDArray[np.float64]
    deviance: float


def _filter(means: Floats, white: Floats, model: _Model, step: float) -> _Run:
    """Run forward; the states are the level and the slow noise."""
    count = len(means)
    before, after = np.zeros((count, 2)), np.zeros((count, 2))
    before_cov, after_cov = np.zeros((count, 2, 2)), np.zeros((count, 2, 2))
    moves = np.zeros((count, 2))
    scale = max(float(np.var(means)), model.slow, 1e-12)
    state, cov = np.zeros(2), np.diag([_UNKNOWN * scale, model.slow])
    deviance = 0.0
    for place in range(count):
        if place:
            phi = model.phi ** model.gaps[place]
            move = np.array([1.0, phi])
            state = move * state
            cov = cov * np.outer(move, move)
            cov[0, 0] += step * model.gaps[place]
            cov[1, 1] += model.slow * (1 - phi**2)
            moves[place] = move
        before[place], before_cov[place] = state, cov
        spread = cov.sum() + white[place] + 1e-12 * scale
        gain, off = cov.sum(axis=1) / spread, means[place] - state.sum()
        deviance += float(np.log(spread) + off**2 / spread) if place else 0.0
        state, cov = state + gain * off, cov - np.outer(gain, gain) * spread
        after[place], after_cov[place] = state, cov
    return _Run(before, before_cov, after, after_cov, moves, deviance)


def _back(run: _Run) -> tuple[Floats, Floats]:
    """Run backward; return the level and its variance."""
    states, covs = run.after.copy(), run.after_cov.copy()
    for place in range(len(states) - 2, -1, -1):
        following = run.before_cov[place + 1]
        gain = (run.after_cov[place] * run.moves[place + 1]) @ np.linalg.pinv(following, hermitian=True)
        states[place] += gain @ (states[place + 1] - run.before[place + 1])
        covs[place] += gain @ (covs[place + 1] - following) @ gain.T
    return states[:, 0], covs[:, 0, 0]
