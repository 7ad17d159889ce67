"""Sums of a map tile by tile, in one pass: enough for the best plane of any area made of tiles."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats, Grid


@dataclass(frozen=True)
class Tiles:
    """The sums of a map's tiles.

    Attributes
    ----------
    grid : Grid
        The coordinates p, q, those of the map's `Moments`.
    side : int
        Of a square tile, px; the last row and column of tiles reach over the edge of the map.
    gram : ndarray, shape (R, C, 4, 4)
        sum w x x' per tile, x = (1, p, q, d): the moments up to degree 2, with d in px. They add: over all
        tiles they give the entries of `Moments`.
    """

    grid: Grid
    side: int
    gram: Floats

    def areas(self, size: int, step: int) -> Floats:
        """Sum squares of tiles.

        Parameters
        ----------
        size, step : int
            Side of an area, and the distance from one to the next, in tiles.

        Returns
        -------
        ndarray, shape (R', C', 4, 4)
            Area [i, j] has its top-left tile at (i step, j step); none reaches over the last tile.
        """
        total = np.pad(self.gram, ((1, 0), (1, 0), (0, 0), (0, 0))).cumsum(axis=0).cumsum(axis=1)
        summed: Floats = (
            total[size:, size:] - total[:-size, size:] - total[size:, :-size] + total[:-size, :-size]
        )
        return summed[::step, ::step]


def tile_sums(disparity: NDArray[Any], weights: NDArray[Any] | None, side: int) -> Tiles:
    """Sum a map tile by tile.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px; values <= 0, NaN and inf are no data and weigh nothing.
    weights : ndarray, shape (H, W), optional
        Finite and not negative (or bool); all ones by default.
    side : int
        Of a tile, px.

    Returns
    -------
    Tiles
    """
    height, width = disparity.shape
    rows, columns = -(-height // side), -(-width // side)
    step = np.arange(side) - (side - 1) / 2
    powers = np.stack([np.ones(side), step, step * step])
    local = np.empty((rows, columns, 4, 4))
    known = np.zeros((side, columns * side))
    mask = np.zeros_like(known)
    for row in range(rows):
        block = disparity[row * side : (row + 1) * side]
        used = (block > 0) & (block < np.inf)
        known[:], mask[:] = 0, 0
        mask[: len(block), :width] = (
            used if weights is None else used * weights[row * side : (row + 1) * side]
        )
        np.copyto(known[: len(block), :width], block, where=used)
        along = [
            (each.reshape(side, columns, side) @ powers.T) for each in (mask, mask * known, mask * known**2)
        ]
        n, d, dd = (
            np.einsum("ki,ijl->jkl", powers, each) for each in along
        )  # [column, power of q, power of p]
        local[row] = _symmetric(n, d, dd)
    grid = Grid.of_shape(height, width)
    return Tiles(grid, side, _on_grid(local, grid, side))


def _symmetric(n: Floats, d: Floats, dd: Floats) -> Floats:
    """Arrange sums [..., power of y, power of x] of w, w d and w d^2 as sum w z z', z = (1, x, y, d)."""
    return np.stack(
        [
            np.stack([n[..., 0, 0], n[..., 0, 1], n[..., 1, 0], d[..., 0, 0]], axis=-1),
            np.stack([n[..., 0, 1], n[..., 0, 2], n[..., 1, 1], d[..., 0, 1]], axis=-1),
            np.stack([n[..., 1, 0], n[..., 1, 1], n[..., 2, 0], d[..., 1, 0]], axis=-1),
            np.stack([d[..., 0, 0], d[..., 0, 1], d[..., 1, 0], dd[..., 0, 0]], axis=-1),
        ],
        axis=-2,
    )


def _on_grid(local: Floats, grid: Grid, side: int) -> Floats:
    """Move sums from pixels around each tile's centre to the grid's coordinates."""
    rows, columns = local.shape[:2]
    middle = (side - 1) / 2
    moved = np.zeros((rows, columns, 4, 4))
    moved[..., 0, 0] = moved[..., 3, 3] = 1
    moved[..., 1, 1] = moved[..., 2, 2] = 1 / grid.scale
    moved[..., 1, 0] = (np.arange(columns) * side + middle - grid.centre_u) / grid.scale
    moved[..., 2, 0] = ((np.arange(rows) * side + middle - grid.centre_v) / grid.scale)[:, None]
    on_grid: Floats = moved @ local @ np.swapaxes(moved, -1, -2)
    return on_grid
