"""Positions in a camera's image, and the rays through them."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.geometry.camera import Camera, Rays
from rollcli.simulate.geometry.surfaces import Indices
from rollcli.simulate.geometry.vectors import Array


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
