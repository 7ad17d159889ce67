"""The lane ahead as a lidar sees it: what its roll is, by fits in metres to a part of the road."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from rollcli.simulate.relief import Relief
from rollcli.simulate.vectors import Array

HALF_WIDTHS = (0.8, 1.2, 1.6)  # metres to each side of the left camera's path
FAR_ENDS = (15.0, 20.0, 25.0)  # metres
NEAR_END = 4.0  # metres
_STEP = 0.1  # metres across
_ROWS = 64  # points along


class LanePoints(NamedTuple):
    """Points (N,) on the lane: lateral position and Z, metres, and how many points of a lidar each is.

    A lidar's points are as dense as an image's pixels: their number falls with the third power of Z.
    """

    lateral: Array
    z: Array
    weight: Array


def lane_points() -> LanePoints:
    """Return points all over the widest and longest part."""
    widest, farthest = HALF_WIDTHS[-1], FAR_ENDS[-1]
    across = np.arange(-widest + _STEP / 2, widest, _STEP)
    ahead = 1 / np.linspace(1 / NEAR_END, 1 / farthest, _ROWS)
    lateral, z = (grid.ravel() for grid in np.meshgrid(across, ahead))
    return LanePoints(lateral, z, 1 / z)


def lane_plane(relief: Relief) -> tuple[float, float, float]:
    """Return height, slope to the right and slope ahead of the plane that fits the lane, metres.

    Its middle part, 1.2 m to each side and up to 20 m ahead; a curvature along the road is fitted with it.
    """
    lateral, z, weight = lane_points()
    used = (np.abs(lateral) < HALF_WIDTHS[1]) & (z < FAR_ENDS[1])
    design = np.array([np.ones_like(z), lateral, z, z * z])
    level, right, ahead, _ = _fit(design, relief.height(lateral, z), weight * used)
    return level, right, ahead


def lane_rolls(points: Array, lane: LanePoints) -> tuple[float, float]:
    """Return the least and the greatest roll of the lane, radians, by the parts and with and without camber.

    Parameters
    ----------
    points : numpy.ndarray
        (3, N); the lane's points, right, down and forward of the camera, metres.
    lane : LanePoints
        Where on the road they are.

    Notes
    -----
    A plane Y = a + b X + c Z has the disparity d ~ v - b u + ..., whose theta is atan(b). The fit has e Z^2
    too, and in every second one k X^2.
    """
    x, y, z = points
    rows = np.array([np.ones_like(x), x, z, z * z, x * x])
    rolls = []
    for width, far, terms in itertools.product(HALF_WIDTHS, FAR_ENDS, (4, 5)):
        used = (np.abs(lane.lateral) < width) & (lane.z < far)
        rolls.append(math.atan(_fit(rows[:terms], y, lane.weight * used)[1]))
    return min(rolls), max(rolls)


def _fit(design: Array, values: Array, weight: Array) -> list[float]:
    root = np.sqrt(weight)
    found: list[float] = np.linalg.lstsq((design * root).T, values * root, rcond=None)[0].tolist()
    return found
