"""Render the image of one camera, in bands of rows so that memory does not grow with the image."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.geometry.camera import Camera
from rollcli.simulate.geometry.pixels import PixelRays
from rollcli.simulate.geometry.vectors import Array
from rollcli.simulate.looks.texture import Values
from rollcli.simulate.scenes.scene import Scene
from rollcli.simulate.views.shade import shade
from rollcli.simulate.views.trace import SUN, Hits, trace

_BAND = 350_000  # pixels; an image of 640x480 is one band
# four positions inside a pixel, no two in the same row or column
_SUBPIXELS = np.array([[-0.375, -0.125], [0.125, -0.375], [0.375, 0.125], [-0.125, 0.375]])


@dataclass(frozen=True)
class View:
    """A camera's image: depth (H, W) in metres, inf in the sky; material (H, W); light (H, W, 3)."""

    depth: Array
    material: NDArray[np.int16]
    light: Values


def render_view(scene: Scene, camera: Camera) -> View:
    """Render the image of a camera; pixels at edges are the mean of four rays."""
    bands = [_render_band(scene, camera, rows) for rows in _bands(camera)]
    return View(
        np.concatenate([band.depth for band in bands]),
        np.concatenate([band.material for band in bands]),
        np.concatenate([band.light for band in bands]),
    )


def depths(scene: Scene, camera: Camera) -> tuple[Array, NDArray[np.int16]]:
    """Return depth and material (H, W) of a camera's image, as in `View`, without rendering its light."""
    shape = (camera.height, camera.width)
    bands = [trace(scene, PixelRays.of_rows(camera, rows)) for rows in _bands(camera)]
    depth = np.concatenate([band.depth for band in bands])
    return depth.reshape(shape), np.concatenate([band.material for band in bands]).reshape(shape)


def _bands(camera: Camera) -> list[range]:
    step = max(1, _BAND // camera.width)
    return [range(top, min(top + step, camera.height)) for top in range(0, camera.height, step)]


def _render_band(scene: Scene, camera: Camera, rows: range) -> View:
    """Render these rows of a camera's image."""
    # one more row above and below: an edge is where a pixel differs from its neighbour
    around = range(max(rows.start - 1, 0), min(rows.stop + 1, camera.height))
    pixels = PixelRays.of_rows(camera, around)
    hits = trace(scene, pixels)
    edge = np.flatnonzero(_edges(hits, camera.width))
    u = (pixels.u[edge] + _SUBPIXELS[:, :1]).ravel()
    v = (pixels.v[edge] + _SUBPIXELS[:, 1:]).ravel()
    between = PixelRays.at(camera, u, v)
    finer = trace(scene, between)
    light = shade(
        scene,
        np.concatenate([pixels.rays.direction, between.rays.direction], axis=1),
        np.concatenate([hits.material, finer.material]),
        np.concatenate([hits.reads, finer.reads], axis=1),
    )
    light[edge] = light[len(pixels.u) :].reshape(4, -1, 3).mean(axis=0)
    shape, inner = (len(around), camera.width), slice(rows.start - around.start, rows.stop - around.start)
    return View(
        hits.depth.reshape(shape)[inner],
        hits.material.reshape(shape)[inner],
        light[: len(pixels.u)].reshape(*shape, 3)[inner],
    )


def _edges(hits: Hits, width: int) -> NDArray[np.bool_]:
    """Find pixels that differ from a neighbour in surface, material or shadow."""
    shadow = hits.reads[SUN] == 0
    kind = (hits.surface.astype(np.int32) << 17) + (hits.material.astype(np.int32) << 1) + shadow
    kind = kind.reshape(-1, width)
    edge = np.zeros(kind.shape, bool)
    beside, below = np.diff(kind, axis=1) != 0, np.diff(kind, axis=0) != 0
    edge[:, 1:] |= beside
    edge[:, :-1] |= beside
    edge[1:] |= below
    edge[:-1] |= below
    return edge.ravel()
