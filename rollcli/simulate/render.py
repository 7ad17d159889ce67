"""From a frame's spec to its two views and its true disparity."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Array, Camera, Rays
from rollcli.simulate.scene import Scene, build_scene
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Chart, Surface
from rollcli.simulate.texture import Values, coarse

MAX_TAPS = 16


@dataclass(frozen=True)
class Frame:
    """A rendered stereo pair with its truth.

    Attributes
    ----------
    left, right : numpy.ndarray
        uint8, (H, W, 3) in BGR order, or (H, W) for a grey spec.
    disparity : numpy.ndarray
        float32 (H, W), pixels, of the left view; 0 where there is only sky.
    road : numpy.ndarray
        bool (H, W): the left view's pixels that show the road surface.
    spec : FrameSpec
        What was rendered.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    disparity: NDArray[np.float32]
    road: NDArray[np.bool_]
    spec: FrameSpec

    @property
    def roll(self) -> float:
        """theta, radians."""
        return self.spec.roll

    @property
    def pitch(self) -> float:
        """Radians, positive looking down."""
        return self.spec.pitch


def render_frame(spec: FrameSpec) -> Frame:
    """Render both views, the true disparity of the left one, and which of its pixels are road."""
    scene = build_scene(spec)
    rng = spec.sensor_rng()
    left, right = spec.cameras
    depth, owner, light = _view(scene, left)
    disparity = np.where(owner >= 0, spec.focal * spec.baseline / depth, 0.0).astype(np.float32)
    road = np.isin(owner, list(scene.road))
    shape = (left.height, left.width)
    first = _expose(light, shape, spec, 1.0, rng)
    _, _, light = _view(scene, right)
    second = _expose(light, shape, spec, spec.gain, rng)
    return Frame(first, second, disparity.reshape(shape), road.reshape(shape), spec)


def true_disparity(spec: FrameSpec) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Disparity in full precision (H, W), and the road's pixels, without rendering the views."""
    scene = build_scene(spec)
    left = spec.cameras[0]
    grid = _Grid(left)
    depth, owner = _trace(scene, left, grid)
    disparity = np.where(owner >= 0, spec.focal * spec.baseline / depth, 0.0)
    shape = (left.height, left.width)
    return disparity.reshape(shape), np.isin(owner, list(scene.road)).reshape(shape)


class _Grid:
    """The pixels of a camera as rays, and which of them can meet a box."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        v, u = np.indices((camera.height, camera.width)).reshape(2, -1)
        self.rays = camera.rays(u, v)

    def window(self, corners: Array) -> NDArray[np.intp] | None:
        """Indices of the rays inside the outline of a box's corners (3, 8); None: possibly all."""
        u, v, depth = self._camera.project(corners)
        if depth.max() <= 0:
            return np.empty(0, np.intp)
        if depth.min() <= 0.1:
            return None
        width, height = self._camera.width, self._camera.height
        columns = np.arange(max(int(u.min()), 0), min(int(u.max()) + 2, width))
        rows = np.arange(max(int(v.min()), 0), min(int(v.max()) + 2, height))
        return (rows[:, None] * width + columns).ravel()


def _trace(scene: Scene, camera: Camera, grid: _Grid) -> tuple[Array, NDArray[np.int16]]:
    """Depth (inf for sky) and index of the surface (-1 for sky) that each ray meets first."""
    rays = grid.rays
    depth = np.full(rays.direction.shape[1], np.inf)
    owner = np.full(depth.shape, -1, np.int16)
    for k, surface in enumerate(scene.surfaces):
        bounds = surface.bounds()
        window = None if bounds is None else grid.window(bounds)
        if window is None:
            t = surface.intersect(rays.origin, rays.direction)
            nearer = t < depth
            np.copyto(depth, t, where=nearer)
            owner[nearer] = k
        elif len(window):
            t = surface.intersect(rays.origin, rays.direction[:, window])
            nearer = t < depth[window]
            hit = window[nearer]
            depth[hit] = t[nearer]
            owner[hit] = k
    return depth, owner


def _view(scene: Scene, camera: Camera) -> tuple[Array, NDArray[np.int16], Values]:
    """Depth, owner and light (N, 3) of a view's pixels."""
    grid = _Grid(camera)
    depth, owner = _trace(scene, camera, grid)
    light = np.empty((depth.size, 3), np.float32)
    sky = owner < 0
    light[sky] = _sky(scene, grid.rays.direction[:, sky])
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(len(scene.surfaces) + 1))
    for k, surface in enumerate(scene.surfaces):
        at = order[starts[k] : starts[k + 1]]
        if len(at):
            light[at] = _shade(scene, surface, grid.rays, at, depth[at])
    return depth, owner, light


