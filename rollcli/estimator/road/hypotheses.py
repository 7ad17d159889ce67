"""Hypotheses of a road: planes through triples of neighbouring pixels."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.neighbours import Singles, rising
from rollcli.estimator.road.subsample import Sample


def draw_planes(sample: Sample, max_roll: float, seed: int) -> Singles:
    """Return planes (K, 3) through triples of neighbouring coherent pixels, disparity growing downward."""
    tuning, radius = sample.tuning.hypotheses, sample.tuning.hypotheses.radius
    coarse = sample.coarse
    coherent = coarse.coherence >= sample.tuning.sample.coherent_from
    pool = (coherent & rising(coarse.slopes)).nonzero()[0]
    if len(pool) < 3:
        return np.empty((0, 3), np.float32)
    column = coarse.column[pool]
    pool = pool[column.argsort(kind="stable")]
    before = np.zeros(int(column.max()) + 2, np.intp)  # how many lie left of each column
    np.cumsum(np.bincount(column), out=before[1:])
    points = np.array([coarse.x, coarse.y, coarse.d])
    first, second, third = _draws(seed, tuning.draws)
    central = pool[np.abs(points[0].take(pool)) < radius]  # the road is more likely there
    both = np.concatenate([pool, central])
    a = both[(first * len(both)).astype(np.intp)]
    at, reach = coarse.column[a].astype(np.intp), int(radius / sample.pitch)
    from_ = before[np.maximum(at - reach, 0)]
    to = before[np.minimum(at + reach + 1, len(before) - 1)]
    b = pool[from_ + (second * (to - from_)).astype(np.intp)]
    c = pool[from_ + (third * (to - from_)).astype(np.intp)]
    corner = points.take(a, 1)
    x1, y1, d1 = points.take(b, 1) - corner
    x2, y2, d2 = points.take(c, 1) - corner
    area = x1 * y2 - x2 * y1
    wide = (np.abs(area) > tuning.least_area) & (np.maximum(np.abs(y1), np.abs(y2)) < radius)
    area = np.where(wide, area, 1)
    c1, c2 = (d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area
    steep = c2 * radius > tuning.least_rise * coarse.tolerance[a]  # a wall's noise is not a road
    good = (wide & steep & (np.abs(c1) <= math.tan(max_roll) * c2)).nonzero()[0][: tuning.kept]
    c1, c2, (x, y, d) = c1.take(good), c2.take(good), corner.take(good, 1)
    planes = np.empty((len(good), 3), np.float32)
    planes[:, 0], planes[:, 1], planes[:, 2] = d - c1 * x - c2 * y, c1, c2
    return planes


@lru_cache(maxsize=8)
def _draws(seed: int, count: int) -> NDArray[np.float64]:
    """Return three numbers in [0, 1) for each triple: shape (3, count)."""
    return np.random.default_rng(seed).random((3, count))
