"""Simulated series: a mounting value, AR(1) of the car and the road, and each frame's own error."""

import numpy as np


def ar1(rng, frames, phi, sd):
    """Stationary AR(1)."""
    values = np.empty(frames)
    values[0] = rng.normal(0, sd)
    for place, kick in enumerate(rng.normal(0, sd * np.sqrt(1 - phi**2), frames - 1)):
        values[place + 1] = phi * values[place] + kick
    return values


def swaying(rng, frames, period, left, sd):
    """Stationary AR(2): a body that swings on its springs; `left` of a swing is there a frame later."""
    first, second = 2 * left * np.cos(2 * np.pi / period), -(left**2)
    kick = sd * np.sqrt((1 - second) ** 2 - first**2) * np.sqrt((1 + second) / (1 - second))
    values = [0.0, 0.0]
    for each in rng.normal(0, kick, frames + 200):
        values.append(first * values[-1] + second * values[-2] + each)
    return np.array(values[-frames:])


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
    bumps=0.0,
    sways=0.0,
):
    """Values and their standard errors; `gross` is the share of outliers, all to one side.

    `bumps` and `sways` are standard deviations of what comes on top of the AR(1): a movement of each frame
    alone, and a body that swings on its springs with a period of 8 frames.
    """
    rng = np.random.default_rng(seed)
    own = rng.uniform(*errors, frames)
    values = level + ar1(rng, frames, phi, sd) + rng.normal(0, 1, frames) * own
    values += rng.normal(0, bumps, frames) if bumps else 0.0
    values += swaying(rng, frames, 8, 0.85, sways) if sways else 0.0
    values[frames // 2 if at is None else at :] += jump
    values += drift * (np.arange(frames) / (frames - 1) - 0.5)
    bad = rng.random(frames) < gross
    values[bad] = rng.uniform(0, 30, bad.sum())
    return values, own


def joined(*parts):
    """Columns below each other."""
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}
