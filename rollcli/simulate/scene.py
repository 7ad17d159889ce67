"""A scene: its light, surfaces and materials, and solid objects: convex parts, cylinders, crowns of trees."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.simulate.materials import Material, Values, coarse, fine
from rollcli.simulate.relief import Array, Vectors
from rollcli.simulate.surfaces import NEAR, UP, Surface, SurfaceSample


def dots(axes: Vectors, vectors: Vectors) -> Vectors:
    """Return the components (K, N) of `vectors` (3, N) along each of `axes` (K, 3)."""
    return np.asarray(np.einsum("ki,in->kn", axes, vectors))


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
        (p, grad_p), (q, grad_q) = ((local[axis, each], self.frame[axis].T) for axis in (first, second))
        material = np.array([part.material for part in self.parts])[owner]
        return SurfaceSample(dots(self.frame.T, normal.T), p, q, grad_p, grad_q, material)

    def bounds(self, margin: float = 0.0) -> Array | None:
        """Return the corners as `Surface.bounds` does, with `margin` metres more on each side."""
        return self.frame.T @ _corners(self.extent + np.array([-margin, margin])) + self.place[:, None]


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
        return SurfaceSample(normal, self.radius * np.arctan2(x, -z), y, around, UP, self.material)

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
        a, half_b, c = ((one * other).sum(axis=0) for one, other in ((r, r), (o, r), (o, o)))
        near, far = _sphere_roots(a, half_b, c - self.radius**2)
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
        return SurfaceSample(normal, self.radius * np.arctan2(x, -z), y, around, UP, self.material)

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


OVERCAST = 0.6


@dataclass(frozen=True)
class Light:
    """The direction to the sun (3,), the share of ambient light, the exposure, and an offset of the clouds.

    Under an overcast sky (`ambient` of `OVERCAST` or more) nothing casts a shadow.
    """

    sun: Array
    ambient: float
    exposure: float
    clouds: float


def draw_light(rng: np.random.Generator) -> Light:
    """Draw the light; on average every second scene has sun."""
    height, azimuth = rng.uniform(0.45, 1.2), rng.uniform(-np.pi, np.pi)
    sun = np.array([np.cos(height) * np.sin(azimuth), np.sin(height), np.cos(height) * np.cos(azimuth)])
    ambient = rng.uniform(0.28, 0.45) if rng.random() < 0.5 else rng.uniform(0.7, 0.9)
    return Light(sun, ambient, rng.uniform(1.2, 1.6), draw_offset(rng))


def in_shadow(points: Array, sun: Array, casters: Sequence[Surface]) -> NDArray[np.bool_]:
    """Tell which of the points (3, N) have a caster between them and the sun."""
    shadow = np.zeros(points.shape[1], bool)
    # projected along the sun's rays, a caster covers the points within its outline
    across = np.cross(sun, [0.0, 1.0, 0.0])
    axes = np.array([across / np.linalg.norm(across), np.cross(across, sun) / np.linalg.norm(across)])
    projected = dots(axes, points)
    for caster in casters:
        corners = caster.bounds()
        inside = ~shadow
        if corners is not None:
            outline = dots(axes, corners)
            for place, low, high in zip(projected, outline.min(axis=1), outline.max(axis=1), strict=True):
                inside &= (place > low) & (place < high)
        at = np.flatnonzero(inside)
        if len(at):
            toward = np.broadcast_to(sun[:, None], (3, len(at)))
            shadow[at] = np.isfinite(caster.intersect(points[:, at], toward))
    return shadow


def air_below(points: Array, car: Solid) -> Values:
    """Return the share of the sky's light that reaches ground points (3, N) near and below a car."""
    right, _, ahead = dots(car.frame, points - car.place[:, None])
    across, _, along = car.extent
    beside = np.maximum(np.maximum(across[0] - right, right - across[1]) + 0.2, 0)
    beyond = np.maximum(np.maximum(along[0] - ahead, ahead - along[1]) + 0.2, 0)
    return np.asarray(1 - 0.85 * np.exp(-(beside**2 + beyond**2) / 0.35**2), np.float32)


def sky(light: Light, direction: Array) -> Values:
    """Return the sky's colour (N, 3) in directions (3, N): pale at the horizon, with clouds."""
    x, y, z = (direction / np.linalg.norm(direction, axis=0)).astype(np.float32)
    rise = np.clip(y, 0, 1)
    flat = np.float32(60) / (rise + np.float32(0.15))
    noise = coarse(x * flat, z * flat, np.full_like(x, 0.5), light.clouds)
    cloud = np.clip(0.5 + 0.5 * noise, 0, 1) * np.sqrt(rise)
    clear, pale = np.array([1.0, 0.80, 0.62], np.float32), np.array([0.98, 0.95, 0.92], np.float32)
    mix = np.minimum(np.maximum(1 - 1.6 * rise, 0) + 0.8 * cloud, 1)[:, None]
    return np.asarray(clear + mix * (pale - clear), np.float32)


FAR = 180.0  # metres: the ground ends here, at a backdrop of trees


@dataclass
class Scene:
    """The light, surfaces and materials of a scene.

    `cars` are the solids that dim the road below them, `road` is the road's material, and `normal` (3,)
    points upward from the plane that touches the road below the rig.
    """

    light: Light
    normal: Array
    surfaces: list[Surface] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    cars: list[Solid] = field(default_factory=list)
    road: int = 0

    def material(self, look: Material) -> int:
        """Add a material; return its index."""
        self.materials.append(look)
        return len(self.materials) - 1


def draw_offset(rng: np.random.Generator) -> float:
    """Draw the offset at which a material reads its noise, metres, so that no two materials look alike."""
    return rng.uniform(0, 1000)
