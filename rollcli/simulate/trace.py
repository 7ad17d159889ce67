"""Which surface each ray meets, and what shading needs to know of it there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Rays
from rollcli.simulate.light import air_below, in_shadow
from rollcli.simulate.pixels import Pixels
from rollcli.simulate.scene import Scene
from rollcli.simulate.surfaces import Chart, Ground, Indices, Surface, Wall
from rollcli.simulate.texture import Values
from rollcli.simulate.vectors import Array, Vectors, dot, groups

NONE = -1  # the material of the sky
# the rows of `Seen.reads`
P, Q, LONG_P, LONG_Q, LONG, SHORT, SUN, AIR = range(8)


@dataclass(frozen=True)
class Seen:
    """For N rays: depth (inf: sky), indices of surface and material (-1: sky), and what shading needs there.

    `reads` (8, N) holds texture coordinates P and Q; the long axis of the pixel's footprint on them as LONG_P
    and LONG_Q, its length LONG, and the footprint's length across, SHORT, all in metres; the share of the
    sun's light, SUN, and of the sky's, AIR.
    """

    depth: Array
    surface: NDArray[np.int16]
    material: NDArray[np.int16]
    reads: Values


def trace(scene: Scene, pixels: Pixels) -> Seen:
    """Trace the rays and read what they meet."""
    depth, owner = first_hits(scene, pixels)
    seen = Seen(depth, owner, np.full(len(depth), NONE, np.int16), np.ones((8, len(depth)), np.float32))
    direction = pixels.rays.direction.astype(np.float32)
    for k, at in groups(owner, len(scene.surfaces)):
        _read(scene, scene.surfaces[k], pixels.rays, direction.take(at, axis=1), at, seen)
    _dim_below_cars(scene, pixels, seen)
    return seen


def first_hits(scene: Scene, pixels: Pixels) -> tuple[Array, NDArray[np.int16]]:
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
    footprint = _footprint(chart, direction, depth, rays)
    found = (chart.p, chart.q, *footprint, sun)
    for row, values in zip((P, Q, LONG_P, LONG_Q, LONG, SHORT, SUN), found, strict=True):
        seen.reads[row][at] = values


def _dim_below_cars(scene: Scene, pixels: Pixels, seen: Seen) -> None:
    """Take the sky's light from the ground near and below cars."""
    ground = np.array([isinstance(s, Ground) for s in scene.surfaces] + [False])[seen.surface]
    for car in scene.cars:
        window = pixels.window(car.bounds(margin=1.0))
        near = np.flatnonzero(ground) if window is None else window[ground[window]]
        points = pixels.rays.origin + seen.depth[near] * pixels.rays.direction[:, near]
        seen.reads[AIR][near] *= air_below(points, car)


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
