"""Cameras: positions in the image, the rays through them, and the sensor."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.materials import Values
from rollcli.simulate.surfaces import Indices
from rollcli.simulate.vectors import Array, dot


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
        [[cos_r, sin_r * cos_p, sin_r * sin_p], [sin_r, -cos_r * cos_p, -cos_r * sin_p], [0.0, -sin_p, cos_p]]
    )
    ahead = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    ahead /= np.linalg.norm(ahead)
    return np.asarray(on_plane @ np.array([np.cross(normal, ahead), normal, ahead]))


_GREY = np.array([0.114, 0.587, 0.299], np.float32)  # BT.601, as OpenCV's grey


def expose(
    light: Values, noise: float, gain: float, colour: bool, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Apply vignetting, gamma and noise, and quantise to eight bits: (H, W, 3), or (H, W) when not in colour.

    `light` is (H, W, 3), 1 at saturation; `noise` in grey levels; `gain` multiplies the brightness.
    """
    height, width = light.shape[:2]
    v, u = np.ogrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    falloff = (gain * (1 - 0.12 * (u * u + v * v))).astype(np.float32)
    image = light * falloff[..., None] if colour else dot(_GREY, np.moveaxis(light, -1, 0)) * falloff
    grey = np.float32(255) * np.sqrt(image)  # a gamma of 2
    grey += np.float32(noise) * rng.standard_normal(grey.shape, np.float32)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)


@dataclass(frozen=True)
class PixelRays:
    """Positions u, v (N,), pixels, and their rays; `rows` if they are whole rows of the image, else None."""

    camera: Camera
    u: Array
    v: Array
    rays: Rays
    rows: range | None

    @staticmethod
    def of_rows(camera: Camera, rows: range) -> "PixelRays":
        """Take the centres of all pixels of these rows, row by row."""
        v, u = np.indices((len(rows), camera.width), float).reshape(2, -1)
        v += rows.start
        return PixelRays(camera, u, v, camera.rays(u, v), rows)

    @staticmethod
    def at(camera: Camera, u: Array, v: Array) -> "PixelRays":
        """Take any positions."""
        return PixelRays(camera, u, v, camera.rays(u, v), None)

    def window(self, corners: Array | None) -> Indices | None:
        """Return the indices of rays that can hit a box with these corners (3, 8); None: all of them can."""
        if corners is None:
            return None
        u, v, depth = self.camera.project(corners)
        if depth.max() <= 0:
            return np.empty(0, np.intp)
        if depth.min() <= 0.1:
            return None
        low_u, high_u, low_v, high_v = u.min(), u.max(), v.min(), v.max()
        if self.rows is None:
            inside = (self.u >= low_u) & (self.u <= high_u) & (self.v >= low_v) & (self.v <= high_v)
            return np.flatnonzero(inside)
        first, width = self.rows.start, self.camera.width
        columns = np.arange(max(int(np.ceil(low_u)), 0), min(int(high_u) + 1, width))
        rows = np.arange(max(int(np.ceil(low_v)), first), min(int(high_v) + 1, self.rows.stop))
        return ((rows[:, None] - first) * width + columns).ravel()
