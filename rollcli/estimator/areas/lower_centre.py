"""One chosen area of the map, by default where a road most often is [Plane]; see `plane`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.areas.plane import AreaPixels
from rollcli.estimator.methods import DEFAULT_AREA, AreaSettings

_ROWS = (0.6, 0.9)  # below the horizon, above a bonnet
_COLUMNS = (0.35, 0.65)


def lower_centre(
    disparity: NDArray[Any], usable: NDArray[np.bool_], settings: AreaSettings = DEFAULT_AREA
) -> AreaPixels:
    """Choose 60 to 90 % of the height and 35 to 65 % of the width, or all usable pixels.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Real numbers, px.
    usable : ndarray of bool, shape (H, W)
        The pixels that are valid and may be used.
    settings : AreaSettings
        Whether the usable pixels are the chosen area.

    Returns
    -------
    AreaPixels
        With 0 iterations.
    """
    if settings.chosen:
        return AreaPixels(usable)
    used = np.zeros(disparity.shape, np.bool_)
    area = lower_centre_slices(*disparity.shape)
    used[area] = usable[area]
    return AreaPixels(used)


def lower_centre_slices(height: int, width: int) -> tuple[slice, slice]:
    """Return the rows and columns of the default area."""
    rows, columns = (
        slice(round(low * n), round(high * n)) for (low, high), n in ((_ROWS, height), (_COLUMNS, width))
    )
    return rows, columns
