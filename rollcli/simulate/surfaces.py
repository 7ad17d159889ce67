"""The interface of surfaces, and the ground and walls that follow the course of the road.

A surface computes where rays hit it (`intersect`) and, at these points, its normal and its texture
coordinates (`sample`). The road rises, bends and is cambered as parabolas, so that each intersection is the
root of a quadratic: exact, and without a step size. Only to uneven ground, and to a camber in a bend, a ray
is followed in steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.relief import Array, Relief, Vectors

NEAR = 0.05  # metres: nearer surfaces are not hit
_SEAM = 1e-9  # metres: adjacent grounds overlap by it, so that rounding lets no ray pass between them
_FARTHEST = 1e6  # metres
_STEPS, _BISECTIONS = 12, 12  # between the highest and the lowest ground that a ray may hit
_PASSED = 1e-3  # metres: a ray that ends higher above the ground has passed over it
_TO_ROUNDING = 36  # bisections: less than a nanometre, whatever the bend

Indices = NDArray[np.intp]


class SurfaceSample(NamedTuple):
    """The surface at N points; vectors are (3, N), or (3, 1) where they are the same everywhere.

    `p` and `q` (N,) are texture coordinates in metres, `grad_p` and `grad_q` their gradients in the world;
    `material` is an index into the scene's materials, one or (N,).
    """

    normal: Vectors
    p: Vectors
    q: Vectors
    grad_p: Vectors
    grad_q: Vectors
    material: int | Indices


class Surface(Protocol):
    """What a ray can hit."""

    def intersect(self, origin: Array, direction: Array) -> Array:
        """Return the ray parameters (N,) of the first hits, inf for a miss; `origin` is (3, N) or (3, 1)."""

    def sample(self, points: Array) -> SurfaceSample:
        """Return normals, texture coordinates and materials at points (3, N) on the surface."""

    def bounds(self) -> Array | None:
        """Return the corners (3, 8) of a box around the surface; None for one without end."""
        return None


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
        """Return the distance to the right of the course, metres."""
        x, _, z = points
        return np.asarray(x - z * (self.heading + self.bend / 2 * z))

    def elevation(self, points: Array) -> Array:
        """Return the height above the course, metres."""
        _, y, z = points
        return np.asarray(y - self.curvature / 2 * z * z)

    def point(self, lateral: Any, z: Any, elevation: Any = 0.0) -> Array:
        """Return the world point (3,) of road coordinates, or points (3, N) of arrays of them."""
        x = lateral + z * (self.heading + self.bend / 2 * z)
        return np.array([x, elevation + self.curvature / 2 * z * z, z])

    def frame(self, z: float, slope: float = 0.0) -> Array:
        """Return the right, up and ahead axes, rows of (3, 3), at `z` where the slope across is this."""
        ahead = np.array([self.heading + self.bend * z, self.curvature * z, 1.0])
        ahead /= np.linalg.norm(ahead)
        up = np.array([-slope, 1.0, 0.0]) - (ahead[1] - slope * ahead[0]) * ahead
        up /= np.linalg.norm(up)
        return np.array([np.cross(up, ahead), up, ahead])

    def across(self, z: Array) -> Array:
        """Return the gradient (3, N) of `lateral` at points with these z."""
        return np.array([np.ones_like(z), np.zeros_like(z), -self.heading - self.bend * z])


@dataclass(frozen=True)
class Ground(Surface):
    """The sheet elevation = offset + slope * lateral + camber / 2 * lateral^2, in strips side by side.

    Strip i lies between edges[i] and edges[i + 1] (lateral, metres) and is of materials[i].
    A `relief` makes it uneven.
    """

    course: Course
    edges: tuple[float, ...]
    materials: tuple[int, ...]
    far: float
    slope: float = 0.0
    offset: float = 0.0
    camber: float = 0.0
    relief: Relief | None = None

    def intersect(self, origin: Array, direction: Array) -> Array:
        t = self._first_hit(origin, direction)
        points = origin + t * direction
        lateral = self.course.lateral(points)
        inside = (lateral >= self.edges[0] - _SEAM) & (lateral < self.edges[-1] + _SEAM)
        inside &= points[2] < self.far
        return np.where(inside, t, np.inf)

    def _first_hit(self, origin: Array, direction: Array) -> Array:
        """Return the ray parameters where rays first hit the sheet, edges ignored; nan where they miss."""
        if self.relief is None:
            return self._first_smooth_hit(origin, direction)
        lowest, highest = (
            replace(self, offset=self.offset + raised, relief=None) for raised in self.relief.span
        )
        first = highest._entered(origin, direction)
        last = np.fmax(first, lowest._first_smooth_hit(origin, direction))
        ends = (origin + t * direction for t in (first, last))
        begin, end = (np.array([self.course.lateral(each), each[2]]) for each in ends)
        low, high = np.fmin(begin, end), np.fmax(begin, end)
        inside = (high[0] >= self.edges[0]) & (low[0] < self.edges[-1]) & (begin[1] < self.far)
        uneven = self.relief.is_between(low, high)
        reached = np.flatnonzero(inside & uneven)  # nan is not
        start = np.broadcast_to(origin, direction.shape)[:, reached]
        onward, near, far = direction[:, reached], first[reached], last[reached]
        hits = np.where(uneven, np.nan, self._first_smooth_hit(origin, direction))
        hits[reached] = _first_descent(lambda t: self._above(start + t * onward), near, far, _BISECTIONS)
        return hits

    def _above(self, points: Array) -> Array:
        """Return how far points (3, N) are above the uneven sheet, metres; beside it, its camber ends."""
        lateral = self.course.lateral(points)
        cambered = self.camber / 2 * np.clip(lateral, self.edges[0], self.edges[-1]) ** 2
        smooth = self.offset + self.slope * lateral + cambered
        uneven = self.relief.height(lateral, points[2]) if self.relief else 0.0
        return np.asarray(self.course.elevation(points) - smooth - uneven)

    def _entered(self, origin: Array, direction: Array) -> Array:
        """Return where rays first are below a smooth sheet, as a low camera is; nan where they miss it."""
        return np.where(self._above(origin) > 0, self._first_smooth_hit(origin, direction), NEAR)

    def _first_smooth_hit(self, origin: Array, direction: Array) -> Array:
        """Return the same for the sheet without its relief."""
        if self.camber and self.course.bend:
            return self._first_cambered_hit(origin, direction)
        (ox, oy, oz), (rx, ry, rz) = origin, direction
        lean = self.slope * self.course.bend - self.course.curvature
        a = lean / 2 * rz * rz
        b = ry - self.slope * (rx - self.course.heading * rz) + lean * oz * rz
        c = oy - self.slope * (ox - self.course.heading * oz) + lean / 2 * oz * oz - self.offset
        # along a ray, lateral = l0 + l1 t, and the camber adds its square
        l0, l1 = ox - oz * self.course.heading, rx - rz * self.course.heading
        half = self.camber / 2
        return first_root(a - half * l1 * l1, b - self.camber * l0 * l1, c - half * l0 * l0)

    def _first_cambered_hit(self, origin: Array, direction: Array) -> Array:
        """Return the same where the road bends, too: between the sheets that touch the camber's ends."""
        smooth, plain = replace(self, relief=None), replace(self, relief=None, camber=0.0)
        laterals = np.clip([-np.inf, 0.0, np.inf], self.edges[0], self.edges[-1])
        rises = (self.camber / 2 * laterals**2).tolist()
        highest, lowest = (replace(plain, offset=self.offset + rise) for rise in (max(rises), min(rises)))
        first = highest._entered(origin, direction)
        with np.errstate(divide="ignore"):
            end = np.where(direction[2] > 0, (self.far - origin[2]) / direction[2], _FARTHEST)
        # over a crest a ray may miss the lowest, and leaves the highest again: where it meets it backwards
        left = end - highest._first_smooth_hit(origin + end * direction, -direction)
        left[left < 0] = np.nan
        last = np.fmin(lowest._first_smooth_hit(origin, direction), left)
        last = np.fmax(first, np.where(np.isnan(last), end, last))
        return _first_descent(lambda t: smooth._above(origin + t * direction), first, last, _TO_ROUNDING)

    def sample(self, points: Array) -> SurfaceSample:
        z = points[2]
        across, lateral = self.course.across(z), self.course.lateral(points)
        right, ahead = self.relief.slopes(lateral, z) if self.relief else (0.0, 0.0)
        normal = -(self.slope + self.camber * lateral + right) * across
        normal[1] += 1.0
        normal[2] -= self.course.curvature * z + ahead
        strip = np.clip(np.searchsorted(self.edges, lateral, side="right") - 1, 0, len(self.materials) - 1)
        return SurfaceSample(normal, lateral, z, across, _AHEAD, np.array(self.materials)[strip])


