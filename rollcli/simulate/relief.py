"""Unevenness of the ground: rough roads, and what the roll of the lane ahead is on one.

Rough roads are uneven by the classes of ISO 8608, with mended patches and a lane that sinks in its tracks.
[ISO]: ISO 8608, "Mechanical vibration - Road surface profiles": the density of a profile's heights is
G(n0) (n / n0)^-2 over the waves' number per metre n, G(n0) four times as large from class to class.
[Isotropy]: Kamash, Robson, "The application of isotropy in road surface modelling", J. Sound and Vibration
57(1), 1978: a surface has such profiles in all directions, which tells how alike its two tracks are.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.options import ROUGHNESS

Array = NDArray[np.float64]
Vectors = NDArray[Any]

# of the lane, as a lidar sees it
HALF_WIDTHS = (0.8, 1.2, 1.6)  # metres to each side of the left camera's path
FAR_ENDS = (15.0, 20.0, 25.0)  # metres
NEAR_END = 4.0  # metres
_LANE_STEP = 0.1  # metres across
_LANE_ROWS = 64  # points along
_FLOOR = 0.5  # of a dip's radius: so far out it is as deep as in its middle
_AROUND = 1.2  # radii: a dip ends at the first
# of rough roads
_REFERENCE = 0.1  # waves per metre: n0 of [ISO]
_SMOOTHEST = 16e-6  # m^3: G(n0) of class A, the geometric mean of its bounds
_WAVES = 0.011, 2.83  # waves per metre: the range of [ISO]
STEP = 0.125  # metres: 2.8 nodes for the shortest wave
LEFT, _START = -32.0, -8.0  # metres: where the first column and the first row are
_ACROSS, _ALONG = 512, 2048  # nodes: 64 by 256 metres
_SUNKEN = 0.003  # metres: the deepest track, and the highest patch, of class A
_TRACK = 0.22  # metres: standard deviation of a track's depth across
_MOST_PATCHES = 4


@dataclass(frozen=True)
class Dip:
    """An ellipse of the road that lies lower, or higher where `height` is positive; metres.

    `lateral` and `z` are its middle in road coordinates, `across` and `along` its radii.
    """

    lateral: float
    z: float
    across: float
    along: float
    height: float

    def relief(self, lateral: Vectors, z: Vectors) -> tuple[Vectors, Vectors, Vectors]:
        """Return height over the road, metres, and its slopes by lateral and by z."""
        x, y = (lateral - self.lateral) / self.across, (z - self.z) / self.along
        out = np.hypot(x, y)
        fall = np.clip((out - _FLOOR) / (1 - _FLOOR), 0, 1)
        by_out = -np.pi / 2 / (1 - _FLOOR) * np.sin(np.pi * fall) * self.height / np.maximum(out, _FLOOR)
        height = self.height * (0.5 + 0.5 * np.cos(np.pi * fall))
        return height, by_out * x / self.across, by_out * y / self.along


@dataclass(frozen=True, eq=False)
class Relief:
    """How much the ground is higher than its smooth shape, bilinear between the nodes of a grid.

    Attributes
    ----------
    heights : numpy.ndarray
        (rows along, columns across), metres, `STEP` apart; beyond its edges the ground goes on level.
    dips : tuple of Dip
        What lies lower or higher than that.
    """

    heights: Array
    dips: tuple[Dip, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """The lowest and the greatest height, metres."""
        dips = [0.0, *(dip.height for dip in self.dips)]
        return float(self.heights.min()) + min(dips), float(self.heights.max()) + max(dips)

    def is_between(self, low: Array, high: Array) -> NDArray[np.bool_]:
        """Tell where it may be uneven from the least lateral and Z to the greatest, each (2, N), metres."""
        found = np.full(low.shape[1:], bool(self.heights.any()))
        for dip in self.dips:
            middle = np.array([[dip.lateral], [dip.z]])
            radius = _AROUND * np.array([[dip.across], [dip.along]])
            found |= ((high > middle - radius) & (low < middle + radius)).all(axis=0)
        return found

    def height(self, lateral: Vectors, z: Vectors) -> Vectors:
        """Return the heights (N,) at positions (N,), metres."""
        near, right_near, far, right_far, across, along = self._corners(lateral, z)
        first, last = near + across * (right_near - near), far + across * (right_far - far)
        return np.asarray(
            sum((dip.relief(lateral, z)[0] for dip in self.dips), first + along * (last - first))
        )

    def slopes(self, lateral: Vectors, z: Vectors) -> tuple[Vectors, Vectors]:
        """Return the slopes (N,) to the right and ahead at positions (N,), metres per metre."""
        near, right_near, far, right_far, across, along = self._corners(lateral, z)
        right = ((right_near - near) * (1 - along) + (right_far - far) * along) / STEP
        ahead = ((far - near) * (1 - across) + (right_far - right_near) * across) / STEP
        for dip in self.dips:
            _, by_lateral, by_z = dip.relief(lateral, z)
            right, ahead = right + by_lateral, ahead + by_z
        return right, ahead

    def _corners(self, lateral: Vectors, z: Vectors) -> tuple[Vectors, ...]:
        """Return the heights around positions, two near and two far ones, and where these lie between."""
        rows, columns = self.heights.shape
        across = np.clip((lateral - LEFT) / STEP, 0, columns - 1.001)
        along = np.clip((z - _START) / STEP, 0, rows - 1.001)
        column, row = across.astype(np.intp), along.astype(np.intp)
        node, flat = row * columns + column, self.heights.ravel()
        corners = (flat.take(node + more) for more in (0, 1, columns, columns + 1))
        return *corners, across - column, along - row


LEVEL = Relief(np.zeros((2, 2)))


def lane_points() -> tuple[Array, Array, Array]:
    """Return points (N,) all over the lane: lateral position and Z, metres, and how many of a lidar each is.

    A lidar's points are as dense as an image's pixels: their number falls with the third power of Z.
    """
    widest, farthest = HALF_WIDTHS[-1], FAR_ENDS[-1]
    across = np.arange(-widest + _LANE_STEP / 2, widest, _LANE_STEP)
    ahead = 1 / np.linspace(1 / NEAR_END, 1 / farthest, _LANE_ROWS)
    lateral, z = (grid.ravel() for grid in np.meshgrid(across, ahead))
    return lateral, z, 1 / z


def lane_parabola(relief: Relief) -> list[float]:
    """Return height, slope to the right, slope ahead and half the curvature of what fits the lane, metres.

    Of its middle part, 1.2 m to each side and up to 20 m ahead.
    """
    lateral, z, weight = lane_points()
    used = (np.abs(lateral) < HALF_WIDTHS[1]) & (z < FAR_ENDS[1])
    design = np.array([np.ones_like(z), lateral, z, z * z])
    return _fit(design, relief.height(lateral, z), weight * used)


def lane_rolls(points: Array, lateral: Array, ahead: Array, weight: Array) -> tuple[float, float]:
    """Return the least and the greatest roll of the lane, radians, by the parts and with and without camber.

    Parameters
    ----------
    points : numpy.ndarray
        (3, N); the lane's points, right, down and forward of the camera, metres.
    lateral, ahead, weight : numpy.ndarray
        Where on the road they are, as `lane_points` has it.

    Notes
    -----
    A plane Y = a + b X + c Z has the disparity d ~ v - b u + ..., whose theta is atan(b). The fit has e Z^2
    too, and in every second one k X^2.
    """
    x, y, z = points
    rows = np.array([np.ones_like(x), x, z, z * z, x * x])
    rolls = []
    for width, far, terms in itertools.product(HALF_WIDTHS, FAR_ENDS, (4, 5)):
        used = (np.abs(lateral) < width) & (ahead < far)
        rolls.append(math.atan(_fit(rows[:terms], y, weight * used)[1]))
    return min(rolls), max(rolls)


def _fit(design: Array, values: Array, weight: Array) -> list[float]:
    root = np.sqrt(weight)
    found: list[float] = np.linalg.lstsq((design * root).T, values * root, rcond=None)[0].tolist()
    return found


def draw_relief(
    rng: np.random.Generator, roughness: str, edges: tuple[float, float], wheels: tuple[float, float]
) -> Relief:
    """Draw the unevenness of a road.

    Parameters
    ----------
    rng : numpy.random.Generator
    roughness : str
        One of `ROUGHNESS`.
    edges : tuple of float
        Of the carriageway, lateral, metres.
    wheels : tuple of float
        Lateral positions of the lane's two tracks, metres.

    Returns
    -------
    Relief
        At a height of 0 below the rig, on the parabola that fits the lane ahead (`lane_parabola`).
    """
    scale = 2.0 ** ROUGHNESS.index(roughness)  # of heights, whose squares are four times as large
    lateral, z = LEFT + STEP * np.arange(_ACROSS), _START + STEP * np.arange(_ALONG)
    heights = scale * _random_field(rng)
    for wheel in wheels:
        depth = rng.uniform(0, scale * _SUNKEN)
        heights -= depth * np.exp(-np.square((lateral - wheel) / _TRACK) / 2)
    for _ in range(rng.integers(_MOST_PATCHES + 1)):
        x, ahead = rng.uniform(*edges), rng.uniform(3, 40)
        wide, long, raised = rng.uniform(0.5, 2.0), rng.uniform(0.8, 6.0), rng.uniform(-1, 1)
        across = (lateral >= x) & (lateral < min(x + wide, edges[1]))
        heights[np.ix_((z >= ahead) & (z < ahead + long), across)] += scale * _SUNKEN * raised
    relief = Relief(heights)
    heights -= lane_parabola(relief)[0]
    return relief


def _random_field(rng: np.random.Generator) -> Array:
    """Draw heights (rows, columns) of class A, whose profiles have the same density in all directions."""
    along, across = np.fft.fftfreq(_ALONG, STEP)[:, None], np.fft.rfftfreq(_ACROSS, STEP)
    waves = np.hypot(along, across)
    within = (waves >= _WAVES[0]) & (waves <= _WAVES[1])
    # a density A n^-3 over the plane has profiles of 2 A n^-2, and twice that where waves have no direction
    density = _SMOOTHEST * _REFERENCE**2 / 4 * np.where(within, waves, math.inf) ** -3
    noise = np.fft.rfft2(rng.standard_normal((_ALONG, _ACROSS)))
    return np.asarray(np.fft.irfft2(noise * np.sqrt(density) / STEP, (_ALONG, _ACROSS)))
