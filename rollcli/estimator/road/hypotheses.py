"""Hypotheses of a road: planes through triples of neighbouring pixels."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.subsample import Sample, Singles, rising

_POOL_PIXELS = 4000  # triples are drawn of these
_DRAWS = 1024  # triples drawn; about half are planes that could be a road
_HYPOTHESES = 320
_RADIUS = 0.35  # of a triple, in half image lengths
_MIN_AREA = 0.004  # twice the area of its triangle, to be well conditioned
_LEAST_RISE = 4.0  # tolerances that a road rises by within the radius


def draw_planes(sample: Sample, max_roll: float, seed: int) -> Singles:
    """Return planes (K, 3) through triples of neighbouring coherent pixels, disparity growing downward."""
    few = sample.about(_POOL_PIXELS)
    pool = np.flatnonzero((sample.coherence[few] >= 0.5) & rising(sample.slopes[:, few])) * few.step
    if len(pool) < 3:
        return np.empty((0, 3), np.float32)
    column = sample.column[pool]
    pool = pool[np.argsort(column, kind="stable")]
    before = np.concatenate([[0], np.cumsum(np.bincount(column))])  # how many lie left of each column
    x, y, d = sample.x, sample.y, sample.d
    first, second, third = _draws(seed)
    central = pool[np.abs(x[pool]) < _RADIUS]  # the road is more likely there
    both = np.concatenate([pool, central])
    a = both[(first * len(both)).astype(np.intp)]
    at, reach = sample.column[a].astype(np.intp), int(_RADIUS / sample.pitch)
    from_ = before[np.maximum(at - reach, 0)]
    to = before[np.minimum(at + reach + 1, len(before) - 1)]
    b = pool[from_ + (second * (to - from_)).astype(np.intp)]
    c = pool[from_ + (third * (to - from_)).astype(np.intp)]
    x1, y1, d1 = x[b] - x[a], y[b] - y[a], d[b] - d[a]
    x2, y2, d2 = x[c] - x[a], y[c] - y[a], d[c] - d[a]
    area = x1 * y2 - x2 * y1
    wide = (np.abs(area) > _MIN_AREA) & (np.maximum(np.abs(y1), np.abs(y2)) < _RADIUS)
    area = np.where(wide, area, 1)
    c1, c2 = (d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area
    steep = c2 * _RADIUS > _LEAST_RISE * sample.tolerance[a]  # a wall's noise is not a road
    good = np.flatnonzero(wide & steep & (np.abs(c1) <= math.tan(max_roll) * c2))[:_HYPOTHESES]
    c1, c2, a = c1[good], c2[good], a[good]
    return np.stack([d[a] - c1 * x[a] - c2 * y[a], c1, c2], 1)


@lru_cache(maxsize=8)
def _draws(seed: int) -> NDArray[np.float64]:
    """Return three numbers in [0, 1) for each triple: shape (3, _DRAWS)."""
    return np.random.default_rng(seed).random((3, _DRAWS))
