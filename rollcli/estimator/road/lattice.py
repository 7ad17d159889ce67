"""The regular grid of pixels that a map is sampled at."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Grid
from rollcli.estimator.road.neighbours import Singles


class Spacing(NamedTuple):
    """How far apart pixels are sampled, px: their rows, and their columns."""

    rows: int
    columns: int

    @classmethod
    def of(cls, pixels: float) -> "Spacing":
        """Return that of one pixel in so many, or a few more; the rows are no multiple of 3 apart.

        Matchers prefer whole pixels, and from row to row a road's disparity grows by baseline over camera
        height, which is about a third of a pixel in most cars: every third row has the same part of that
        error.
        """
        rows = max(1, int(math.sqrt(pixels)))
        rows -= rows % 3 == 0
        return cls(rows, max(1, int(pixels / rows)))


def strided(array: NDArray[Any], reach: int, spacing: Spacing) -> NDArray[Any]:
    """Return a view of the pixels so far apart that have neighbours at `reach` on all sides."""
    height, width = array.shape
    top, left = _first(reach, spacing)
    return array[top : height - reach : spacing.rows, left : width - reach : spacing.columns]


class Lattice(NamedTuple):
    """All pixels that can be sampled, row by row; arrays as in `Sample` and `CoarseSample`."""

    places: NDArray[np.intp]
    column: NDArray[np.uint16]
    x: Singles
    y: Singles


@lru_cache(maxsize=4)
def lattice_of(height: int, width: int, reach: int, spacing: Spacing) -> Lattice:
    """Lay out the pixels of maps of one size; most maps of a batch have the same."""
    grid, (top, left) = Grid.of_shape(height, width), _first(reach, spacing)
    v, u = np.arange(top, height - reach, spacing.rows), np.arange(left, width - reach, spacing.columns)
    x, y = (u - grid.centre_u) / grid.scale, (v - grid.centre_v) / grid.scale
    places = v[:, None] * width + u
    column = np.broadcast_to(np.arange(len(u)).astype(np.uint16), places.shape)
    x_of, y_of = (np.broadcast_to(each, places.shape) for each in (x, y[:, None]))
    return Lattice(
        places.ravel(), column.ravel(), *(each.astype(np.float32).ravel() for each in (x_of, y_of))
    )


def _first(reach: int, spacing: Spacing) -> tuple[int, int]:
    """Return the first row and column that are sampled."""
    rows, columns = (reach + (each // 2) % each for each in spacing)
    return rows, columns
