"""Rotate disparity maps by their roll, so that rows of the road become constant."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.moments import Bools, Floats, has_disparity, map_of, strips

_BLOCK = 1 << 16  # pixels turned at a time: what they need stays in the processor's cache


def derotate(
    disparity: ArrayLike,
    roll: float | None = None,
    *,
    roll_deg: float | None = None,
    expand: bool = False,
    invalid: Iterable[float] = (),
) -> NDArray[Any]:
    """Rotate a map about its centre so that a rig rolled by `roll` seems level.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Any real dtype: pixels, or numbers as they are stored. NaN, inf, <= 0, what is beyond 1e15, the
        largest number of 16 bits and what a masked array hides are no data.
    roll : float
        theta of the estimate, radians, from -pi to pi.
    roll_deg : float
        The same in degrees, in place of `roll`: `image_roll_deg` of an estimate with a calibration whose fx
        and fy differ; its theta is the rig's.
    expand : bool
        Enlarge the result so that it keeps the corners.
    invalid : iterable of float
        Further values that are no data.

    Returns
    -------
    ndarray
        Of the same dtype; of the same shape unless `expand`. No data is written as the map writes it, and in
        whole numbers as 0 where that is positive.

    Raises
    ------
    UsageError
        The map is no 2-D array of real numbers, or the roll no angle: not finite, beyond pi, given twice or
        not at all.

    Notes
    -----
    Values are interpolated between valid neighbours alone. A pixel is valid where the nearest one of the map
    is, unless it is itself the nearest to one that is not: so turning there and back makes no invalid pixel
    valid, and sparse maps stay nearly as dense as they were.

    Examples
    --------
    >>> import numpy as np
    >>> v, u = np.mgrid[:5, :7]
    >>> road = 10 + v - u * np.tan(np.radians(10))
    >>> level = derotate(road, np.radians(10))
    >>> bool(np.ptp(level[2]) < 1e-9)
    True
    """
    roll = _radians(roll, roll_deg)
    values: NDArray[Any] = map_of(disparity).copy()
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise UsageError(f"cannot rotate a {values.ndim}-D array of {values.dtype}: a map is 2-D and real")
    if roll == 0 or values.size == 0:
        return values
    valid = _validity(values, invalid)
    size = _turned_size(values.shape, roll, expand)
    kept = _not_nearest_to_invalid(valid, size, roll)
    wide = np.float64 if values.dtype.itemsize > 2 and values.dtype != np.float32 else np.float32
    # a border without data, and a second one: pixels just outside have neighbours too
    padded = np.pad(np.where(valid, values, 0).astype(wide), 2)
    result = np.full(size, _no_data(values, valid), values.dtype)
    cosine, sine, (y, x) = math.cos(roll), math.sin(roll), _centred(size)
    for rows in strips(size[0], _BLOCK // size[1]):
        u = cosine * x - sine * y[rows, None] + (values.shape[1] - 1) / 2
        v = sine * x + cosine * y[rows, None] + (values.shape[0] - 1) / 2
        turned, known = _interpolated(padded, (v, u))
        known &= kept[rows]
        turned = np.rint(turned) if values.dtype.kind in "iu" else turned
        np.copyto(result[rows], turned, where=known, casting="unsafe")
    return result


def rotation_matrix(shape: tuple[int, ...], roll: float, *, expand: bool = False) -> Floats:
    """Return the matrix that takes pixels of a map to those of `derotate`'s result.

    Parameters
    ----------
    shape : tuple of int
        (H, W) of the map.
    roll : float
        Radians.
    expand : bool
        Whether the result is enlarged.

    Returns
    -------
    ndarray, shape (3, 3)
        (u, v, 1) to (x, y, 1), both from the centre of the top-left pixel. What the camera K showed at K X
        is at matrix K X: with square pixels, as a camera sees it that is turned about its axis and has its
        principal point at matrix (cx, cy, 1).
    """
    cosine, sine = math.cos(roll), math.sin(roll)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    before, after = ((np.array(each[::-1]) - 1) / 2 for each in (shape, _turned_size(shape, roll, expand)))
    return np.vstack([np.column_stack([turn, after - turn @ before]), [0.0, 0.0, 1.0]])


def _radians(roll: float | None, roll_deg: float | None) -> float:
    if (roll is None) == (roll_deg is None):
        raise UsageError("give the angle once: roll, in radians, or roll_deg, in degrees")
    angle = roll if roll is not None else math.radians(roll_deg or 0.0)
    if not math.isfinite(angle):
        raise UsageError(f"cannot rotate by {angle} radians")
    if roll is not None and abs(roll) > math.pi:
        raise UsageError(f"a roll of {roll:g} radians is beyond pi: give degrees as roll_deg={roll:g}")
    if abs(angle) > math.pi:
        raise UsageError(f"a roll of {roll_deg:g} degrees is more than half a turn: give one within 180")
    return angle


def _turned_size(shape: tuple[int, ...], roll: float, expand: bool) -> tuple[int, int]:
    """Return rows and columns of a map of this shape once it is turned."""
    height, width = shape
    if not expand:
        return height, width
    cosine, sine = abs(math.cos(roll)), abs(math.sin(roll))
    # as many more pixels on either side: the centre stays between the same pixels
    down = math.ceil((height * cosine + width * sine - height) / 2 - 1e-9)
    across = math.ceil((width * cosine + height * sine - width) / 2 - 1e-9)
    return height + 2 * down, width + 2 * across


def _centred(shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Row and column coordinates, measured from the centre."""
    rows, columns = (np.arange(side, dtype=np.float64) - (side - 1) / 2 for side in shape)
    return rows, columns