def _shade(scene: Scene, surface: Surface, rays: Rays, at: NDArray[np.intp], depth: Array) -> Values:
    """The light (len(at), 3) that the rays `at` get from the surface that they meet."""
    direction = rays.direction[:, at]
    chart = surface.chart(rays.origin + depth * direction)
    albedo = _filtered(surface, chart, direction, depth, rays)
    length = np.sqrt((chart.normal**2).sum(axis=0))
    # a face seen from behind is lit as seen
    facing = -np.sign((chart.normal * direction).sum(axis=0))
    lambert = np.maximum((chart.normal * scene.sun[:, None]).sum(axis=0) * facing / length, 0.0)
    light = albedo * (scene.ambient + (1 - scene.ambient) * lambert).astype(np.float32) * np.float32(1.4)
    return np.asarray(light[:, None] * np.array(surface.material.tint, np.float32), np.float32)


def _filtered(surface: Surface, chart: Chart, direction: Array, depth: Array, rays: Rays) -> Values:
    """Albedo over each pixel's footprint: taps along its long axis, each as wide as its short one."""
    major_p, major_q, long, short = _footprint(chart, direction, depth, rays)
    wanted = np.clip(long / short, 1, MAX_TAPS)
    p, q = np.broadcast_to(chart.p, depth.shape), np.broadcast_to(chart.q, depth.shape)
    albedo = np.empty(depth.shape, np.float32)
    power = np.ceil(np.log2(wanted) - 0.5).astype(int)
    for k in range(power.max() + 1):
        at = np.flatnonzero(power == k)
        if not len(at):
            continue
        taps = 1 << k
        steps = ((np.arange(taps) + 0.5) / taps - 0.5)[:, None]
        width = np.maximum(short[at], long[at] / taps)
        tap_p = (p[at] + steps * major_p[at]).astype(np.float32).ravel()
        tap_q = (q[at] + steps * major_q[at]).astype(np.float32).ravel()
        values = surface.material.albedo(tap_p, tap_q, np.tile(width.astype(np.float32), taps))
        albedo[at] = values.reshape(taps, -1).mean(axis=0)
    return albedo


def _footprint(chart: Chart, direction: Array, depth: Array, rays: Rays) -> tuple[Array, Array, Array, Array]:
    """A pixel's shadow on the texture: its long axis (p, q), and both lengths, metres."""
    per_ray = (chart.normal * direction).sum(axis=0)
    per_ray = np.where(np.abs(per_ray) < 1e-9, 1e-9, per_ray)
    slopes = []
    for step in (rays.across, rays.down):
        slide = (chart.normal * step[:, None]).sum(axis=0) / per_ray
        moved = depth * (step[:, None] - slide * direction)
        slopes += [(chart.grad_p * moved).sum(axis=0), (chart.grad_q * moved).sum(axis=0)]
    pu, qu, pv, qv = slopes
    pp, qq, pq = pu * pu + pv * pv, qu * qu + qv * qv, pu * qu + pv * qv
    spread = np.hypot((pp - qq) / 2, pq)
    long = np.sqrt((pp + qq) / 2 + spread)
    short = np.maximum(np.abs(pu * qv - pv * qu) / np.maximum(long, 1e-12), 1e-5)
    angle = 0.5 * np.arctan2(2 * pq, pp - qq)
    return long * np.cos(angle), long * np.sin(angle), np.maximum(long, 1e-5), short


def _sky(scene: Scene, direction: Array) -> Values:
    """A bright sky, paler at the horizon, with clouds."""
    x, y, z = (direction / np.linalg.norm(direction, axis=0)).astype(np.float32)
    rise = np.clip(y, 0, 1)
    flat = np.float32(60) / (rise + np.float32(0.15))
    w = np.full_like(x, 0.5)
    cloud = np.clip(0.5 + 0.5 * coarse(x * flat, z * flat, w, scene.sky_offset), 0, 1) * np.sqrt(rise)
    clear = np.array([1.0, 0.80, 0.62], np.float32)
    pale = np.array([0.98, 0.95, 0.92], np.float32)
    mix = np.minimum(np.maximum(1 - 1.6 * rise, 0) + 0.8 * cloud, 1)[:, None]
    return np.asarray(clear + mix * (pale - clear), np.float32)


def _expose(
    light: Values, shape: tuple[int, int], spec: FrameSpec, gain: float, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """What the sensor makes of the light: vignetting, gamma, noise, eight bits."""
    height, width = shape
    v, u = np.ogrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    falloff = (1 - 0.12 * (u * u + v * v)).astype(np.float32) * np.float32(gain)
    image: NDArray[Any] = light.reshape(height, width, 3)
    if not spec.colour:
        image = image @ np.array([0.114, 0.587, 0.299], np.float32)
        falloff = falloff[..., None][..., 0]
    else:
        falloff = falloff[..., None]
    grey = 255 * np.sqrt(np.maximum(image * falloff, 0))  # a gamma of 2
    grey += np.float32(spec.noise) * rng.standard_normal(grey.shape, np.float32)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)
