"""A map that can be estimated, the sums that every solver works on, and least squares of such sums.

One pass over the pixels of a map makes 22 sums.

`y^k` of the rotated frame is a binomial in `u` and `v`, so the energy of [GD] eq. 9 at ANY angle is a
combination of ``sum w u^i v^j`` (i + j <= 4), ``sum w d u^i v^j`` (i + j <= 2) and ``sum w d^2``.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import EstimationError, UsageError

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

LARGEST = np.float32(1e15)  # beyond this it is no disparity, and single precision could not square it
MIN_PIXELS = 100


@dataclass(frozen=True)
class CheckedMap:
    """A map that can be estimated. Make it with `CheckedMap.of`.

    Attributes
    ----------
    values : ndarray, shape (H, W)
        Disparity, px; 0 where it was too large to be one.
    usable : ndarray of bool, shape (H, W), or None
        Pixels that may be used, where a mask was given.
    valid : ndarray of bool, shape (H, W)
        Those of them that have a disparity.
    count : int
        How many these are.
    """

    values: NDArray[Any]
    usable: Bools | None
    valid: Bools
    count: int

    @classmethod
    def of(cls, disparity: ArrayLike, mask: ArrayLike | None, doffs: float = 0.0) -> "CheckedMap":
        """Check a map and its mask.

        Parameters
        ----------
        disparity : array_like, shape (H, W)
            Real numbers, px; <= 0, NaN and what is beyond `LARGEST` are no data.
        mask : array_like, shape (H, W), optional
            Neither 0 nor NaN where a pixel may be used.
        doffs : float
            See `Request`: the values have it.

        Raises
        ------
        UsageError
            When these are no map, or no mask of its size.
        EstimationError
            When there are too few valid pixels; see `require_pixels`.
        """
        values = map_of(disparity)
        if values.ndim != 2 or values.dtype.kind not in "fiub":
            raise UsageError(
                f"a disparity map is a 2-D array of real numbers, not {values.ndim}-D {values.dtype}"
            )
        usable = None if mask is None else usable_of(mask)
        if usable is not None and usable.shape != values.shape:
            here, there = ("x".join(map(str, each.shape[::-1])) for each in (usable, values))
            raise UsageError(f"the mask is {here}, the map {there}: give a mask of the map's size")
        if values.dtype.itemsize > 1 and not values.max(initial=0) < LARGEST:  # or one is NaN
            values = np.where(values >= LARGEST, 0, values)
        valid: Bools = values > 0
        if usable is not None:
            valid &= usable
        count = require_pixels(valid)
        if doffs != 0:
            values = from_infinity(values, doffs)
            valid &= values > 0
            count = require_pixels(valid, f" before the camera with a doffs of {doffs:g} px")
        return cls(values, usable, valid, count)


def map_of(disparity: ArrayLike | None) -> NDArray[Any]:
    """Return a map as an array; what a masked array hides is no data, 0.

    Raises
    ------
    UsageError
        It is None, or no array.
    """
    if disparity is None:
        raise UsageError("the disparity map is None: nothing was read")
    try:
        return _with_hidden_as_0(disparity)
    except (TypeError, ValueError) as error:
        raise UsageError(f"a disparity map is a 2-D array of real numbers: {error}") from error


def usable_of(mask: ArrayLike) -> Bools:
    """Return which pixels a mask lets be used, shape (H, W): neither 0 nor NaN nor hidden.

    Raises
    ------
    UsageError
        It is no 2-D array of numbers.
    """
    try:
        values = _with_hidden_as_0(mask)
        usable: Bools = (values > 0) | (values < 0)
    except (TypeError, ValueError) as error:
        raise UsageError(f"a mask is a 2-D array of numbers: {error}") from error
    if usable.ndim != 2:
        raise UsageError(f"a mask is a 2-D array of numbers, not {usable.ndim}-D")
    return usable


def _with_hidden_as_0(values: ArrayLike) -> NDArray[Any]:
    """Return an array in which what a masked one hides is 0."""
    return np.asarray(values.filled(0) if isinstance(values, np.ma.MaskedArray) else values)


def has_disparity(values: NDArray[Any]) -> Bools:
    """Tell which numbers of a map are disparities: above 0, and not beyond `LARGEST`."""
    return np.asarray((values > 0) & (values < LARGEST))


def from_infinity(values: NDArray[Any], doffs: float) -> NDArray[Any]:
    """Add `doffs` to the disparities of a map, so that they are 0 infinitely far away; 0 is no data, too."""
    shifted = np.add(values, doffs, dtype=np.result_type(values, np.float32))
    return np.asarray(np.where(has_disparity(values), shifted, 0))


def strips(height: int, rows: int) -> list[slice]:
    """Return the rows of a map in slices of so many, or of one: for large maps, or the processor's cache."""
    rows = max(1, rows)
    return [slice(top, min(top + rows, height)) for top in range(0, height, rows)]


def rows_and_columns(valid: Bools) -> tuple[int, int]:
    """Return how many rows and columns of (H, W) hold a valid pixel."""
    rows, columns = (int(np.count_nonzero(valid.any(axis=axis))) for axis in (1, 0))
    return rows, columns


