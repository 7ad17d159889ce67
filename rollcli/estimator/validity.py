"""Which pixels of a map have a disparity, and which sets of them can determine a roll angle at all."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import EstimationError, UsageError

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
        values = np.asarray(disparity)
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
