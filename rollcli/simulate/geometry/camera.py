"""A pinhole camera, and the orientation of the rig that carries two of them.

World axes: X right, Y up, Z along the driving direction; the origin lies on the road below the left camera.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.geometry.vectors import Array


@dataclass(frozen=True)
class Rays:
    """N rays; `direction` has length one along the optical axis, so a ray's parameter is its depth.

    `origin` and `direction` are (3, 1) and (3, N), metres; `across` and `down` (3,) are the steps of
    `direction` for one pixel to the right and one pixel down.
    """

    origin: Array
    direction: Array
    across: Array
    down: Array


@dataclass(frozen=True)
class Camera:
    """Intrinsics, orientation and place of one camera.

    Parameters
    ----------
    width, height : int
        Image size, pixels.
    focal : float
        Focal length, pixels.
    centre : tuple of float
        Column and row of the principal point, pixels; (0, 0) is the centre of the top-left pixel.
    axes : numpy.ndarray
        (3, 3); rows: the camera's right, down and forward axes in the world.
    position : numpy.ndarray
        (3,); X, Y, Z in metres.
    """

    width: int
    height: int
    focal: float
    centre: tuple[float, float]
    axes: Array
    position: Array

    def rays(self, u: NDArray[Any], v: NDArray[Any]) -> Rays:
        """Return the rays through positions `u`, `v` (N,), pixels from the centre of the top-left pixel."""
        right, down, forward = self.axes / np.array([[self.focal], [self.focal], [1.0]])
        x, y = u - self.centre[0], v - self.centre[1]
        direction = forward[:, None] + right[:, None] * x + down[:, None] * y
        return Rays(self.position[:, None], direction, right, down)

    def project(self, points: Array) -> tuple[Array, Array, Array]:
        """Return columns, rows (pixels) and depths (metres) of world points (3, N); depths have a sign."""
        x, y, depth = self.axes @ (points - self.position[:, None])
        u = self.focal * x / depth + self.centre[0]
        v = self.focal * y / depth + self.centre[1]
        return u, v, depth


def rig_axes(roll: float, pitch: float, normal: Array) -> Array:
    """Return the right, down and forward axes of a rig in the world, as the rows of a (3, 3) array.

    The pitch acts on the levelled rig and the roll turns it about its own optical axis: only in this
    order is a row of the image, turned back by the roll, parallel to the road.

    Parameters
    ----------
    roll : float
        Radians; positive turns the rig counter-clockwise seen from behind (its right end goes up).
    pitch : float
        Radians; positive looks down at the road.
    normal : numpy.ndarray
        (3,), of length one: the upward normal of the plane from which both angles are measured.
    """
    cos_r, sin_r = np.cos(roll), np.sin(roll)
    cos_p, sin_p = np.cos(pitch), np.sin(pitch)
    on_plane = np.array(
        [
            [cos_r, sin_r * cos_p, sin_r * sin_p],
            [sin_r, -cos_r * cos_p, -cos_r * sin_p],
            [0.0, -sin_p, cos_p],
        ]
    )
    ahead = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    ahead /= np.linalg.norm(ahead)
    return np.asarray(on_plane @ np.array([np.cross(normal, ahead), normal, ahead]))
