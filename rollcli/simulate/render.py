"""Render the two views of a frame and its true disparity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.build import build_scene, carriageway_of
from rollcli.simulate.camera import expose
from rollcli.simulate.dips import true_heights
from rollcli.simulate.scene import Scene
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.views import depths, render_view


@dataclass(frozen=True)
class RenderedFrame:
    """A rendered stereo pair with its truth.

    Attributes
    ----------
    left, right : numpy.ndarray
        uint8, (H, W, 3) in BGR order, or (H, W) where the spec asks for grey images.
    disparity : numpy.ndarray
        float32 (H, W), pixels, of the left view; 0 where there is only sky.
    road : numpy.ndarray
        bool (H, W): True where the left view shows the carriageway.
    spec : FrameSpec
        What was rendered.
    heights : numpy.ndarray or None
        float32 (H, W), metres: how high the ground in the left view lies over the road without dips and
        bumps; NaN where it shows no ground. None unless the spec has a number of dips.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    disparity: NDArray[np.float32]
    road: NDArray[np.bool_]
    spec: FrameSpec
    heights: NDArray[np.float32] | None = None

    @property
    def roll(self) -> float:
        """theta, radians."""
        return self.spec.roll

    @property
    def pitch(self) -> float:
        """Radians, positive looking down."""
        return self.spec.pitch


def render_frame(spec: FrameSpec) -> RenderedFrame:
    """Render both views, the true disparity of the left one, and which of its pixels are road."""
    scene, rng = build_scene(spec), spec.sensor_rng()
    cameras = spec.cameras(scene.normal)
    views = [render_view(scene, camera) for camera in cameras]
    left, right = (
        expose(view.light, spec.noise, gain, spec.colour, rng)
        for view, gain in zip(views, (1.0, spec.gain), strict=True)
    )
    disparity = (spec.focal * spec.baseline / views[0].depth).astype(np.float32)
    return RenderedFrame(left, right, disparity, views[0].material == scene.road, spec, _heights(scene, spec))


def _heights(scene: Scene, spec: FrameSpec) -> NDArray[np.float32] | None:
    if spec.dips is None:
        return None
    return true_heights(scene, spec, carriageway_of(spec), spec.cameras(scene.normal)[0])


def true_disparity(spec: FrameSpec) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the disparity (H, W) of the left view in double precision, 0 in the sky, and its road pixels."""
    scene = build_scene(spec)
    depth, material = depths(scene, spec.cameras(scene.normal)[0])
    return spec.focal * spec.baseline / depth, material == scene.road
