"""Which sets of pixels can determine a roll angle at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError

LARGEST = np.float32(1e15)  # beyond this it is no disparity, and single precision could not square it
MIN_PIXELS = 100


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
