"""Cameras with their sensor, and their views: trace rays, shade what they hit, and expose the image."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import strips
from rollcli.simulate.materials import Material, Values
from rollcli.simulate.relief import Array, Vectors
from rollcli.simulate.scene import OVERCAST, Scene, air_below, in_shadow, sky
from rollcli.simulate.surfaces import Ground, Indices, Surface, SurfaceSample, Wall


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

    @property
    def steps(self) -> Array:
        """Return the steps of a ray's direction for one pixel to the right and one pixel down, (2, 3)."""
        return np.asarray(self.axes[:2] / self.focal)

    def rays(self, u: NDArray[Any], v: NDArray[Any]) -> "Rays":
        """Return the rays through positions `u`, `v` (N,), pixels from the centre of the top-left pixel."""
        right, down = self.steps[..., None]
        x, y = u - self.centre[0], v - self.centre[1]
        return Rays(self, u, v, self.axes[2][:, None] + right * x + down * y)

    def rays_of(self, rows: range) -> "Rays":
        """Return the rays through the centres of all pixels of these rows, row by row."""
        v, u = np.indices((len(rows), self.width), float).reshape(2, -1)
        return self.rays(u, v + rows.start)


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


def dot(a: Vectors, b: Vectors) -> Vectors:
    """Return a . b for each vector; each of the two is (3, N), (3, 1) or (3,)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


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
class Rays:
    """The rays of a camera through positions u, v (N,), pixels.

    `direction` (3, N) has length one along the optical axis, so that a ray's parameter is its depth, metres.
    """

    camera: Camera
    u: Array
    v: Array
    direction: Array

    @property
    def origin(self) -> Array:
        """Return where all of them begin, (3, 1), metres."""
        return self.camera.position[:, None]

    def window(self, corners: Array | None) -> Indices | slice:
        """Return where the rays are that can hit a box with these corners (3, 8); of no box, all of them."""
        if corners is None:
            return slice(None)
        camera = self.camera
        x, y, depth = camera.axes @ (corners - camera.position[:, None])
        if depth.max() <= 0:
            return np.empty(0, np.intp)
        if depth.min() <= 0.1:
            return slice(None)
        u, v = camera.focal * x / depth + camera.centre[0], camera.focal * y / depth + camera.centre[1]
        across = (self.u >= u.min()) & (self.u <= u.max())
        return np.flatnonzero(across & (self.v >= v.min()) & (self.v <= v.max()))


NONE = -1  # the material of the sky
# the rows of `Hits.reads`
P, Q, LONG_P, LONG_Q, LONG, SHORT, SUN, AIR = range(8)


@dataclass(frozen=True)
class Hits:
    """For N rays: depth (inf: sky), indices of surface and material (-1: sky), and the input of shading.

    `reads` (8, N) holds texture coordinates P and Q; the long axis of the pixel's footprint on them as LONG_P
    and LONG_Q, its length LONG, and the footprint's length across, SHORT, all in metres; the share of the
    sun's light, SUN, and of the sky's, AIR.
    """

    depth: Array
    surface: NDArray[np.int16]
    material: NDArray[np.int16]
    reads: Values


def trace(scene: Scene, rays: Rays) -> Hits:
    """Trace the rays, and evaluate the surfaces where they are hit."""
    depth, owner = first_hits(scene, rays)
    hits = Hits(depth, owner, np.full(len(depth), NONE, np.int16), np.ones((8, len(depth)), np.float32))
    for k, at in groups(owner, len(scene.surfaces)):
        _read(scene, scene.surfaces[k], rays, at, hits)
    _dim_below_cars(scene, rays, hits)
    return hits


def groups(labels: NDArray[np.int16], n: int) -> Iterator[tuple[int, Indices]]:
    """Yield each label from 0 to n - 1 that occurs, and its indices."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(n + 1))
    for k in np.flatnonzero(np.diff(starts)):
        yield int(k), order[starts[k] : starts[k + 1]]


