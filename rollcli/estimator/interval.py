"""How sure the angle is: a delete-a-group jackknife over bands and columns of the road.

Neighbouring disparities are not independent, and what a road's parabola misses is smooth: the textbook
standard error is far too small. Leaving out whole bands (along the road) and whole columns (across it) shows
how far noise AND misfit move the angle. The interval is conditional on the pixels used being road, and on the
road being even across: camber and the wrong surface are not in the residuals.
"""

from __future__ import annotations

import math

import numpy as np

from rollcli.estimator.moments import Floats
from rollcli.estimator.surface import Surface

_GROUPS = 6
_EFFECTIVE_PIXELS = 2000  # neighbouring pixels repeat each other: more do not tell more
_KAPPA = 0.65  # fitted by tests/benchmarks/fit_interval.py
# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom
_T975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)


def half_width(surface: Surface, theta: float, alpha: tuple[float, float, float]) -> float:
    """Return the half-width of the 95 % interval of the roll angle.

    Parameters
    ----------
    surface : Surface
        The road's pixels and their weights.
    theta : float
        The roll that was estimated from them, radians.
    alpha : tuple of float
        The parabola in the normalised y of that roll.

    Returns
    -------
    float
        Radians.
    """
    cosine, sine = math.cos(theta), math.sin(theta)
    across = surface.x * cosine + surface.y * sine
    along = surface.y * cosine - surface.x * sine
    slope = alpha[1] + 2 * alpha[2] * along
    design = np.stack([np.ones_like(along), along, along * along, -across * slope])
    residuals = surface.d - (alpha[0] + along * (alpha[1] + along * alpha[2]))
    weighted = design * surface.weights
    normal = weighted @ design.T
    inverse = np.linalg.inv(normal + np.diag(1e-12 * np.diag(normal) + 1e-300))
    pull = weighted * residuals
    step = inverse @ pull.sum(1)
    by_band = _groups(along, np.ones_like(along))
    by_column = _groups(across, surface.weights * np.square(design[3]))
    bands = _spread(by_band, design, weighted, pull, normal, step)
    columns = _spread(by_column, design, weighted, pull, normal, step)
    total = surface.weights.sum()
    variance = float(surface.weights @ np.square(residuals)) / total
    white = variance * inverse[3, 3] * max(1.0, total / _EFFECTIVE_PIXELS)
    return _KAPPA * math.sqrt(bands**2 + columns**2 / 2 + 1.96**2 * white)


def _groups(position: Floats, share: Floats) -> list[np.ndarray]:
    """Return the pixels of each of six groups of equal total `share`, cut along `position`."""
    order = np.argsort(position)
    heights = np.cumsum(share[order])
    cuts = np.searchsorted(heights, heights[-1] * np.arange(1, _GROUPS) / _GROUPS)
    return np.split(order, cuts)


def _spread(
    groups: list[np.ndarray], design: Floats, weighted: Floats, pull: Floats, normal: Floats, step: Floats
) -> float:
    """Return t * sqrt(sum of squared moves of theta) as one group after the other is left out."""
    parts = np.stack([weighted[:, g] @ design[:, g].T for g in groups])
    pulls = np.stack([pull[:, g].sum(1) for g in groups])
    left = normal - parts
    ridge = 1e-9 * np.trace(normal) / 4 * np.eye(4)
    moves = np.linalg.solve(left + ridge, (pulls - parts @ step)[..., None])[:, 3, 0]
    leverage = parts[:, 3, 3] / normal[3, 3]
    freedom = max(1.0, 1 / float(np.square(leverage).sum()) - 1)
    return _student(freedom) * math.sqrt(float(np.square(moves).sum()))


def _student(freedom: float) -> float:
    """Return the 97.5 % quantile of Student's t, between whole degrees of freedom by interpolation."""
    return float(np.interp(freedom, np.arange(1, len(_T975) + 1), _T975))
