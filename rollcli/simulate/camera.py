"""A pinhole camera on a rolled, pitched rig, and the pair of them.

World axes: X right, Y up, Z along the driving direction; the origin lies on the road below the left camera.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.vectors import Array


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
    """Intrinsics, roll, pitch and place of one camera.

    Parameters
    ----------
    width, height : int
        Image size, pixels; the principal point is the image's centre.
    focal : float
        Focal length, pixels.
    roll : float
        Radians; positive turns the rig counter-clockwise seen from behind (its right end goes up).
    pitch : float
        Radians; positive looks down at the road.
    position : tuple of float
        X, Y, Z in metres.
    """

    width: int
    height: int
    focal: float
    roll: float
    pitch: float
    position: tuple[float, float, float]

    def axes(self) -> Array:
        """Rows: the camera's right, down and forward axes in the world, (3, 3).

        The pitch acts on the levelled rig and the roll turns it about its own optical axis: only in
        this order is a row of the image, turned back by the roll, parallel to the road.
        """
        cos_r, sin_r = np.cos(self.roll), np.sin(self.roll)
        cos_p, sin_p = np.cos(self.pitch), np.sin(self.pitch)
        return np.array(
            [
                [cos_r, sin_r * cos_p, sin_r * sin_p],
                [sin_r, -cos_r * cos_p, -cos_r * sin_p],
                [0.0, -sin_p, cos_p],
            ]
        )

    def rays(self, u: NDArray[Any], v: NDArray[Any]) -> Rays:
        """The rays through pixel positions `u`, `v` (N,); (0, 0) is the centre of the top-left pixel."""
        right, down, forward = self.axes() / np.array([[self.focal], [self.focal], [1.0]])
        x, y = u - (self.width - 1) / 2, v - (self.height - 1) / 2
        direction = forward[:, None] + right[:, None] * x + down[:, None] * y
        return Rays(np.array(self.position)[:, None], direction, right, down)

    def project(self, points: Array) -> tuple[Array, Array, Array]:
        """Columns, rows (pixels) and depths (metres) of world points (3, N); depth may be negative."""
        x, y, depth = self.axes() @ (points - np.array(self.position)[:, None])
        u = self.focal * x / depth + (self.width - 1) / 2
        v = self.focal * y / depth + (self.height - 1) / 2
        return u, v, depth


def stereo_rig(
    size: tuple[int, int], focal: float, roll: float, pitch: float, height: float, baseline: float
) -> tuple[Camera, Camera]:
    """Left and right camera; the right one sits a baseline (m) away along the rig's own x axis.

    `size` is (width, height) in pixels, `height` the left camera's height over the road in metres.
    """
    left = Camera(*size, focal, roll, pitch, (0.0, height, 0.0))
    x, y, z = baseline * left.axes()[0]
    return left, Camera(*size, focal, roll, pitch, (float(x), height + float(y), float(z)))