@dataclass(frozen=True)
class Wall(Surface):
    """A vertical face at `lateral`, from edges[i] to edges[i + 1] in Z: from `base` to tops[i] on relief."""

    course: Course
    lateral: float
    base: float
    edges: Array
    tops: Array
    material: int
    relief: Relief | None = None

    def intersect(self, origin: Array, direction: Array) -> Array:
        (ox, _, oz), (rx, _, rz) = origin, direction
        heading, bend = self.course.heading, self.course.bend
        c = ox - oz * (heading + bend / 2 * oz) - self.lateral
        side = np.where(c < 0, -1.0, 1.0)  # first_root needs the origin on the positive side
        b = rx - rz * (heading + bend * oz)
        t = first_root(-side * bend / 2 * rz * rz, side * b, side * c)
        points = origin + t * direction
        elevation = self.course.elevation(points)
        section = np.searchsorted(self.edges, points[2]) - 1
        inside = (section >= 0) & (section < len(self.tops))
        top = self.tops[np.where(inside, section, 0)]
        if self.relief is not None:
            top = top + self.relief.height(np.full_like(t, self.lateral), np.where(inside, points[2], 0.0))
        return np.where(inside & (elevation >= self.base) & (elevation < top), t, np.inf)

    def sample(self, points: Array) -> SurfaceSample:
        z = points[2]
        up = np.array([np.zeros_like(z), np.ones_like(z), -self.course.curvature * z])
        elevation = self.course.elevation(points)
        return SurfaceSample(self.course.across(z), z, elevation, _AHEAD, up, self.material)


