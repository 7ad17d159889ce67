"""The tangent of the road's parabola amid the pixels used, for the pose of the rig.

The parabola's own (a0, a1) are its tangent at y = 0, far above the road. Where the pixels are, disparity and
slope are known best, and hardly depend on how the road bends.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from rollcli.estimator.interval import Jackknife
from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.road.model import Reals, RoadModel
from rollcli.estimator.road.surface import Surface

_SINGULAR = 1e-10  # a variance below this share of its square scale is rounding error
_MOST_MOVED = 0.05  # of the slope: no road bends more, so what does is no bend of the road


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
    jackknife : Jackknife or None
        Of the pixels used; None where the map is too small for one.
    grid : Grid
        The coordinates that it is in.
    """

    theta: float
    row: float
    disparity: float
    slope: float
    jackknife: Jackknife | None = field(default=None, repr=False, compare=False)
    grid: Grid = field(default=Grid(0.0, 0.0, 1.0), repr=False, compare=False)

    @property
    def changes(self) -> Floats | None:
        """Independent errors of (disparity, slope, theta), px and radians, (N, 3): their squares add up.

        None where the map is too small to tell. They are made anew each time: few estimates need them.
        """
        if self.jackknife is None:
            return None
        grid, flat = self.grid, RoadModel(self.theta, (0.0, 0.0, 0.0))
        row, across = (of(grid.centre_u, grid.centre_v) for of in (flat.along, flat.across))
        return _in_pixels(
            _errors(self.jackknife), (self.row - row) / grid.scale, grid.scale, self.slope * across
        )

    def turned_by(self, slope: float) -> float:
        """Return by how much a slope along the rows, px per px, turns this road, radians."""
        return abs(math.cos(self.theta) * slope / self.slope) if self.slope else 0.0


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
    road, centre, cubic = RoadModel(theta, alpha), 0.0, (0.0, 0.0)
    if surface is not None:
        grid = surface.grid
        along = road.along(surface.x, surface.y)
        centre = float(surface.weights.dot(along)) / float(surface.weights.sum())
        value, moved = _parabola_of_cubic(along - centre, surface.weights)
        cubic = value * grid.scale**3, moved * grid.scale**2  # px^3 and px^2
    row = centre * grid.scale + road.along(grid.centre_u, grid.centre_v)
    _, a1, a2 = alpha
    disparity, slope = road.disparity_along(row), a1 + 2 * a2 * row
    third = _third_power(disparity, slope, a2, cubic[1])
    disparity, slope = disparity - third * cubic[0], slope - third * cubic[1]
    return Tangent(theta, row, disparity, slope, jackknife, grid)


def _parabola_of_cubic(along: Reals, weights: Floats) -> tuple[float, float]:
    """Return value and slope at 0 of the parabola that fits the cubes of some positions of mean 0."""
    squares = along * along
    weighted = weights * squares
    cubes = squares * along
    n, two, three = float(weights.sum()), float(weighted.sum()), float(weighted.dot(along))
    four, five = float(weighted.dot(squares)), float(weighted.dot(cubes))
    if not two > 0:
        return 0.0, 0.0
    skew, mean = three / two, two / n  # y^2 - skew y - mean is orthogonal to 1 and y
    norm = four - skew * three - mean * two
    bend = (five - skew * four - mean * three) / norm if norm > _SINGULAR * four else 0.0
    return three / n - mean * bend, four / two - skew * bend


def _third_power(disparity: float, slope: float, bend: float, moved: float) -> float:
    """Return the coefficient of the cube that a road of constant curvature adds to its parabola, 1/px^2.

    A road of constant vertical curvature is y = h' d + s + c / d: the third derivative of d is 6 c d'^4 / d^4
    where the second one is -2 c d'^3 / d^3. A fitted parabola takes a part of the cube for slope, `moved` for
    a coefficient of 1: up to 0.6 % of the height on a road with a radius of 1 km.
    """
    if disparity <= 0 or slope <= 0:
        return 0.0
    third = -bend * slope / disparity
    most = _MOST_MOVED * slope / max(abs(moved), 1e-300)
    return max(-most, min(most, third))


def _errors(jackknife: Jackknife) -> Floats:
    """Return independent errors of (a0, a1, a2, theta): the groups', and the textbook's as half-widths."""
    return np.concatenate([jackknife.bands, jackknife.columns, 1.96 * _roots(jackknife.white)])


def _roots(covariance: Floats) -> Floats:
    """Return independent errors, shape (4, 4), whose squares add up to a covariance: its Cholesky factor.

    Nothing for what is known exactly. NumPy's own refuses that.
    """
    wanted = covariance.tolist()
    size = len(wanted)
    roots: list[list[float]] = []
    for k in range(size):
        left = [wanted[k][j] - sum(root[k] * root[j] for root in roots) for j in range(size)]
        known = left[k] <= _SINGULAR * wanted[k][k]
        roots.append([0.0 if known or j < k else left[j] / math.sqrt(left[k]) for j in range(size)])
    return np.array(roots)


def _in_pixels(errors: Floats, centre: float, scale: float, turn: float) -> Floats:
    """Return errors of (disparity, slope, theta), px, from those in normalised coordinates.

    There the roll turns the map about its centre, here about the top-left pixel.
    """
    e0, e1, e2, turned = errors.T
    disparity = e0 + centre * (e1 + centre * e2) + turn * turned
    changes = np.empty((len(errors), 3))
    changes[:, 0], changes[:, 1], changes[:, 2] = disparity, (e1 + 2 * centre * e2) / scale, turned
    return changes
