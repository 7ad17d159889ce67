"""Image positions of a camera and the rays through them."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.camera import Camera, Rays
from rollcli.simulate.surfaces import Indices
from rollcli.simulate.vectors import Array


@dataclass(frozen=True)
class Pixels:
    """Positions u, v (N,), pixels, and their rays; `rows`: they are these whole rows of the image."""

    camera: Camera
    u: Array
    v: Array
    rays: Rays
    rows: range | None

    @staticmethod
    def of_rows(camera: Camera, rows: range) -> "Pixels":
        """The centres of all pixels of these rows, row by row."""
        v, u = np.indices((len(rows), camera.width), float).reshape(2, -1)
        v += rows.start
        return Pixels(camera, u, v, camera.rays(u, v), rows)

    @staticmethod
    def at(camera: Camera, u: Array, v: Array) -> "Pixels":
        """Any positions."""
        return Pixels(camera, u, v, camera.rays(u, v), None)

    def window(self, corners: Array | None) -> Indices | None:
        """Which of them can meet what lies between a box's corners (3, 8); None: any."""
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