def first_hits(scene: Scene, rays: Rays) -> tuple[Array, NDArray[np.int16]]:
    """Return the depth (inf for sky) and the index of the surface (-1 for sky) that each ray hits first."""
    depth = np.full(len(rays.u), np.inf)
    owner = np.full(len(rays.u), -1, np.int16)
    for k, surface in enumerate(scene.surfaces):
        at = rays.window(surface.bounds())
        t = surface.intersect(rays.origin, rays.direction[:, at])
        nearer = t < depth[at]
        depth[at] = np.where(nearer, t, depth[at])
        owner[at] = np.where(nearer, k, owner[at])
    return depth, owner


def _read(scene: Scene, surface: Surface, rays: Rays, at: Indices, hits: Hits) -> None:
    """Fill `hits` for the rays `at`, which hit this surface."""
    direction, depth = rays.direction.take(at, axis=1).astype(np.float32), hits.depth[at].astype(np.float32)
    points = rays.origin.astype(np.float32) + depth * direction
    sample = surface.sample(points)
    # light the side that faces the camera
    facing = -np.sign(dot(sample.normal, direction))
    lambert = facing * dot(sample.normal, scene.light.sun.astype(np.float32))
    sun = np.maximum(lambert / np.sqrt(dot(sample.normal, sample.normal)), 0)
    if scene.light.ambient < OVERCAST and isinstance(surface, Ground | Wall):
        casters = [s for s in scene.surfaces if not isinstance(s, Ground)]
        lit = np.flatnonzero(sun)
        sun[lit[in_shadow(points[:, lit], scene.light.sun, casters)]] = 0
    hits.material[at] = sample.material
    footprint = _footprint(sample, direction, depth, rays)
    for row, values in enumerate((sample.p, sample.q, *footprint, sun)):  # P to SUN
        hits.reads[row][at] = values


def _dim_below_cars(scene: Scene, rays: Rays, hits: Hits) -> None:
    """Reduce the sky's light on the ground near and below cars."""
    ground = np.array([isinstance(s, Ground) for s in scene.surfaces] + [False])[hits.surface]
    for car in scene.cars:
        near = np.arange(len(ground))[rays.window(car.bounds(margin=1.0))]
        near = near[ground[near]]
        points = rays.origin + hits.depth[near] * rays.direction[:, near]
        hits.reads[AIR][near] *= air_below(points, car)


def _footprint(sample: SurfaceSample, direction: Vectors, depth: Vectors, rays: Rays) -> tuple[Vectors, ...]:
    """Return the ellipse that a pixel covers on the texture: its long axis (p, q) and both lengths, m."""
    per_ray = dot(sample.normal, direction)
    scale = depth / np.where(np.abs(per_ray) < 1e-9, 1e-9, per_ray)
    ray_p, ray_q = dot(sample.grad_p, direction), dot(sample.grad_q, direction)
    slopes = []
    for step in rays.camera.steps.astype(np.float32):
        slide = dot(sample.normal, step) * scale
        slopes += [
            dot(sample.grad_p, step) * depth - slide * ray_p,
            dot(sample.grad_q, step) * depth - slide * ray_q,
        ]
    pu, qu, pv, qv = slopes
    pp, qq, pq = pu * pu + pv * pv, qu * qu + qv * qv, pu * qu + pv * qv
    half = (pp - qq) * 0.5
    spread = np.sqrt(half * half + pq * pq)
    long = np.maximum(np.sqrt((pp + qq) * 0.5 + spread), 1e-5)
    short = np.maximum(np.abs(pu * qv - pv * qu) / long, 1e-5)
    # the eigenvector of the larger eigenvalue, from the row without cancellation
    long_p, long_q = np.where(half > 0, spread + half, pq), np.where(half > 0, pq, spread - half)
    stretch = long / np.maximum(np.sqrt(long_p * long_p + long_q * long_q), 1e-20)
    return long_p * stretch, long_q * stretch, long, short


_MAX_TAPS = 8


