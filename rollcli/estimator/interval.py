"""How sure the angle is: a delete-a-group jackknife over bands and columns of the road.

Neighbouring disparities are not independent, and what a road's parabola misses is smooth: the textbook
standard error is far too small. Leaving out whole bands (along the road) and whole columns (across it) shows
how far noise AND misfit move the angle. The interval is conditional on the pixels used being road, and on the
road being even across: camber and the wrong surface are not in the residuals.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from rollcli.estimator.moments import Floats
from rollcli.estimator.road.robust_fit import solvable
from rollcli.estimator.road.surface import Surface

_GROUPS = 6
_EFFECTIVE_PIXELS = 200  # neighbouring pixels repeat each other: more do not tell more
_KAPPA = 0.53  # tests/benchmarks/fit_interval.py finds 0.42; maps of other matchers ask for more
# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom
_T975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)


def half_width(surface: Surface, theta: float) -> float:
    """Return the half-width of the 95 % interval of the roll angle, radians; see `moves`."""
    bands, columns, white = moves(surface, theta)
    return _KAPPA * slant(theta) * math.sqrt(bands**2 + columns**2 + white**2)


def slant(theta: float) -> float:
    """Return how much wider the interval is at a roll, radians: 1 at none, 2 at a right angle.

    The more a road's disparity changes along the rows, the more a matcher errs that takes it for constant
    there; these errors are smooth, so that the residuals do not tell of them.
    """
    return 1 + abs(math.sin(theta))


def moves(surface: Surface, theta: float) -> tuple[float, float, float]:
    """Return what the interval is made of.

    Parameters
    ----------
    surface : Surface
        The road's pixels and their weights.
    theta : float
        The roll that was estimated from them, radians.

    Returns
    -------
    bands, columns : float
        By the jackknife over bands along the road and over columns across it, radians.
    white : float
        By the textbook formula, for as many pixels as could be independent, radians.
    """
    cosine, sine = math.cos(theta), math.sin(theta)
    across = surface.x * cosine + surface.y * sine
    along = surface.y * cosine - surface.x * sine
    a0, a1, a2 = surface.alpha
    rows = np.empty((5, len(along)))
    rows[0], rows[1], rows[2] = 1, along, along * along * surface.parabolic
    rows[3] = -across * (a1 + 2 * a2 * along)
    rows[4] = surface.d - (a0 + along * (a1 + along * a2))
    bands = _by_group(rows, surface.weights, along, np.ones_like(along))
    columns = _by_group(rows, surface.weights, across, surface.weights * np.square(rows[3]))
    total = bands.sum(0)
    normal = total[:4, :4]
    inverse = np.linalg.inv(solvable(normal))
    step = inverse @ total[:4, 4]  # from the surface's parabola to the best one
    independent = max(1.0, total[0, 0] / _EFFECTIVE_PIXELS)
    rest = max(0.0, total[4, 4] - step @ total[:4, 4])
    white = 1.96 * math.sqrt(rest / total[0, 0] * inverse[3, 3] * independent)
    return _spread(bands, normal, step), _spread(columns, normal, step), white


def _by_group(rows: Floats, weights: Floats, position: Floats, share: Floats) -> Floats:
    """Return the weighted products (6, 5, 5) of six groups of equal total `share`, cut along `position`.

    Of the five rows four are the design's; with the fifth, the residuals, a product is a group's normal
    equations, right-hand side included.
    """
    order = np.argsort(position)
    heights = np.cumsum(share[order])
    cuts = np.searchsorted(heights, heights[-1] * np.arange(1, _GROUPS) / _GROUPS)
    bounds = [0, *cuts.tolist(), len(order)]
    sorted_rows = rows[:, order]
    weighted = sorted_rows * weights[order]
    return np.stack([weighted[:, a:b] @ sorted_rows[:, a:b].T for a, b in itertools.pairwise(bounds)])


def _spread(groups: Floats, normal: Floats, step: Floats) -> float:
    """Return t * sqrt(sum of squared moves of theta) as one group after the other is left out."""
    parts, pulls = groups[:, :4, :4], groups[:, :4, 4]
    moved = np.linalg.solve(solvable(normal - parts), (pulls - parts @ step)[..., None])[:, 3, 0]
    leverage = parts[:, 3, 3] / normal[3, 3]
    freedom = max(1.0, 1 / float(np.square(leverage).sum()) - 1)
    return _student(freedom) * math.sqrt(float(np.square(moved).sum()))


def _student(freedom: float) -> float:
    """Return the 97.5 % quantile of Student's t, between whole degrees of freedom by interpolation."""
    return float(np.interp(freedom, np.arange(1, len(_T975) + 1), _T975))
