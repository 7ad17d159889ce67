"""Simulated series: a mounting value, AR(1) of the car and the road, and each frame's own error."""

import numpy as np


def ar1(rng, frames, phi, sd):
    """Stationary AR(1)."""
    values = np.empty(frames)
    values[0] = rng.normal(0, sd)
    for place, kick in enumerate(rng.normal(0, sd * np.sqrt(1 - phi**2), frames - 1)):
        values[place + 1] = phi * values[place] + kick
    return values


def drive(
    seed,
    frames=2000,
    *,
    level=-0.44,
    phi=0.94,
    sd=0.2,
    errors=(0.02, 0.3),
    jump=0.0,
    at=None,
    drift=0.0,
    gross=0.0,
):
    """Values and their standard errors; `gross` is the share of outliers, all to one side."""
    rng = np.random.default_rng(seed)
    own = rng.uniform(*errors, frames)
    values = level + ar1(rng, frames, phi, sd) + rng.normal(0, 1, frames) * own
    values[frames // 2 if at is None else at :] += jump
    values += drift * (np.arange(frames) / (frames - 1) - 0.5)
    bad = rng.random(frames) < gross
    values[bad] = rng.uniform(0, 30, bad.sum())
    return values, own


def joined(*parts):
    """Columns below each other."""
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}
