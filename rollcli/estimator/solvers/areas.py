"""Methods that choose pixels and take the angle of their best plane [Plane]: one area, or many that agree.

[Plane]: Ozgunalp, Fan, Ai, Dahnoun, "Multiple lane detection algorithm based on novel dense vanishing point
estimation", IEEE T-ITS 18(3) (2017). The plane d = c0 + c1 u + c2 v gives theta = atan(-c1 / c2).

[Areas]: Evans, Fan, Dahnoun, "Iterative roll angle estimation from dense disparity map", MECO 2018. One
chosen area may hold an obstacle; among many, the road's are those whose planes agree. The steps here:

1. Sum the map in tiles, 100 along its longer side; an area is 4 x 4 tiles, half of it overlapping the next.
2. Fit a plane to each area that is at least half valid. Keep those whose disparity grows downward and whose
   roll is within bounds: no walls beside the road, no sky.
3. A plane explains an area if it passes its pixels with a root mean square residual within a tolerance. The
   best area is the one whose plane explains the most pixels.
4. Fit a plane to all areas explained, and look again which areas it explains, until they stay the same.
5. The angle is that of the best plane of all pixels of these areas.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import SAME_EVERYWHERE, Energy
from rollcli.estimator.moments import Bools, Floats, Grid, map_moments, require_pixels, solve_normal
from rollcli.estimator.request import Request
from rollcli.estimator.solvers.exact import exact
from rollcli.estimator.solvers.solution import Solution, SolverStatus


class AreaFit(NamedTuple):
    """The plane of the pixels that a method chose.

    Attributes
    ----------
    used : ndarray of bool, shape (H, W)
        These pixels; all of them have a disparity.
    energy : Energy
        Of the line model over them.
    solution : Solution
        Its minimum; `iterations` counts how often the method chose anew, and `status` says whether its choice
        settled.
    """

    used: Bools
    energy: Energy
    solution: Solution


# from a map (H, W), px, which of its pixels are valid and may be used, (H, W) of bool, what is asked, and
# whether these pixels are the chosen area already
AreaMethod = Callable[[NDArray[Any], Bools, Request, bool], AreaFit]
_LOOKED_AT = " of road where the method looks"


def _fitted(
    disparity: NDArray[Any], used: Bools, rounds: int = 0, status: SolverStatus = SolverStatus.CONVERGED
) -> AreaFit:
    """Fit a plane to the chosen pixels of a map by least squares.

    Raises
    ------
    EstimationError
        When the pixels do not determine a plane.
    """
    require_pixels(used, _LOOKED_AT)
    energy = Energy.of(map_moments(disparity, used), parabolic=False)
    return AreaFit(used, energy, Solution(exact(energy).theta, rounds, status))


_ROWS = (0.6, 0.9)  # below the horizon, above a bonnet
_COLUMNS = (0.35, 0.65)


def lower_centre(disparity: NDArray[Any], usable: Bools, request: Request, chosen: bool) -> AreaFit:
    """Choose 60 to 90 % of the height and 35 to 65 % of the width, or all usable pixels.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px.
    usable : ndarray of bool, shape (H, W)
        The pixels that are valid and may be used.
    request : Request
        Of which this method takes nothing.
    chosen : bool
        Whether the usable pixels are the chosen area.

    Raises
    ------
    EstimationError
        When the pixels do not determine a plane.
    """
    used = usable
    if not chosen:
        sides = zip((_ROWS, _COLUMNS), disparity.shape, strict=True)
        area = tuple(slice(round(low * side), round(high * side)) for (low, high), side in sides)
        used = np.zeros_like(usable)
        used[area] = usable[area]
    return _fitted(disparity, used)


def tile_sums(disparity: NDArray[Any], usable: Bools, side: int) -> Floats:
    """Sum a map tile by tile; the last row and column of tiles reach over its edge.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px.
    usable : ndarray of bool, shape (H, W)
        The pixels that are valid and may be used; others weigh nothing.
    side : int
        Of a tile, px.

    Returns
    -------
    ndarray, shape (R, C, 4, 4)
        sum x x' per tile, x = (1, p, q, d), p and q as of the map's `Moments`, d in px. They add: over all
        tiles they give the entries of `Moments`.
    """
    height, width = disparity.shape
    rows, columns = -(-height // side), -(-width // side)
    p, q = Grid.of_shape(height, width).normalised(np.arange(columns * side), np.arange(rows * side))
    gram = np.empty((rows, columns, 4, 4))
    for row in range(rows):
        part = slice(row * side, (row + 1) * side)
        block, used = disparity[part], usable[part]
        terms = np.zeros((4, side, columns * side))
        terms[0, : len(block), :width] = used
        np.copyto(terms[3, : len(block), :width], block, where=used)
        np.multiply(terms[0], p, out=terms[1])
        np.multiply(terms[0], q[part, None], out=terms[2])
        by_tile = terms.reshape(4, side, columns, side).transpose(2, 0, 1, 3).reshape(columns, 4, -1)
        np.matmul(by_tile, by_tile.transpose(0, 2, 1), out=gram[row])
    return gram


def area_sums(gram: Floats, size: int, step: int) -> Floats:
    """Sum squares of tiles.

    Parameters
    ----------
    gram : ndarray, shape (R, C, 4, 4)
        Of the tiles.
    size, step : int
        Side of an area, and the distance from one to the next, in tiles.

    Returns
    -------
    ndarray, shape (R', C', 4, 4)
        Area [i, j] has its top-left tile at (i step, j step); none reaches over the last tile.
    """
    total = np.pad(gram, ((1, 0), (1, 0), (0, 0), (0, 0))).cumsum(axis=0).cumsum(axis=1)
    summed: Floats = total[size:, size:] - total[:-size, size:] - total[size:, :-size] + total[:-size, :-size]
    return summed[::step, ::step]


_TILES = 100  # along the longer side of the map
_SIZE, _STEP = 4, 2  # of an area, in tiles
_FILLED = 0.5
_TOLERANCE = 0.01  # of the mean disparity
_NOISE, _SMOOTH = 1.5, 0.1  # or 1.5 times the residual of the smoothest tenth: noise, whole pixels
_TRIED = 200  # about as many planes compete to be the best
_ROUNDS = 20
_LEVEL = 1e-6  # of the disparity in the middle: a plane that rises by less does so by rounding alone


def iterative(disparity: NDArray[Any], usable: Bools, request: Request, chosen: bool) -> AreaFit:
    """Fit planes to many small areas, and choose those that agree on one.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px.
    usable : ndarray of bool, shape (H, W)
        The pixels that are valid and may be used.
    request : Request
        The largest roll of an area's plane.
    chosen : bool
        The areas of a chosen one are looked at as others are.

    Returns
    -------
    AreaFit
        `iterations` counts the rounds of step 4.

    Raises
    ------
    EstimationError
        When no area has enough valid pixels, none looks like a road, or the pixels do not determine a plane.
    """
    require_pixels(usable, _LOOKED_AT)
    side = max(2, round(max(disparity.shape) / _TILES))
    grams = area_sums(tile_sums(disparity, usable, side), _SIZE, _STEP)
    across, grams = grams.shape[1], grams.reshape(-1, 4, 4)
    extent = _SIZE * side
    filled = np.flatnonzero(grams[:, 0, 0] >= _FILLED * extent**2)
    if len(filled) == 0:
        raise EstimationError(f"no area of {extent}x{extent} pixels is at least half valid")
    grams = grams[filled]
    planes = _planes(grams)
    roads = _look_like_road(planes, request.max_tangent)
    if not roads.any():
        if (found := disparity[usable]).min() == found.max():
            raise EstimationError(SAME_EVERYWHERE)
        raise EstimationError("no area looks like a road: disparity grows downward in none")
    agreeing, rounds, status = _agreeing(grams, planes, roads, request.max_tangent)
    covered, step = np.zeros_like(usable), _STEP * side
    for row, column in zip(*np.divmod(filled[agreeing], across), strict=True):
        covered[row * step : row * step + extent, column * step : column * step + extent] = True
    return _fitted(disparity, usable & covered, rounds, status)


def _planes(grams: Floats) -> Floats:
    """Return the least-squares planes (c0, c1, c2) of areas (N, 4, 4).

    An area is at least half valid, so that its pixels do determine a plane.
    """
    return solve_normal(grams[:, :3, :3], grams[:, :3, 3])


def _misfit(grams: Floats, planes: Floats) -> Floats:
    """Return the root mean squared residual of each plane (P, 3) in each area (A, 4, 4), shape (A, P), px."""
    x = np.concatenate([-planes, np.ones((len(planes), 1))], axis=1)
    forms = (x[:, :, None] * x[:, None, :]).reshape(-1, 16)
    squares = grams.reshape(-1, 16) @ forms.T / grams[:, :1, 0]
    return np.asarray(np.sqrt(np.maximum(squares, 0)))


def _look_like_road(planes: Floats, max_tangent: float) -> Bools:
    """Return which planes (N, 3) have a disparity that grows downward, and a roll within bounds."""
    c0, c1, c2 = planes.T
    return np.asarray((c2 > _LEVEL * np.abs(c0)) & (np.abs(c1) <= max_tangent * c2))


def _agreeing(
    grams: Floats, planes: Floats, roads: Bools, max_tangent: float
) -> tuple[Bools, int, SolverStatus]:
    """Return which areas (A,) share one plane, after how many rounds, and whether these settled.

    Parameters
    ----------
    grams : ndarray, shape (A, 4, 4)
        Sums of the areas.
    planes : ndarray, shape (A, 3)
        Their own planes.
    roads : ndarray of bool, shape (A,)
        Which of these look like a road and compete to be the best.
    max_tangent : float
        See `Request`.
    """
    competing = np.flatnonzero(roads)[:: max(1, np.count_nonzero(roads) // _TRIED)]
    misfit = _misfit(grams, planes[competing])
    own = misfit[competing, np.arange(len(competing))]
    mean = grams[roads, 0, 3].sum() / grams[roads, 0, 0].sum()
    tolerance = max(_TOLERANCE * float(mean), _NOISE * float(np.quantile(own, _SMOOTH)))
    explained = misfit <= tolerance
    chosen = explained[:, int(np.argmax(grams[:, 0, 0] @ explained))]
    for rounds in range(1, _ROUNDS + 1):
        plane = _planes(grams[chosen].sum(axis=0, keepdims=True))
        again = _misfit(grams, plane)[:, 0] <= tolerance
        if not again.any() or not _look_like_road(plane, max_tangent).all():
            return chosen, rounds, SolverStatus.DRIFTED
        if (again == chosen).all():
            return chosen, rounds, SolverStatus.CONVERGED
        chosen = again
    return chosen, _ROUNDS, SolverStatus.STEP_LIMIT