def require_pixels(valid: Bools, where: str = "") -> int:
    """Count the valid pixels, and refuse too few of them.

    Parameters
    ----------
    valid : ndarray of bool, shape (H, W)
    where : str
        What a message says of these pixels, if they are not all that the map has.

    Returns
    -------
    int

    Raises
    ------
    EstimationError
        When there are fewer than `MIN_PIXELS`, or they fill fewer than 3 rows or 3 columns.
    """
    count = int(np.count_nonzero(valid))
    if count == 0:
        none = f": all are zero, negative, beyond {LARGEST:g}, not finite or masked out"
        raise EstimationError(f"no valid pixel{where or none}")
    if count < MIN_PIXELS:
        raise EstimationError(f"only {count} valid pixels{where}: at least {MIN_PIXELS} are needed")
    if count <= 2 * max(valid.shape):  # more cannot lie in two rows or columns
        rows, columns = rows_and_columns(valid)
        if min(rows, columns) < 3:
            filled = f"{rows} rows and {columns} columns"
            raise EstimationError(f"the valid pixels{where} fill {filled}: at least 3 of each are needed")
    return count


_ROWS = 32  # of a block: its doubles stay in the cache
_CHOOSE = np.array([[float(math.comb(j, k)) for k in range(5)] for j in range(5)])
_REST = np.maximum(np.subtract.outer(np.arange(5), np.arange(5)), 0)  # j - k


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
    aspect : float
        See `Request`.
    """

    centre_u: float
    centre_v: float
    scale: float
    aspect: float = 1.0

    @classmethod
    def of_shape(
        cls, height: int, width: int, middle: tuple[float, float] | None = None, aspect: float = 1.0
    ) -> "Grid":
        """Return the grid of a map of this shape; its origin is in the column of `middle`, if given."""
        column = (width - 1) / 2 if middle is None else middle[0]
        return cls(column, (height - 1) / 2, max(width, height, 2) / 2, aspect)

    def normalised(self, u: NDArray[Any], v: NDArray[Any]) -> tuple[Floats, Floats]:
        """Return p of columns and q of rows, each an array of the shape given."""
        return (u - self.centre_u) / self.scale, (v - self.centre_v) / self.scale


@dataclass(frozen=True)
class Moments:
    """Sums over weighted pixels.

    Attributes
    ----------
    grid : Grid
        The coordinates p, q of the sums.
    s : ndarray, shape (5, 5)
        s[i, j] = sum w p^i q^j for i + j <= 4; other entries mean nothing.
    t : ndarray, shape (3, 3)
        t[i, j] = sum w d p^i q^j for i + j <= 2, px.
    dd : float
        sum w d^2, px^2.
    peak : float
        The largest disparity, px.
    """

    grid: Grid
    s: Floats
    t: Floats
    dd: float
    peak: float


def map_moments(disparity: NDArray[Any], usable: Bools | None = None) -> Moments:
    """Sum a map; each pixel weighs 1.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px; values <= 0, NaN and inf are no data and weigh nothing.
    usable : ndarray of bool, shape (H, W), optional
        The pixels that may be used; all by default.

    Returns
    -------
    Moments
    """
    height, width = disparity.shape
    grid = Grid.of_shape(height, width)
    along, down = map(powers, grid.normalised(np.arange(width), np.arange(height)))
    s, t, dd, peak = np.zeros((5, 5)), np.zeros((3, 3)), 0.0, 0.0
    for rows in strips(height, _ROWS):
        block = np.fmax(disparity[rows], 0).astype(np.float64)  # fmax: NaN gives way to 0
        block[np.isinf(block)] = 0
        if usable is not None:
            block *= usable[rows]
        s += along @ (down[:, rows] @ (block > 0).astype(np.float64)).T
        t += along[:3] @ (down[:3, rows] @ block).T
        dd += float(np.vdot(block, block))
        peak = max(peak, float(block.max()))
    return Moments(grid, s, t, dd, peak)


def point_moments(p: Floats, q: Floats, disparity: Floats, weights: Floats, grid: Grid) -> Moments:
    """Sum scattered pixels, given by their normalised coordinates; all arrays have shape (N,)."""
    along, down, pull = powers(p), powers(q), weights * disparity
    s, t = along @ (down * weights).T, along[:3] @ (down[:3] * pull).T
    return Moments(grid, s, t, float(pull @ disparity), float(disparity.max()))


def powers(x: NDArray[np.floating[Any]], degree: int = 4) -> Floats:
    """Return x^0 to x^degree, shape (degree + 1, N); several times faster than `np.vander`."""
    rows = np.ones((degree + 1, len(x)))
    for k in range(1, degree + 1):
        np.multiply(rows[k - 1], x, out=rows[k])
    return rows


def to_powers_of_sum(offsets: Floats) -> Floats:
    """Return the matrices from powers of x to powers of x + offset, for each offset: shape (B, 5, 5)."""
    return np.asarray(_CHOOSE * powers(offsets).T[:, _REST])


_RIDGE = 1e-10  # of each diagonal element: a parameter that the pixels do not determine stays finite
_LEAST = 1e-200  # of a diagonal element, by which a row of zeros can be divided


def solve_normal(normal: Floats, pull: Floats) -> Floats:
    """Solve normal equations.

    Parameters
    ----------
    normal : ndarray, shape (..., N, N)
        Where a parameter is missing, its row and column are 0.
    pull : ndarray, shape (..., N)
        The right-hand sides.

    Returns
    -------
    ndarray, shape (..., N)
        0 for what is missing.
    """
    ridge = np.eye(normal.shape[-1])
    return np.asarray(
        np.linalg.solve(normal * (1 + _RIDGE * ridge) + _LEAST * ridge, pull[..., None])[..., 0]
    )
