"""What the view shows of a road: how wide it is, and how much of the lane ahead lies on the road.

Tables, shelves and the floors of rooms are as even as roads. But a camera that stands on a road sees several
of its own heights to the sides, and most of the lane ahead; a road that is seen from close by fills the view.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.road.surface import Surface

_COLUMNS = 160  # looked at; shares need no more
_TOLERANCE = 0.03  # of the road's disparity, within which a pixel is on it


class View(NamedTuple):
    """How wide the view is at its bottom, camera heights, and the share of the lane that is seen, 0 to 1.

    The share is the mean of those in the middle and in the far third of the ground, of the pixels with data.
    """

    width: float
    seen: float


def view_of(disparity: NDArray[Any], valid: NDArray[np.bool_], surface: Surface, rmse: float) -> View:
    """Look at a map from the place of the camera over a surface.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        px.
    valid : ndarray of bool, shape (H, W)
    surface : Surface
        The road.
    rmse : float
        Of its pixels, px.

    Returns
    -------
    View
    """
    height, width = disparity.shape
    step = -(-width // _COLUMNS)
    model, grid = surface.model, surface.grid
    level, slope, bend = model.alpha
    x = (np.arange(0, width, step) - grid.centre_u) / grid.scale
    y = ((np.arange(0, height, step) - grid.centre_v) / grid.scale)[:, None]
    along = model.along(x, y)
    road = model.disparity_along(along)
    d, usable = disparity[::step, ::step], valid[::step, ::step]
    lane = usable & (road > 0) & (np.abs(model.side(model.across(x, y), road)) < 1)
    on_road = np.abs(d - road) < _TOLERANCE * road + 3 * rmse
    horizon = max(float(along.min()), -level / slope if slope else -np.inf)
    thirds = 3 * (along - horizon) / max(float(along.max()) - horizon, 1e-9)
    shares: list[float] = []
    for first in (0, 1):
        there = lane & (thirds >= first) & (thirds < first + 1)
        shares.append(float((on_road & there).sum()) / max(1.0, float(there.sum())))
    bottom = model.along(0.0, (height - 1 - grid.centre_v) / grid.scale)
    nearest = model.disparity_along(bottom)
    wide = width / grid.scale * abs(slope + 2 * bend * bottom) / nearest if nearest > 0 else np.inf
    return View(float(wide), float(np.mean(shares)))
