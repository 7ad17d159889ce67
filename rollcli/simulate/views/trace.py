"""Find the surface that each ray hits first, and what shading needs to know about it there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.geometry.camera import Rays
from rollcli.simulate.geometry.pixels import PixelRays
from rollcli.simulate.geometry.surfaces import Ground, Indices, Surface, SurfaceSample, Wall
from rollcli.simulate.geometry.vectors import Array, Vectors, dot, groups
from rollcli.simulate.looks.texture import Values
from rollcli.simulate.scenes.light import air_below, in_shadow
from rollcli.simulate.scenes.scene import Scene

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


def trace(scene: Scene, pixels: PixelRays) -> Hits:
    """Trace the rays, and evaluate the surfaces where they are hit."""
    depth, owner = first_hits(scene, pixels)
    hits = Hits(depth, owner, np.full(len(depth), NONE, np.int16), np.ones((8, len(depth)), np.float32))
    direction = pixels.rays.direction.astype(np.float32)
    for k, at in groups(owner, len(scene.surfaces)):
        _read(scene, scene.surfaces[k], pixels.rays, direction.take(at, axis=1), at, hits)
    _dim_below_cars(scene, pixels, hits)
    return hits


def first_hits(scene: Scene, pixels: PixelRays) -> tuple[Array, NDArray[np.int16]]:
    """Return the depth (inf for sky) and the index of the surface (-1 for sky) that each ray hits first."""
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


def _read(scene: Scene, surface: Surface, rays: Rays, direction: Values, at: Indices, hits: Hits) -> None:
    """Fill `hits` for the rays `at`, which go in `direction` and hit this surface."""
    depth = hits.depth[at].astype(np.float32)
    points = rays.origin.astype(np.float32) + depth * direction
    sample = surface.sample(points)
    # light the side that faces the camera
    facing = -np.sign(dot(sample.normal, direction))
    lambert = facing * dot(sample.normal, scene.light.sun.astype(np.float32))
    sun = np.maximum(lambert / np.sqrt(dot(sample.normal, sample.normal)), 0)
    if scene.light.sunny and isinstance(surface, Ground | Wall):
        casters = [s for s in scene.surfaces if not isinstance(s, Ground)]
        lit = np.flatnonzero(sun)
        sun[lit[in_shadow(points[:, lit], scene.light.sun, casters)]] = 0
    hits.material[at] = sample.material
    footprint = _footprint(sample, direction, depth, rays)
    found = (sample.p, sample.q, *footprint, sun)
    for row, values in zip((P, Q, LONG_P, LONG_Q, LONG, SHORT, SUN), found, strict=True):
        hits.reads[row][at] = values


def _dim_below_cars(scene: Scene, pixels: PixelRays, hits: Hits) -> None:
    """Reduce the sky's light on the ground near and below cars."""
    ground = np.array([isinstance(s, Ground) for s in scene.surfaces] + [False])[hits.surface]
    for car in scene.cars:
        window = pixels.window(car.bounds(margin=1.0))
        near = np.flatnonzero(ground) if window is None else window[ground[window]]
        points = pixels.rays.origin + hits.depth[near] * pixels.rays.direction[:, near]
        hits.reads[AIR][near] *= air_below(points, car)


def _footprint(sample: SurfaceSample, direction: Vectors, depth: Vectors, rays: Rays) -> tuple[Vectors, ...]:
    """Return the ellipse that a pixel covers on the texture: its long axis (p, q) and both lengths, m."""
    per_ray = dot(sample.normal, direction)
    scale = depth / np.where(np.abs(per_ray) < 1e-9, 1e-9, per_ray)
    ray_p, ray_q = dot(sample.grad_p, direction), dot(sample.grad_q, direction)
    slopes = []
    for step in (rays.across.astype(np.float32), rays.down.astype(np.float32)):
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
