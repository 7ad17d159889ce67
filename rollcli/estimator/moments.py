"""The 22 sums of a disparity map that every solver works on, in one pass over its pixels.

`y^k` of the rotated frame is a binomial in `u` and `v`, so the energy of [GD] eq. 9 at ANY angle is a
combination of ``sum w u^i v^j`` (i + j <= 4), ``sum w d u^i v^j`` (i + j <= 2) and ``sum w d^2``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ROWS = 64  # rows of a block: it and its mask stay in the second-level cache
_LANES = 8  # columns of the power matrix: BLAS multiplies by 8 columns faster than by 5
_GUESS_SIDE = 20  # the first fit looks at about this many rows and columns


@dataclass(frozen=True)
class Grid:
    """The normalised coordinates p = (u - centre_u) / scale and q = (v - centre_v) / scale.

    E_min does not change under a shift or a scaling of (u, v); the conditioning of its sums does.

    Attributes
    ----------
    centre_u, centre_v : float
        The origin, pixels from the centre of the top-left pixel.
    scale : float
        Pixels per unit; half the longer side of the map.
    """

    centre_u: float
    centre_v: float
    scale: float

    @classmethod
    def of_shape(cls, height: int, width: int) -> Grid:
        """Return the grid of a map of this shape."""
        return cls((width - 1) / 2, (height - 1) / 2, max(width, height, 2) / 2)


@dataclass(frozen=True)
class Moments:
    """Sums over weighted pixels; they add, so a map is the sum of its tiles.

    Attributes
    ----------
    grid : Grid
        The coordinates p, q of the sums.
    plane : tuple of float
        (c0, c1, c2): what was subtracted, r = d - (c0 + c1 p + c2 q), px. `d'd` and `d'YJd` cancel near
        the minimum; the same sums of `r` do not.
    s : ndarray, shape (5, 5)
        s[i, j] = sum w p^i q^j for i + j <= 4; other entries mean nothing.
    t : ndarray, shape (3, 3)
        t[i, j] = sum w r p^i q^j for i + j <= 2, px.
    rr : float
        sum w r^2, px^2.
    """

    grid: Grid
    plane: tuple[float, float, float]
    s: Floats
    t: Floats
    rr: float

    @property
    def weight(self) -> float:
        """The sum of the weights: with weights 0 and 1, the number of pixels."""
        return float(self.s[0, 0])

    def __add__(self, other: Moments) -> Moments:
        if (self.grid, self.plane) != (other.grid, other.plane):
            raise ValueError("moments add on one grid and one plane only")
        return replace(self, s=self.s + other.s, t=self.t + other.t, rr=self.rr + other.rr)


def map_moments(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None = None,
    *,
    grid: Grid | None = None,
    origin: tuple[int, int] = (0, 0),
    plane: tuple[float, float, float] | None = None,
) -> Moments:
    """Sum a map, or a tile of one.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px; values <= 0, NaN and inf are no data and weigh nothing.
    weights : ndarray, shape (H, W), optional
        Finite and not negative (or bool); all ones by default.
    grid : Grid, optional
        The coordinates; by default those of this map's shape.
    origin : tuple of int
        (row, column) of `disparity[0, 0]` on the grid, for tiles.
    plane : tuple of float, optional
        What to subtract (see `Moments.plane`); by default a fit to a coarse sample of the pixels.

    Returns
    -------
    Moments
    """
    height, width = disparity.shape
    grid = grid or Grid.of_shape(height, width)
    p = (np.arange(origin[1], origin[1] + width) - grid.centre_u) / grid.scale
    q = (np.arange(origin[0], origin[0] + height) - grid.centre_v) / grid.scale
    if disparity.dtype.kind != "f" or disparity.dtype.itemsize < 4:
        disparity = disparity.astype(np.float32 if disparity.dtype.itemsize <= 2 else np.float64)
    if plane is None:
        plane = _first_fit(disparity, weights, p, q)
    with np.errstate(invalid="ignore", over="ignore"):
        weight_rows, residual_rows, rr = _row_sums(disparity, weights, p, q, plane)
    if not np.isfinite(rr):  # NaN or inf among the pixels: rare enough to look only now
        known = np.where(np.isfinite(disparity), disparity, 0)
        weight_rows, residual_rows, rr = _row_sums(known, weights, p, q, plane)
    powers = np.vander(q, 5, increasing=True).T
    s = (powers @ weight_rows[:, :5]).T
    t = (powers[:3] @ residual_rows[:, :3]).T
    return Moments(grid, plane, s, t, rr)


def point_moments(
    p: Floats, q: Floats, disparity: Floats, weights: Floats, grid: Grid, plane: tuple[float, float, float]
) -> Moments:
    """Sum scattered pixels, given by their normalised coordinates; all arrays have shape (N,)."""
    rows = np.vander(p, 5, increasing=True)
    columns = np.vander(q, 5, increasing=True)
    residual = disparity - (plane[0] + plane[1] * p + plane[2] * q)
    pull = weights * residual
    s = (rows * weights[:, None]).T @ columns
    t = (rows[:, :3] * pull[:, None]).T @ columns[:, :3]
    return Moments(grid, plane, s, t, float(pull @ residual))


def _row_sums(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None,
    p: Floats,
    q: Floats,
    plane: tuple[float, float, float],
) -> tuple[Floats, Floats, float]:
    """Sum along the rows: w p^k and w r p^k, shape (H, 8) each; then sum w r^2."""
    height, width = disparity.shape
    powers = np.zeros((width, _LANES), np.float32)
    powers[:, :5] = np.vander(p, 5, increasing=True)
    along = (plane[0] + plane[1] * p).astype(disparity.dtype)
    # The plane's part along q is one constant a block, exact per row again below: one operation less a pixel.
    middle = np.repeat(q[_ROWS // 2 :: _ROWS], _ROWS)[:height]
    middle = np.concatenate([middle, np.full(height - len(middle), q[-1])])
    stack = np.empty((2 * _ROWS, width), np.float32)
    sums = np.empty((2, height, _LANES))
    squares = 0.0
    for top in range(0, height, _ROWS):
        block = disparity[top : top + _ROWS]
        n = len(block)
        mask, residual = stack[:n], stack[n : 2 * n]
        np.copyto(mask, block > 0)
        if weights is not None:
            mask *= weights[top : top + n]
        offset = along + along.dtype.type(plane[2] * middle[top])
        np.subtract(block, offset, out=residual, casting="same_kind")
        if weights is None:
            residual *= mask
            squares += float(np.vdot(residual, residual))
        else:
            raw = residual * (mask > 0)
            residual *= mask
            squares += float(np.vdot(residual, raw))
        product = stack[: 2 * n] @ powers
        sums[:, top : top + n] = product.reshape(2, n, _LANES)
    weight_rows, residual_rows = sums
    rest = plane[2] * (q - middle)
    squares += float(rest @ (rest * weight_rows[:, 0] - 2 * residual_rows[:, 0]))
    residual_rows -= rest[:, None] * weight_rows
    return weight_rows, residual_rows, squares


def _first_fit(
    disparity: NDArray[Any], weights: NDArray[Any] | None, p: Floats, q: Floats
) -> tuple[float, float, float]:
    """Fit a plane to a coarse grid of the pixels; (mean, 0, 0) where they do not determine one."""
    height, width = disparity.shape
    rows = slice(height // _GUESS_SIDE // 2, None, max(1, height // _GUESS_SIDE))
    columns = slice(width // _GUESS_SIDE // 2, None, max(1, width // _GUESS_SIDE))
    sample = disparity[rows, columns]
    used = (sample > 0) & np.isfinite(sample)
    if weights is not None:
        used &= weights[rows, columns] > 0
    v, u = np.nonzero(used)
    if len(v) == 0:
        return 0.0, 0.0, 0.0
    design = np.stack([np.ones(len(v)), p[columns][u], q[rows][v]])
    values = sample[used].astype(np.float64)
    normal = design @ design.T
    if np.linalg.cond(normal) > 1e8:
        return float(values.mean()), 0.0, 0.0
    c0, c1, c2 = np.linalg.solve(normal, design @ values)
    return float(c0), float(c1), float(c2)