def _validity(values: NDArray[Any], invalid: Iterable[float]) -> Bools:
    valid: Bools = has_disparity(values)
    of_16_bits = values.dtype.kind in "iu" and values.dtype.itemsize == 2  # of either byte order
    saturated = [np.iinfo(values.dtype).max] if of_16_bits else []
    with np.errstate(over="ignore"):  # a value may lie beyond what the dtype holds
        for value in (*invalid, *saturated):
            valid &= values != value
    return valid


def _not_nearest_to_invalid(valid: Bools, size: tuple[int, int], roll: float) -> Bools:
    """Return the pixels of the result that no invalid pixel of the map falls on."""
    kept, (rows, columns), (v, u) = np.ones(size, bool), np.nonzero(~valid), _centred(valid.shape)
    x = math.cos(roll) * u[columns] + math.sin(roll) * v[rows] + (size[1] - 1) / 2
    y = math.cos(roll) * v[rows] - math.sin(roll) * u[columns] + (size[0] - 1) / 2
    row, column = (np.floor(each + 0.5).astype(np.intp) for each in (y, x))
    inside = (row >= 0) & (row < size[0]) & (column >= 0) & (column < size[1])
    kept[row[inside], column[inside]] = False
    return kept


def _interpolated(padded: NDArray[Any], sources: tuple[Floats, Floats]) -> tuple[NDArray[Any], Bools]:
    """Values between the valid (positive) pixels of a map padded by 2, and where the nearest one is valid."""
    width = padded.shape[1]
    v, u = (np.clip(each, -1.5, side - 3.5) for each, side in zip(sources, padded.shape, strict=True))
    top, left = np.floor(v), np.floor(u)
    down, right = (v - top).astype(padded.dtype), (u - left).astype(padded.dtype)
    corner = (top.astype(np.intp) + 2) * width + (left.astype(np.intp) + 2)
    total, weight = np.zeros_like(down), np.zeros_like(down)
    flat = padded.ravel()
    for offset, share in (
        (0, (1 - down) * (1 - right)),
        (1, (1 - down) * right),
        (width, down * (1 - right)),
        (width + 1, down * right),
    ):
        neighbour = flat[corner + offset]
        total += share * neighbour
        weight += share * (neighbour > 0)
    nearest = flat[corner + (down >= 0.5) * width + (right >= 0.5)]
    known = nearest > 0
    return np.divide(total, weight, out=total, where=known), known


def _no_data(values: NDArray[Any], valid: Bools) -> float:
    """Return how this map writes "no data"."""
    if values.dtype.kind == "u" or valid.all():
        return 0
    unused = values[~valid]
    if values.dtype.kind == "i":
        return min(int(unused.min()), 0)
    return float(unused.min() if np.isfinite(unused).all() else unused.max())  # NaN is the largest
