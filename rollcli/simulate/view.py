"""What one camera sees of a scene: depths, materials and light."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Camera, Rays
from rollcli.simulate.light import air_below, in_shadow, sky
from rollcli.simulate.materials import Material
from rollcli.simulate.scene import Scene
from rollcli.simulate.surfaces import Chart, Ground, Indices, Surface, Wall
from rollcli.simulate.texture import Values
from rollcli.simulate.vectors import Array, Vectors, dot

MAX_TAPS = 8
NONE = -1  # the material of the sky

# four positions inside a pixel, no two in a row or a column
_SUBPIXELS = np.array([[-0.375, -0.125], [0.125, -0.375], [0.375, 0.125], [-0.125, 0.375]])


@dataclass(frozen=True)
class View:
    """A camera's image: depth (H, W) in metres, inf in the sky; material (H, W); light (H, W, 3)."""

    depth: Array
    material: NDArray[np.int16]
    light: Values


@dataclass(frozen=True)
class Pixels:
    """Image positions u, v (N,) of a camera and the rays through them; `whole`: they are all its pixels."""

    camera: Camera
    u: Array
    v: Array
    rays: Rays
    whole: bool

    @staticmethod
    def all_of(camera: Camera) -> "Pixels":
        """Every pixel's centre, row by row."""
        v, u = np.indices((camera.height, camera.width), float).reshape(2, -1)
        return Pixels(camera, u, v, camera.rays(u, v), True)

    @staticmethod
    def at(camera: Camera, u: Array, v: Array) -> "Pixels":
        """Any positions."""
        return Pixels(camera, u, v, camera.rays(u, v), False)

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
        if not self.whole:
            inside = (self.u >= low_u) & (self.u <= high_u) & (self.v >= low_v) & (self.v <= high_v)
            return np.flatnonzero(inside)
        width, height = self.camera.width, self.camera.height
        columns = np.arange(max(int(np.ceil(low_u)), 0), min(int(high_u) + 1, width))
        rows = np.arange(max(int(np.ceil(low_v)), 0), min(int(high_v) + 1, height))
        return (rows[:, None] * width + columns).ravel()


@dataclass(frozen=True)
class Seen:
    """For N rays: depth (inf: sky), indices of surface and material (-1: sky), and what shading needs there.

    `reads` (8, N) holds texture coordinates p and q; the long axis of the pixel's footprint on them, as p, q
    and length; the footprint's short length, all in metres; the share of the sun's light, and of the sky's.
    """

    depth: Array
    surface: NDArray[np.int16]
    material: NDArray[np.int16]
    reads: Values


def look(scene: Scene, camera: Camera) -> View:
    """Render a camera's image; pixels at the edges of things are averaged from four rays."""
    pixels = Pixels.all_of(camera)
    seen = see(scene, pixels)
    edge = np.flatnonzero(_edges(seen, camera))
    u = (pixels.u[edge] + _SUBPIXELS[:, :1]).ravel()
    v = (pixels.v[edge] + _SUBPIXELS[:, 1:]).ravel()
    between = Pixels.at(camera, u, v)
    finer = see(scene, between)
    light = _light(
        scene,
        np.concatenate([pixels.rays.direction, between.rays.direction], axis=1),
        np.concatenate([seen.material, finer.material]),
        np.concatenate([seen.reads, finer.reads], axis=1),
    )
    light[edge] = light[len(pixels.u) :].reshape(4, -1, 3).mean(axis=0)
    shape = (camera.height, camera.width)
    light = light[: len(pixels.u)].reshape(*shape, 3)
    return View(seen.depth.reshape(shape), seen.material.reshape(shape), light)


def _edges(seen: Seen, camera: Camera) -> NDArray[np.bool_]:
    """Pixels whose right or lower neighbour, or left or upper one, shows something else or lies in shadow."""
    kind = (
        (seen.surface.astype(np.int32) << 17) + (seen.material.astype(np.int32) << 1) + (seen.reads[6] == 0)
    )
    kind = kind.reshape(camera.height, camera.width)
    edge = np.zeros(kind.shape, bool)
    for axis in (0, 1):
        differs = np.diff(kind, axis=axis) != 0
        before, after = (slice(None, -1), slice(None)), (slice(1, None), slice(None))
        edge[before if axis == 0 else before[::-1]] |= differs
        edge[after if axis == 0 else after[::-1]] |= differs
    return edge.ravel()


def trace(scene: Scene, pixels: Pixels) -> tuple[Array, NDArray[np.int16]]:
    """Depth (inf for sky) and index of the surface (-1 for sky) that each ray meets first."""
    rays = pixels.rays
    depth = np.full(len(pixels.u), np.inf)
    owner = np.full(len(pixels.u), -1, np.int16)
    for k, surface in enumerate(scene.surfaces):
        window = pixels.window(surface.bounds())
        if window is None:
            t = surface.intersect(rays.origin, rays.direction)
            nearer = t < depth
            np.copyto(depth, t, where=nearer)
            owner[nearer] = k
        elif len(window):
            t = surface.intersect(rays.origin, rays.direction[:, window])
            nearer = t < depth[window]
            depth[window[nearer]] = t[nearer]
            owner[window[nearer]] = k
    return depth, owner


def see(scene: Scene, pixels: Pixels) -> Seen:
    """Trace the rays and read what they meet."""
    depth, owner = trace(scene, pixels)
    seen = Seen(depth, owner, np.full(len(depth), NONE, np.int16), np.ones((8, len(depth)), np.float32))
    direction = pixels.rays.direction.astype(np.float32)
    for k, at in _groups(owner, len(scene.surfaces)):
        _read(scene, scene.surfaces[k], pixels.rays, direction.take(at, axis=1), at, seen)
    _dim_below_cars(scene, pixels, seen)
    return seen


