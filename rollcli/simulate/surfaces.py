"""Where rays meet the road and what stands on it, in closed form.

Every surface answers two questions: how far along each ray it is met (`intersect`), and, at the points met,
which way it faces and where a texture is to be read (`chart`). Ground and walls are bent along the
course of the road, so each of their intersections is a quadratic; what stands on it is rigid.
"""

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Array
from rollcli.simulate.materials import Material

NEAR = 0.05  # metres: nothing nearer is seen


class Chart(NamedTuple):
    """At N points: normals, texture coordinates (N,) in metres, their gradients; vectors are (3, N or 1)."""

    normal: Array
    p: Array
    q: Array
    grad_p: Array
    grad_q: Array


class Surface(Protocol):
    """What a ray can meet."""

    @property
    def material(self) -> Material:
        """What it looks like."""

    def intersect(self, origin: Array, direction: Array) -> Array:
        """Ray parameters (N,) of the first hits, inf where a ray misses; `origin` is (3, N or 1)."""

    def chart(self, points: Array) -> Chart:
        """Normals and texture coordinates at points (3, N) on the surface."""

    def bounds(self) -> Array | None:
        """The corners of a box that holds the surface, (3, 8), or None for one without end."""


@dataclass(frozen=True)
class Course:
    """The line that the road follows: heading (slope), bend and vertical curvature, both 1/m.

    A point has the road coordinates lateral = X - heading Z - bend Z^2 / 2, Z, and
    elevation = Y - curvature Z^2 / 2.
    """

    heading: float = 0.0
    bend: float = 0.0
    curvature: float = 0.0

    def lateral(self, points: Array) -> Array:
        x, _, z = points
        return np.asarray(x - z * (self.heading + self.bend / 2 * z))

    def elevation(self, points: Array) -> Array:
        _, y, z = points
        return np.asarray(y - self.curvature / 2 * z * z)

    def point(self, lateral: float, z: float, elevation: float = 0.0) -> Array:
        """The world point (3,) of road coordinates."""
        x = lateral + z * (self.heading + self.bend / 2 * z)
        return np.array([x, elevation + self.curvature / 2 * z * z, z])


@dataclass(frozen=True)
class Ground:
    """The strip `left` < lateral < `right`, where elevation = offset + slope * lateral."""

    course: Course
    left: float
    right: float
    slope: float
    offset: float
    far: float
    material: Material

    def intersect(self, origin: Array, direction: Array) -> Array:
        (ox, oy, oz), (rx, ry, rz) = origin, direction
        lean = self.slope * self.course.bend - self.course.curvature
        a = lean / 2 * rz * rz
        b = ry - self.slope * (rx - self.course.heading * rz) + lean * oz * rz
        c = oy - self.slope * (ox - self.course.heading * oz) + lean / 2 * oz * oz - self.offset
        t = _first_root(a, b, c)
        z = oz + t * rz
        lateral = ox + t * rx - z * (self.course.heading + self.course.bend / 2 * z)
        return np.where((lateral >= self.left) & (lateral < self.right) & (z < self.far), t, np.inf)

    def chart(self, points: Array) -> Chart:
        z = points[2]
        across = np.array([np.ones_like(z), np.zeros_like(z), -self.course.heading - self.course.bend * z])
        normal = -self.slope * across
        normal[1] += 1.0
        normal[2] -= self.course.curvature * z
        return Chart(normal, self.course.lateral(points), z, across, np.array([[0.0], [0.0], [1.0]]))

    def bounds(self) -> Array | None:
        return None


@dataclass(frozen=True)
class Wall:
    """The vertical face at `lateral`: between edges[i] and edges[i + 1] (Z) it stands from `base` to tops[i]."""

    course: Course
    lateral: float
    base: float
    edges: NDArray[np.float64]
    tops: NDArray[np.float64]
    material: Material

    def intersect(self, origin: Array, direction: Array) -> Array:
        (ox, oy, oz), (rx, ry, rz) = origin, direction
        heading, bend = self.course.heading, self.course.bend
        c = ox - oz * (heading + bend / 2 * oz) - self.lateral
        side = np.where(c < 0, -1.0, 1.0)  # the solver wants the origin on the positive side
        b = rx - rz * (heading + bend * oz)
        t = _first_root(-side * bend / 2 * rz * rz, side * b, side * c)
        z = oz + t * rz
        elevation = oy + t * ry - self.course.curvature / 2 * z * z
        section = np.searchsorted(self.edges, z) - 1
        inside = (section >= 0) & (section < len(self.tops))
        top = self.tops[np.where(inside, section, 0)]
        return np.where(inside & (elevation >= self.base) & (elevation < top), t, np.inf)

    def chart(self, points: Array) -> Chart:
        z = points[2]
        normal = np.array([np.ones_like(z), np.zeros_like(z), -self.course.heading - self.course.bend * z])
        up = np.array([np.zeros_like(z), np.ones_like(z), -self.course.curvature * z])
        return Chart(normal, z, self.course.elevation(points), np.array([[0.0], [0.0], [1.0]]), up)

    def bounds(self) -> Array | None:
        return None


