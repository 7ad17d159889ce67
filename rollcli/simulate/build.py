"""Build the scenes, each drawn from the seeds of a frame, and render their two views and true disparity."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate import roadside
from rollcli.simulate.camera import expose
from rollcli.simulate.dips import add_dips, true_heights
from rollcli.simulate.materials import Plain
from rollcli.simulate.road import Carriageway, Piece, draw_asphalt, draw_carriageway
from rollcli.simulate.scene import FAR, Light, Scene, draw, draw_light, draw_offset
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Ground
from rollcli.simulate.views import depths, render_view

_HORIZON = 2000.0  # metres: the end of a bare world


def build_scene(spec: FrameSpec) -> Scene:
    """Build the scene of a frame: the same for the same kind of scene, road and seeds."""
    rng, light, carriageway = _begin(spec)
    scene = Scene(light, normal=carriageway.normal)
    scene.road = scene.material(draw_asphalt(rng, carriageway))
    _KINDS[spec.scene](scene, rng, carriageway)
    add_dips(scene, spec, carriageway)
    return scene


def road_camber(spec: FrameSpec) -> float:
    """Return the curvature across the road below the rig, 1/(camera height); a crown is negative."""
    return carriageway_of(spec).section.piece(0.0).curvature_at(0.0) * spec.height


def carriageway_of(spec: FrameSpec) -> Carriageway:
    """Draw the carriageway of a frame, without the rest of its scene."""
    return _begin(spec)[2]


def _begin(spec: FrameSpec) -> tuple[np.random.Generator, Light, Carriageway]:
    """Draw the light and the carriageway; return them with the generator for the rest of the scene."""
    rng = spec.rng(Stream.SCENE)
    return rng, draw_light(rng), draw_carriageway(rng, spec)


def _bare(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add the road, and level grass from its edges to the horizon."""
    grass = roadside.add_grass(scene, rng)
    left, right = (
        Piece(*ends, offset=carriageway.section.elevation(edge))
        for ends, edge in (
            ((-np.inf, carriageway.left), carriageway.left),
            ((carriageway.right, np.inf), carriageway.right),
        )
    )
    strips = [(left, grass), *_road_strips(scene, carriageway), (right, grass)]
    scene.surfaces += _grounds(carriageway, strips, _HORIZON)


def _open(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a road with kerbs, sidewalks, lawns, trees and cars."""
    _lay_road(scene, carriageway)
    grass = roadside.add_grass(scene, rng)
    for side, edge in carriageway.sides:
        level, outer = roadside.add_sidewalk(scene, rng, carriageway, side, edge)
        roadside.add_slope(
            scene, carriageway, side, outer, side * np.inf, level, draw(rng, -0.04, 0.06), grass
        )
        if rng.random() < 0.3:
            roadside.add_hedge(scene, rng, carriageway, outer + side * draw(rng, 0.2, 1.0), level - 0.1)
        roadside.add_posts(scene, rng, carriageway, outer - side * 0.3, level)
        roadside.add_trees(scene, rng, carriageway, outer, outer + side * 25, level - 0.4)
    roadside.add_cars(scene, rng, carriageway)
    roadside.add_backdrop(scene, rng, carriageway)


def _street(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a street between house fronts."""
    _lay_road(scene, carriageway)
    yard = scene.material(Plain(0.3, tint=(0.9, 0.97, 1.0), offset=draw_offset(rng)))
    for side, edge in carriageway.sides:
        level, outer = roadside.add_sidewalk(scene, rng, carriageway, side, edge, beyond=yard)
        garden = float(rng.choice([0.0, 1.0])) * draw(rng, 1, 6)
        roadside.add_houses(scene, rng, carriageway.course, side, outer + side * garden, level)
        roadside.add_posts(scene, rng, carriageway, edge + side * 0.5, level)
        if rng.random() < 0.35:
            roadside.add_trees(scene, rng, carriageway, edge + side * 0.8, edge + side * 0.9, level)
    roadside.add_cars(scene, rng, carriageway)
    roadside.add_backdrop(scene, rng, carriageway)


def _verge(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a country road between grass slopes that are wider than the road."""
    _lay_road(scene, carriageway)
    grass = roadside.add_grass(scene, rng)
    for side, edge in carriageway.sides:
        level = carriageway.section.elevation(edge)
        slope = float(rng.choice([-1.0, 1.0])) * draw(rng, 0.03, 0.3)
        width = (carriageway.right - carriageway.left) * draw(rng, 1.2, 3)
        foot = edge + side * width
        roadside.add_slope(scene, carriageway, side, edge, foot, level, slope, grass)
        roadside.add_slope(scene, carriageway, side, foot, side * np.inf, level + slope * width, 0.0, grass)
        roadside.add_posts(
            scene, rng, carriageway, edge + side * 0.6, level + 0.6 * slope, radius=0.05, height=1.0
        )
        if slope < 0.1:
            roadside.add_trees(scene, rng, carriageway, foot, foot + side * 30, level + slope * width)
    roadside.add_cars(scene, rng, carriageway)
    roadside.add_backdrop(scene, rng, carriageway)


def _lay_road(scene: Scene, carriageway: Carriageway) -> None:
    scene.surfaces += _grounds(carriageway, _road_strips(scene, carriageway), FAR)


def _road_strips(scene: Scene, carriageway: Carriageway) -> list[tuple[Piece, int]]:
    return [(piece, scene.road) for piece in carriageway.section.pieces]


def _grounds(carriageway: Carriageway, strips: list[tuple[Piece, int]], far: float) -> Iterator[Ground]:
    """Make the ground of pieces side by side with their materials; join pieces of one parabola."""
    for (slope, camber, offset), group in groupby(strips, key=lambda strip: strip[0][2:]):
        pieces, materials = zip(*group, strict=True)
        edges = (*(piece.start for piece in pieces), pieces[-1].end)
        yield Ground(carriageway.course, edges, materials, far, slope, offset, camber, carriageway.relief)


_KINDS = {"bare": _bare, "open": _open, "street": _street, "verge": _verge}


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
    scene, rng = build_scene(spec), spec.rng(Stream.SENSOR)
    cameras = spec.cameras(scene.normal)
    views = [render_view(scene, camera) for camera in cameras]
    left, right = (
        expose(view.light, spec.noise, gain, spec.colour, rng)
        for view, gain in zip(views, (1.0, spec.gain), strict=True)
    )
    disparity = (spec.focal * spec.baseline / views[0].depth).astype(np.float32)
    heights = None
    if spec.dips is not None:
        heights = true_heights(scene, spec, carriageway_of(spec), cameras[0])
    return RenderedFrame(left, right, disparity, views[0].material == scene.road, spec, heights)


def true_disparity(spec: FrameSpec) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the disparity (H, W) of the left view in double precision, 0 in the sky, and its road pixels."""
    scene = build_scene(spec)
    depth, material = depths(scene, spec.cameras(scene.normal)[0])
    return spec.focal * spec.baseline / depth, material == scene.road