def _groups(labels: NDArray[np.int16], n: int) -> Iterator[tuple[int, Indices]]:
    """Each label from 0 to n - 1 that occurs, and where."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(n + 1))
    for k in np.flatnonzero(np.diff(starts)):
        yield int(k), order[starts[k] : starts[k + 1]]


def _read(scene: Scene, surface: Surface, rays: Rays, direction: Values, at: Indices, seen: Seen) -> None:
    """Fill `seen` at the rays `at`, which go in `direction` and meet this surface."""
    depth = seen.depth[at].astype(np.float32)
    points = rays.origin.astype(np.float32) + depth * direction
    chart = surface.chart(points)
    # a face seen from behind is lit as seen
    facing = -np.sign(dot(chart.normal, direction))
    lambert = facing * dot(chart.normal, scene.light.sun.astype(np.float32))
    sun = np.maximum(lambert / np.sqrt(dot(chart.normal, chart.normal)), 0)
    if scene.light.sunny and isinstance(surface, Ground | Wall):
        casters = [s for s in scene.surfaces if not isinstance(s, Ground)]
        lit = np.flatnonzero(sun)
        sun[lit[in_shadow(points[:, lit], scene.light.sun, casters)]] = 0
    seen.material[at] = chart.material
    for row, values in enumerate((chart.p, chart.q, *_footprint(chart, direction, depth, rays), sun)):
        seen.reads[row][at] = values


def _dim_below_cars(scene: Scene, pixels: Pixels, seen: Seen) -> None:
    """Take the sky's light from the ground near and below cars."""
    ground = np.array([isinstance(s, Ground) for s in scene.surfaces] + [False])[seen.surface]
    for car in scene.cars:
        window = pixels.window(car.bounds(margin=1.0))
        near = np.flatnonzero(ground) if window is None else window[ground[window]]
        points = pixels.rays.origin + seen.depth[near] * pixels.rays.direction[:, near]
        seen.reads[7][near] *= air_below(points, car)


def _footprint(chart: Chart, direction: Vectors, depth: Vectors, rays: Rays) -> tuple[Vectors, ...]:
    """A pixel's shadow on the texture: its long axis (p, q), and both lengths, metres."""
    per_ray = dot(chart.normal, direction)
    scale = depth / np.where(np.abs(per_ray) < 1e-9, 1e-9, per_ray)
    ray_p, ray_q = dot(chart.grad_p, direction), dot(chart.grad_q, direction)
    slopes = []
    for step in (rays.across.astype(np.float32), rays.down.astype(np.float32)):
        slide = dot(chart.normal, step) * scale
        slopes += [
            dot(chart.grad_p, step) * depth - slide * ray_p,
            dot(chart.grad_q, step) * depth - slide * ray_q,
        ]
    pu, qu, pv, qv = slopes
    pp, qq, pq = pu * pu + pv * pv, qu * qu + qv * qv, pu * qu + pv * qv
    half = (pp - qq) * 0.5
    spread = np.sqrt(half * half + pq * pq)
    long = np.maximum(np.sqrt((pp + qq) * 0.5 + spread), 1e-5)
    short = np.maximum(np.abs(pu * qv - pv * qu) / long, 1e-5)
    # the eigenvector of the larger eigenvalue, from the row that does not cancel
    long_p, long_q = np.where(half > 0, spread + half, pq), np.where(half > 0, pq, spread - half)
    stretch = long / np.maximum(np.sqrt(long_p * long_p + long_q * long_q), 1e-20)
    return long_p * stretch, long_q * stretch, long, short


def _light(scene: Scene, direction: Array, kinds: NDArray[np.int16], reads: Values) -> Values:
    """The light (N, 3) that rays carry which go in `direction` (3, N); `kinds` and `reads` as in `Seen`."""
    light = np.empty((len(kinds), 3), np.float32)
    nothing = kinds == NONE
    light[nothing] = sky(scene.light, direction[:, nothing])
    ambient = np.float32(scene.light.ambient)
    strength = np.float32(scene.light.exposure) * (ambient * reads[7] + (1 - ambient) * reads[6])
    for k, at in _groups(kinds, len(scene.materials)):
        material, mine = scene.materials[k], reads[:6].take(at, axis=1)
        bright = _albedo(material, mine) * strength[at]
        light[at] = bright[:, None] * material.colour(mine[0], mine[1])
    return light


def _albedo(material: Material, reads: Values) -> Values:
    """Albedo over each pixel's footprint: taps along its long axis, each as wide as its short one."""
    albedo = np.empty(reads.shape[1], np.float32)
    power = np.ceil(np.log2(np.clip(reads[4] / reads[5], 1, MAX_TAPS)) - 0.5).astype(np.int16)
    for k, at in _groups(power, power.max() + 1):
        p, q, long_p, long_q, long, short = reads.take(at, axis=1)
        taps = 1 << k
        steps = (((np.arange(taps) + 0.5) / taps - 0.5)[:, None]).astype(np.float32)
        width = np.tile(np.maximum(short, long / np.float32(taps)), taps)
        values = material.albedo((p + steps * long_p).ravel(), (q + steps * long_q).ravel(), width)
        albedo[at] = values.reshape(taps, -1).mean(axis=0)
    return albedo
