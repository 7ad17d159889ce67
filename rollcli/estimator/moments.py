"""A map that can be estimated, and the 22 sums that every solver works on, in one pass over its pixels.

`y^k` of the rotated frame is a binomial in `u` and `v`, so the energy of [GD] eq. 9 at ANY angle is a
combination of ``sum w u^i v^j`` (i + j <= 4), ``sum w d u^i v^j`` (i + j <= 2) and ``sum w d^2``.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import EstimationError, UsageError
from rollcli.estimator.least_squares import solve_normal

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
    usable: NDArray[np.bool_] | None
    valid: NDArray[np.bool_]
    count: int

    @classmethod
    def of(cls, disparity: ArrayLike, mask: ArrayLike | None) -> "CheckedMap":
        """Check a map and its mask.

        Parameters
        ----------
        disparity : array_like, shape (H, W)
            Real numbers, px; <= 0, NaN and what is beyond `LARGEST` are no data.
        mask : array_like, shape (H, W), optional
            Non-zero where a pixel may be used.

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
        usable = None if mask is None else _checked_mask(mask, values.shape)
        if values.dtype.kind == "f" and not values.max(initial=0) < LARGEST:  # or one is NaN
            values = np.where(values >= LARGEST, 0, values)
        valid: NDArray[np.bool_] = values > 0
        if usable is not None:
            valid &= usable
        return cls(values, usable, valid, require_pixels(valid))


def map_of(disparity: ArrayLike | None) -> NDArray[Any]:
    """Return a map as an array; what a masked array hides is no data, 0.

    Raises
    ------
    UsageError
        It is None, or no array.
    """
    if disparity is None:
        raise UsageError("the disparity map is None: nothing was read")
    if isinstance(disparity, np.ma.MaskedArray):
        return np.asarray(disparity.filled(0))
    try:
        return np.asarray(disparity)
    except (TypeError, ValueError) as error:
        raise UsageError(f"a disparity map is a 2-D array of real numbers: {error}") from error


def require_pixels(valid: NDArray[np.bool_]) -> int:
    """Count the valid pixels, and refuse too few of them.

    Parameters
    ----------
    valid : ndarray of bool, shape (H, W)

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
        raise EstimationError(
            f"no valid pixel: all are zero, negative, beyond {LARGEST:g}, not finite or masked out"
        )
    if count < MIN_PIXELS:
        raise EstimationError(f"only {count} valid pixels: at least {MIN_PIXELS} are needed")
    if count <= 2 * max(valid.shape):  # more cannot lie in two rows or columns
        rows, columns = (int(np.count_nonzero(valid.any(axis=axis))) for axis in (1, 0))
        if min(rows, columns) < 3:
            raise EstimationError(
                f"the valid pixels fill {rows} rows and {columns} columns: at least 3 of each are needed"
            )
    return count


def _checked_mask(mask: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    usable: NDArray[np.bool_] = np.asarray(mask) != 0
    if usable.shape != shape:
        raise UsageError(
            f"the mask is {_size(usable.shape)}, the map {_size(shape)}: give a mask of the map's size"
        )
    return usable


def _size(shape: tuple[int, ...]) -> str:
    return "x".join(str(n) for n in shape[::-1])


Floats = NDArray[np.float64]

_ROWS = 64  # rows of a block at most, so that it stays in the cache and sums of powers are exact in float32
_ONE_THREAD = 1 << 19  # multiplications; above, OpenBLAS wakes threads, which costs more than it saves here
_SMALL = 1 << 17  # pixels; double precision costs smaller maps little
_PLANE_BITS = 20  # of the 24 that a float32 has, for the plane's value at any pixel
_CHOOSE = np.array([[float(math.comb(j, k)) for k in range(5)] for j in range(5)])
_REST = np.maximum(np.subtract.outer(np.arange(5), np.arange(5)), 0)  # j - k
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
    def of_shape(cls, height: int, width: int) -> "Grid":
        """Return the grid of a map of this shape."""
        return cls((width - 1) / 2, (height - 1) / 2, max(width, height, 2) / 2)


@dataclass(frozen=True)
class Moments:
    """Sums over weighted pixels.

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


