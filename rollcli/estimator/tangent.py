"""The road's tangent amid the pixels used: what the pose of the rig is read from.

The parabola's own (a0, a1) are its tangent at y = 0, far above the road. Where the pixels are, disparity and
slope are known best, and hardly depend on how the road bends.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from rollcli.estimator.interval import Jackknife
from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.road.surface import Surface


@dataclass(frozen=True)
class Tangent:
    """A line d = disparity + slope (y - row), y = v cos(theta) - u sin(theta), that touches the road.

    Attributes
    ----------
    theta : float
        Roll, radians.
    row : float
        The y where it touches, px from the centre of the top-left pixel: the mean of the pixels used.
    disparity, slope : float
        px, and px per px.
    changes : ndarray, shape (N, 3), or None
        Independent errors of (disparity, slope, theta), px and radians: their squares add up. None where
        the map is too small to tell.
    """

    theta: float
    row: float
    disparity: float
    slope: float
    changes: Floats | None = field(repr=False, compare=False)


def touch(
    alpha: tuple[float, float, float],
    theta: float,
    grid: Grid,
    surface: Surface | None,
    jackknife: Jackknife | None,
) -> Tangent:
    """Take the tangent of a road's parabola at the mean row of its pixels.

    Parameters
    ----------
    alpha : tuple of float
        The parabola, px.
    theta : float
        Roll, radians.
    grid : Grid
        Of the map; its centre is the point of contact where `surface` is None.
    surface : Surface or None
        The pixels used.
    jackknife : Jackknife or None
        Their jackknife.

    Returns
    -------
    Tangent
    """
    cosine, sine = math.cos(theta), math.sin(theta)
    centre = 0.0
    if surface is not None:
        grid = surface.grid
        x, y = (float(surface.weights @ values) for values in (surface.x, surface.y))
        centre = (y * cosine - x * sine) / float(surface.weights.sum())
    row = centre * grid.scale + grid.centre_v * cosine - grid.centre_u * sine
    a0, a1, a2 = alpha
    slope = a1 + 2 * a2 * row
    changes = None
    if jackknife is not None:
        across = grid.centre_u * cosine + grid.centre_v * sine
        changes = _in_pixels(_errors(jackknife), centre, grid.scale, slope * across)
    return Tangent(theta, row, a0 + row * (a1 + row * a2), slope, changes)


def _errors(jackknife: Jackknife) -> Floats:
    """Return independent errors of (a0, a1, a2, theta): the groups', and the textbook's as half-widths."""
    values, vectors = np.linalg.eigh(jackknife.white)
    white = (vectors * np.sqrt(np.maximum(values, 0))).T
    return np.concatenate([jackknife.bands, jackknife.columns, 1.96 * white])


def _in_pixels(errors: Floats, centre: float, scale: float, turn: float) -> Floats:
    """Return errors of (disparity, slope, theta), px, from those in normalised coordinates.

    There the roll turns the map about its centre, here about the top-left pixel.
    """
    e0, e1, e2, turned = errors.T
    disparity = e0 + centre * (e1 + centre * e2) + turn * turned
    return np.column_stack([disparity, (e1 + 2 * centre * e2) / scale, turned])
