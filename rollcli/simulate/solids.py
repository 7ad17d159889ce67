"""Solid objects: unions of convex parts, cylinders, crowns of trees."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.simulate.materials import coarse, fine
from rollcli.simulate.surfaces import NEAR, SurfaceSample
from rollcli.simulate.vectors import Array, dots

_UP = np.eye(3, dtype=np.float32)[:, 1:2]


class ConvexPart(NamedTuple):
    """The convex solid normals . x <= offsets; normals are (k, 3) unit vectors, offsets (k,) metres."""

    normals: Array
    offsets: Array
    material: int


@dataclass(frozen=True)
class Solid:
    """Convex parts in a frame of their own, whose axes (right, up, ahead) are the rows of `frame`.

    `place` (3,) is the origin of the frame, `extent` (3, 2) the bounding box of all parts in it.
    """

    frame: Array
    place: Array
    parts: tuple[ConvexPart, ...]
    extent: Array

    def intersect(self, origin: Array, direction: Array) -> Array:
        o = dots(self.frame, origin - self.place[:, None])
        r = dots(self.frame, direction)
        first = np.full(r.shape[1], np.inf)
        for normals, offsets, _ in self.parts:
            # + 0.0 makes -0.0 positive: a ray parallel to a face and outside of it then leaves at -inf
            toward, room = dots(normals, r) + 0.0, offsets[:, None] - dots(normals, o)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = room / toward
            inward = toward < 0
            enter = np.where(inward, t, -np.inf).max(axis=0)
            leave = np.where(inward, np.inf, t).min(axis=0)
            np.minimum(first, enter, out=first, where=(enter < leave) & (enter > NEAR))
        return first

    def sample(self, points: Array) -> SurfaceSample:
        local = dots(self.frame, points - self.place[:, None])
        # a point on the surface of a part lies on one of its faces and behind the others
        heights = [dots(normals, local) - offsets[:, None] for normals, offsets, _ in self.parts]
        owner = np.argmin([np.abs(h.max(axis=0)) for h in heights], axis=0)
        normal = np.empty((points.shape[1], 3))
        for k, part in enumerate(self.parts):
            at = owner == k
            normal[at] = part.normals[np.argmax(heights[k][:, at], axis=0)]
        # the texture's axes span the face: side (ahead, up), top (right, ahead), end (right, up)
        flat = np.argmax(np.abs(normal), axis=1)
        first, second = np.array([2, 0, 0])[flat], np.array([1, 2, 1])[flat]
        each = np.arange(points.shape[1])
        return SurfaceSample(
            dots(self.frame.T, normal.T),
            local[first, each],
            local[second, each],
            self.frame[first].T,
            self.frame[second].T,
            np.array([part.material for part in self.parts])[owner],
        )

    def bounds(self, margin: float = 0.0) -> Array | None:
        """Return the corners as `Surface.bounds` does, with `margin` metres more on each side."""
        grid = _corners(self.extent + np.array([-margin, margin]))
        return np.asarray(self.frame.T @ grid + self.place[:, None])


@dataclass(frozen=True)
class Post:
    """A vertical cylinder that stands on `foot` (3,)."""

    foot: Array
    radius: float
    height: float
    material: int

    def intersect(self, origin: Array, direction: Array) -> Array:
        (ox, oy, oz), (rx, ry, rz) = origin - self.foot[:, None], direction
        enter, _ = _sphere_roots(rx * rx + rz * rz, ox * rx + oz * rz, ox * ox + oz * oz - self.radius**2)
        y = oy + enter * ry
        return np.where((enter > NEAR) & (y >= 0) & (y < self.height), enter, np.inf)

    def sample(self, points: Array) -> SurfaceSample:
        x, y, z = points - self.foot[:, None]
        normal = np.array([x, np.zeros_like(x), z]) / self.radius
        around = np.array([-z, np.zeros_like(x), x]) / self.radius
        return SurfaceSample(normal, self.radius * np.arctan2(x, -z), y, around, _UP, self.material)

    def bounds(self) -> Array | None:
        across = (-self.radius, self.radius)
        return _corners([across, (0.0, self.height), across]) + self.foot[:, None]


@dataclass(frozen=True)
class TreeCrown:
    """The crown of a tree: an ellipsoid shell of leaves; through its gaps the far side is visible."""

    centre: Array
    radius: float
    half_height: float
    material: int

    def intersect(self, origin: Array, direction: Array) -> Array:
        squash = np.array([[1.0], [self.radius / self.half_height], [1.0]])
        o, r = (origin - self.centre[:, None]) * squash, direction * squash
        near, far = _sphere_roots(
            (r * r).sum(axis=0), (o * r).sum(axis=0), (o * o).sum(axis=0) - self.radius**2
        )
        first = np.full(r.shape[1], np.inf)
        for t in (far, near):
            hit = np.flatnonzero(t > NEAR)
            met = origin[:, hit if origin.shape[1] > 1 else slice(None)] + t[hit] * direction[:, hit]
            leaf = hit[self._leaves(met - self.centre[:, None])]
            first[leaf] = t[leaf]
        return first

    def _leaves(self, offset: Array) -> NDArray[np.bool_]:
        """Tell at which offsets from the centre there are leaves."""
        x, y, z = offset.astype(np.float32)
        p, q = x + np.float32(0.73) * z + 50, y + np.float32(0.51) * (z - x)
        w = np.full_like(x, 0.03)
        thin = np.abs(y) / np.float32(self.half_height)
        return np.asarray(coarse(p, q, w) + np.float32(0.5) * fine(p, q, w) > thin - np.float32(1.1))

    def sample(self, points: Array) -> SurfaceSample:
        x, y, z = points - self.centre[:, None]
        normal = np.array([x, y * (self.radius / self.half_height) ** 2, z])
        around = np.array([-z, np.zeros_like(x), x]) * (self.radius / np.maximum(x * x + z * z, 0.01))
        return SurfaceSample(normal, self.radius * np.arctan2(x, -z), y, around, _UP, self.material)

    def bounds(self) -> Array | None:
        across, up = (-self.radius, self.radius), (-self.half_height, self.half_height)
        return _corners([across, up, across]) + self.centre[:, None]


def _corners(extent: ArrayLike) -> Array:
    """Return the corners (3, 8) of a box from its ends along each axis, (3, 2)."""
    return np.stack(np.meshgrid(*np.asarray(extent, np.float64), indexing="ij")).reshape(3, -1)


def _sphere_roots(a: Array, half_b: Array, c: Array) -> tuple[Array, Array]:
    """Return both roots of a t^2 + 2 half_b t + c = 0; nan where there are none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(half_b * half_b - a * c)
        return (-half_b - root) / a, (-half_b + root) / a