@dataclass(frozen=True)
class Backdrop:
    """A plane across the world at Z = `far`, from `base` to a skyline: metres over the course, each 2 m."""

    course: Course
    far: float
    base: float
    skyline: Array
    material: Material

    def intersect(self, origin: Array, direction: Array) -> Array:
        rise = self.course.curvature / 2 * self.far**2
        forward = np.where(direction[2] > 1e-9, direction[2], np.nan)
        t = (self.far - origin[2]) / forward
        y = origin[1] + t * direction[1] - rise
        place = (origin[0] + t * direction[0]) / 2 + len(self.skyline) / 2
        top = np.interp(np.nan_to_num(place), np.arange(len(self.skyline)), self.skyline)
        return np.where((y >= self.base) & (y < top), t, np.inf)

    def chart(self, points: Array) -> Chart:
        axes = np.eye(3)[:, :, None]
        return Chart(-axes[2], points[0], self.course.elevation(points), axes[0], axes[1])

    def bounds(self) -> Array | None:
        return None


@dataclass(frozen=True)
class Polytope:
    """A convex solid of half-spaces normals . x <= offsets, in a frame of its own.

    `frame` holds that frame's axes as rows (right, up, ahead), `place` its origin. `extent` is the
    (3, 2) box of the solid in its frame.
    """

    frame: Array
    place: Array
    normals: Array
    offsets: Array
    extent: Array
    material: Material

    def intersect(self, origin: Array, direction: Array) -> Array:
        o = self.frame @ (origin - self.place[:, None])
        r = self.frame @ direction
        enter, leave = np.full(r.shape[1], NEAR), np.full(r.shape[1], np.inf)
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            toward, room = normal @ r, offset - normal @ o
            with np.errstate(divide="ignore", invalid="ignore"):
                t = room / toward
            enter = np.where(toward < 0, np.fmax(enter, t), enter)
            leave = np.where(toward > 0, np.fmin(leave, t), leave)
            leave = np.where((toward == 0) & (room < 0), -np.inf, leave)
        return np.where((enter < leave) & (enter > NEAR), enter, np.inf)

    def chart(self, points: Array) -> Chart:
        local = self.frame @ (points - self.place[:, None])
        face = np.argmax(self.normals @ local - self.offsets[:, None], axis=0)
        normal = self.normals[face]
        # read the texture on the two axes that the face lies along: side (ahead, up), end (right, up), top
        flat = np.argmax(np.abs(normal), axis=1)
        first = np.array([2, 0, 0])[flat]
        second = np.array([1, 2, 1])[flat]
        each = np.arange(points.shape[1])
        return Chart(
            self.frame.T @ normal.T,
            local[first, each],
            local[second, each],
            self.frame[first].T,
            self.frame[second].T,
        )

    def bounds(self) -> Array | None:
        grid = np.stack(np.meshgrid(*self.extent, indexing="ij")).reshape(3, -1)
        return np.asarray(self.frame.T @ grid + self.place[:, None])


@dataclass(frozen=True)
class Post:
    """A vertical cylinder that stands on `foot` (3,)."""

    foot: Array
    radius: float
    height: float
    material: Material
    _up: Array = field(default_factory=lambda: np.array([[0.0], [1.0], [0.0]]), repr=False)

    def intersect(self, origin: Array, direction: Array) -> Array:
        (ox, oy, oz), (rx, ry, rz) = origin - self.foot[:, None], direction
        a = rx * rx + rz * rz
        b = ox * rx + oz * rz
        c = ox * ox + oz * oz - self.radius**2
        disc = b * b - a * c
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (-b - np.sqrt(np.where(disc >= 0, disc, np.nan))) / a
        y = oy + t * ry
        return np.where((t > NEAR) & (y >= 0) & (y < self.height), t, np.inf)

    def chart(self, points: Array) -> Chart:
        x, y, z = points - self.foot[:, None]
        normal = np.array([x, np.zeros_like(x), z]) / self.radius
        around = np.array([z, np.zeros_like(x), -x]) / self.radius
        return Chart(normal, self.radius * np.arctan2(x, z), y, around, self._up)

    def bounds(self) -> Array | None:
        r = self.radius
        corners = np.array([[x, y, z] for x in (-r, r) for y in (0.0, self.height) for z in (-r, r)])
        return np.asarray(corners.T + self.foot[:, None])


def _first_root(a: Array, b: Array, c: Array) -> Array:
    """The first t > NEAR with a t^2 + b t + c = 0 where the ray starts at c > 0; nan where there is none.

    Written as 2c / (-b + sqrt(disc)), which stays exact as `a` vanishes.
    """
    disc = b * b - 4 * a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        t = 2 * c / (np.sqrt(disc) - b)
        return np.where((c > 0) & (t > NEAR) & (t < 1e6), t, np.nan)