def map_moments(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None = None,
    *,
    plane: tuple[float, float, float] | None = None,
) -> Moments:
    """Sum a map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px; values <= 0, NaN and inf are no data and weigh nothing.
    weights : ndarray, shape (H, W), optional
        Finite and not negative (or bool); all ones by default.
    plane : tuple of float, optional
        What to subtract (see `Moments.plane`); by default a fit to a coarse sample of the pixels.

    Returns
    -------
    Moments
    """
    height, width = disparity.shape
    grid = Grid.of_shape(height, width)
    p = (np.arange(width, dtype=np.float64) - grid.centre_u) / grid.scale
    q = (np.arange(height, dtype=np.float64) - grid.centre_v) / grid.scale
    if disparity.dtype.kind != "f" or disparity.dtype.itemsize < 4:
        disparity = disparity.astype(np.float32 if disparity.dtype.itemsize <= 2 else np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        if plane is None:
            plane = _exact_steps(_first_fit(disparity, weights, p, q), grid.scale)
        sums = _block_sums(disparity, weights, p, q, grid.scale, plane)
        if not np.isfinite(sums[2]):  # NaN or inf among the pixels is rare: look for it only now
            known = np.where(np.isfinite(disparity), disparity, 0)
            sums = _block_sums(known, weights, p, q, grid.scale, plane)
    return Moments(grid, plane, *sums)


def point_moments(
    p: Floats, q: Floats, disparity: Floats, weights: Floats, grid: Grid, plane: tuple[float, float, float]
) -> Moments:
    """Sum scattered pixels, given by their normalised coordinates; all arrays have shape (N,)."""
    residual = disparity - (plane[0] + plane[1] * p + plane[2] * q)
    pull = weights * residual
    columns = np.empty((8, len(q)))  # powers of q, five with the weights and three with their pull
    columns[0], columns[5] = weights, pull
    for k in (1, 2, 3, 4, 6, 7):
        np.multiply(columns[k - 1], q, out=columns[k])
    sums = powers(p).dot(columns.T)
    return Moments(grid, plane, sums[:, :5], sums[:3, 5:], float(pull.dot(residual)))


def powers(x: NDArray[np.floating[Any]], degree: int = 4) -> Floats:
    """Return x^0 to x^degree, shape (degree + 1, N); several times faster than `np.vander`."""
    rows = np.ones((degree + 1, len(x)))
    for k in range(1, degree + 1):
        np.multiply(rows[k - 1], x, out=rows[k])
    return rows


def to_powers_of_sum(offsets: Floats) -> Floats:
    """Return the matrices from powers of x to powers of x + offset, for each offset: shape (B, 5, 5)."""
    matrices: Floats = _CHOOSE * powers(offsets).T[:, _REST]
    return matrices


def _block_sums(
    disparity: NDArray[Any],
    weights: NDArray[Any] | None,
    p: Floats,
    q: Floats,
    scale: float,
    plane: tuple[float, float, float],
) -> tuple[Floats, Floats, float]:
    """Sum w p^i q^j, w r p^i q^j and w r^2: down the columns of blocks of rows, then along the rows."""
    width = disparity.shape[1]
    precision = np.float64 if disparity.size <= _SMALL else np.float32
    rows = min(_ROWS, max(8, _ONE_THREAD // (5 * width)))
    steps = np.arange(rows, dtype=np.float64) - rows // 2
    by_step = powers(steps).astype(precision)
    along = (plane[0] + plane[1] * p).astype(disparity.dtype)
    middles = q[::rows] + (rows // 2) / scale
    columns = np.empty((len(middles), 9, width), precision)  # 5 of w, then of w r 4: BLAS is faster than at 3
    mask, residual = np.empty((2, rows, width), precision)
    squares = 0.0
    for k, middle in enumerate(middles):
        block = disparity[k * rows : (k + 1) * rows]
        n = len(block)
        m, r = mask[:n], residual[:n]
        np.copyto(m, block > 0)
        if weights is not None:
            m *= weights[k * rows : (k + 1) * rows]
        # within a block the plane's part along q is constant here, and exact below
        np.subtract(block, along + along.dtype.type(plane[2] * middle), out=r, casting="same_kind")
        if weights is None:
            r *= m
            squares += float(np.vdot(r, r))
        else:
            raw = r * (m > 0)
            r *= m
            squares += float(np.vdot(r, raw))
        np.matmul(by_step[:, :n], m, out=columns[k, :5])
        np.matmul(by_step[:4, :n], r, out=columns[k, 5:])
    across = _along_rows(columns, p)
    s, t = across[:, :5], across[:, 5:8, :3]  # per block: powers of the step, powers of p
    slope = plane[2] / scale
    squares -= slope * float((2 * t[:, 1, 0] - slope * s[:, 2, 0]).sum())
    t -= slope * s[:, 1:4, :3]
    to_q = _from_steps(middles, scale)
    return (to_q @ s).sum(axis=0).T, (to_q[:, :3, :3] @ t).sum(axis=0).T, squares


def _along_rows(columns: NDArray[Any], p: Floats) -> Floats:
    """Return the sums of columns (B, 9, W) times p^0 to p^4, shape (B, 9, 5)."""
    blocks, kinds, width = columns.shape
    padded = np.zeros((width, 8))  # BLAS is faster at 8 than at 5
    padded[:, :5] = powers(p).T
    some = max(1, _ONE_THREAD // (kinds * 8 * width))
    parts = [
        columns[k : k + some].reshape(-1, width).astype(np.float64) @ padded for k in range(0, blocks, some)
    ]
    return np.concatenate(parts).reshape(blocks, kinds, 8)[..., :5]


def _from_steps(middles: Floats, scale: float) -> Floats:
    """Return the matrices from powers of a step to powers of q = middle + step / scale, shape (B, 5, 5)."""
    matrices: Floats = to_powers_of_sum(middles) / scale ** np.arange(5)
    return matrices


def _exact_steps(plane: tuple[float, float, float], scale: float) -> tuple[float, float, float]:
    """Round a plane so that its value at any pixel is exact in float32: rounding there would tilt it."""
    largest = sum(abs(c) for c in plane)
    if not 1e-30 < largest < 1e30:
        return plane
    quantum = 2.0 ** (math.frexp(largest)[1] - _PLANE_BITS)
    c0, c1, c2 = plane
    per_unit = quantum * scale
    return round(c0 / quantum) * quantum, round(c1 / per_unit) * per_unit, round(c2 / per_unit) * per_unit


def _first_fit(
    disparity: NDArray[Any], weights: NDArray[Any] | None, p: Floats, q: Floats
) -> tuple[float, float, float]:
    """Fit a plane to a coarse grid of the pixels."""
    height, width = disparity.shape
    rows = slice(height // _GUESS_SIDE // 2, None, max(1, height // _GUESS_SIDE))
    columns = slice(width // _GUESS_SIDE // 2, None, max(1, width // _GUESS_SIDE))
    sample = disparity[rows, columns]
    used = (sample > 0) & (sample < np.inf)
    if weights is not None:
        used &= weights[rows, columns] > 0
    x, y = powers(p[columns], 2), powers(q[rows], 2)
    s = y @ used @ x.T
    t = y[:2] @ np.where(used, sample, 0) @ x[:2].T
    normal = np.array([[s[0, 0], s[0, 1], s[1, 0]], [s[0, 1], s[0, 2], s[1, 1]], [s[1, 0], s[1, 1], s[2, 0]]])
    c0, c1, c2 = solve_normal(normal, np.array([t[0, 0], t[0, 1], t[1, 0]])).tolist()
    return c0, c1, c2