@dataclass(frozen=True)
class Backdrop(Surface):
    """A plane across the world at Z = `far`, from `base` to a skyline: metres over the course, each 2 m."""

    course: Course
    far: float
    base: float
    skyline: Array
    material: int

    def intersect(self, origin: Array, direction: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self.far - origin[2]) / direction[2]
        ahead = np.where(t > NEAR, t, 0.0)
        elevation = origin[1] + ahead * direction[1] - self.course.curvature / 2 * self.far**2
        place = (origin[0] + ahead * direction[0]) / 2 + len(self.skyline) / 2
        top = np.interp(place, np.arange(len(self.skyline)), self.skyline)
        return np.where((t > NEAR) & (elevation >= self.base) & (elevation < top), t, np.inf)

    def sample(self, points: Array) -> SurfaceSample:
        elevation = self.course.elevation(points)
        return SurfaceSample(-_AHEAD, points[0], elevation, _RIGHT, UP, self.material)


def first_root(a: Array, b: Array, c: Array) -> Array:
    """Return the t > NEAR at which a t^2 + b t + c falls to 0; nan where there is none.

    The form 2c / (-b + sqrt(discriminant)) stays exact as `a` vanishes.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        t = 2 * c / (np.sqrt(b * b - 4 * a * c) - b)
        return np.where((t > NEAR) & (t < _FARTHEST), t, np.nan)


def _first_descent(above: Callable[[Array], Array], first: Array, last: Array, bisections: int) -> Array:
    """Return where rays first come below 0 between two of their parameters, by bisection; else nan."""
    low, high, searched = first, last, np.ones(first.shape, bool)
    for step in range(1, _STEPS + 1):
        t = first + (last - first) * (step / _STEPS)
        over = above(t) > 0
        low = np.where(searched & over, t, low)
        high = np.where(searched & ~over, t, high)
        searched &= over
    for _ in range(bisections):
        middle = (low + high) / 2
        over = above(middle) > 0
        low, high = np.where(over, middle, low), np.where(over, high, middle)
    return np.where(above(high) > _PASSED, np.nan, high)


# single precision: double precision would double the cost of shading
_RIGHT, UP, _AHEAD = np.eye(3, dtype=np.float32)[:, :, None]