def shade(scene: Scene, rays: Rays, hits: Hits) -> Values:
    """Return the light (N, 3) that rays bring from what they hit."""
    light, reads = np.empty((len(hits.material), 3), np.float32), hits.reads
    nothing = hits.material == NONE
    light[nothing] = sky(scene.light, rays.direction[:, nothing])
    ambient = np.float32(scene.light.ambient)
    strength = np.float32(scene.light.exposure) * (ambient * reads[AIR] + (1 - ambient) * reads[SUN])
    for k, at in groups(hits.material, len(scene.materials)):
        material, mine = scene.materials[k], reads[: SHORT + 1].take(at, axis=1)
        bright = _albedo(material, mine) * strength[at]
        light[at] = bright[:, None] * material.colour(mine[P], mine[Q])
    return light


def _albedo(material: Material, reads: Values) -> Values:
    """Average the albedo over each pixel's footprint: taps along its long axis, as wide as its short one."""
    albedo = np.empty(reads.shape[1], np.float32)
    power = np.ceil(np.log2(np.clip(reads[LONG] / reads[SHORT], 1, _MAX_TAPS)) - 0.5).astype(np.int16)
    for k, at in groups(power, power.max() + 1):
        p, q, long_p, long_q, long, short = reads.take(at, axis=1)
        taps = 1 << k
        steps = (((np.arange(taps) + 0.5) / taps - 0.5)[:, None]).astype(np.float32)
        width = np.tile(np.maximum(short, long / np.float32(taps)), taps)
        values = material.albedo((p + steps * long_p).ravel(), (q + steps * long_q).ravel(), width)
        albedo[at] = values.reshape(taps, -1).mean(axis=0)
    return albedo


_BAND = 350_000  # pixels; an image of 640x480 is one band
# four positions inside a pixel, no two in the same row or column
_SUBPIXELS = np.array([[-0.375, -0.125], [0.125, -0.375], [0.375, 0.125], [-0.125, 0.375]])


class View(NamedTuple):
    """A camera's image: depth in metres, inf in the sky; surface, material, all (H, W); light (H, W, 3)."""

    depth: Array
    surface: NDArray[np.int16]
    material: NDArray[np.int16]
    light: Values


def render_view(scene: Scene, camera: Camera) -> View:
    """Render the image of a camera; pixels at edges are the mean of four rays."""
    found = [_render_band(scene, camera, rows) for rows in strips(camera.height, _BAND // camera.width)]
    return View(*map(np.concatenate, zip(*found, strict=True)))


def _render_band(scene: Scene, camera: Camera, rows: slice) -> View:
    """Render these rows of a camera's image."""
    # one more row above and below: an edge is where a pixel differs from its neighbour
    around = range(max(rows.start - 1, 0), min(rows.stop + 1, camera.height))
    rays = camera.rays_of(around)
    hits = trace(scene, rays)
    edge = np.flatnonzero(_edges(hits, camera.width))
    u = (rays.u[edge] + _SUBPIXELS[:, :1]).ravel()
    v = (rays.v[edge] + _SUBPIXELS[:, 1:]).ravel()
    between = camera.rays(u, v)
    finer = trace(scene, between)
    light = shade(scene, rays, hits)
    light[edge] = shade(scene, between, finer).reshape(4, -1, 3).mean(axis=0)
    shape, inner = (len(around), camera.width), slice(rows.start - around.start, rows.stop - around.start)
    found: tuple[NDArray[Any], ...] = (hits.depth, hits.surface, hits.material, light)
    return View(*(each.reshape(*shape, *each.shape[1:])[inner] for each in found))


def _edges(hits: Hits, width: int) -> NDArray[np.bool_]:
    """Find pixels that differ from a neighbour in surface, material or shadow."""
    shadow = hits.reads[SUN] == 0
    kind = (hits.surface.astype(np.int32) << 17) + (hits.material.astype(np.int32) << 1) + shadow
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    change = cv2.morphologyEx(kind.reshape(-1, width).astype(np.float64), cv2.MORPH_GRADIENT, cross)
    return np.asarray(change.ravel() != 0)
