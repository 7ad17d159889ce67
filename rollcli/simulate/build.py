"""Build the scenes, each drawn from the seeds of a frame, and render their two views and true disparity."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.materials import Values
from rollcli.simulate.relief import FAR_ENDS, LEVEL, Dip
from rollcli.simulate.road import Carriageway, Piece, Site, cross_section, draw_asphalt, draw_carriageway
from rollcli.simulate.scene import FAR, Light, Scene, draw_light
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Ground, Surface
from rollcli.simulate.views import Camera, View, expose, render_view

_HORIZON = 2000.0  # metres: the end of a bare world
# of dips and bumps
_DEPTH = (0.025, 0.07)  # metres, of dips as of bumps
_RADIUS = (0.25, 0.5)  # metres
_AHEAD = (4.5, 12.0)  # metres
_TRIES = 50  # for a place beside those that are there


def build_scene(spec: FrameSpec) -> Scene:
    """Build the scene of a frame: the same for the same kind of scene, road and seeds."""
    rng, light, carriageway = _begin(spec)
    scene = Scene(light, normal=carriageway.normal)
    scene.road = scene.material(draw_asphalt(rng, carriageway))
    site = Site(scene, rng, carriageway)
    beside = site.add_yard() if spec.scene == "street" else site.add_grass()
    if spec.scene == "bare":
        _lay_road(site, _HORIZON, beside)
    else:
        _lay_road(site, FAR)
        for side, edge in ((-1, carriageway.left), (1, carriageway.right)):
            _ROADSIDES[spec.scene](site, side, edge, beside)
        site.add_cars()
        site.add_backdrop()
    dips = draw_dips(spec, carriageway)
    scene.surfaces = [_dipped(surface, dips) for surface in scene.surfaces]
    return scene


def road_camber(spec: FrameSpec) -> float:
    """Return the curvature across the road below the rig, 1/(camera height); a crown is negative."""
    below = carriageway_of(spec).section.piece(0.0)
    return float(below.camber / math.hypot(1.0, below.slope) ** 3) * spec.height


@lru_cache(maxsize=1)  # each column of the truth asks for it, and uneven ground takes 0.1 s
def carriageway_of(spec: FrameSpec) -> Carriageway:
    """Draw the carriageway of a frame, without the rest of its scene."""
    return _begin(spec)[2]


def _begin(spec: FrameSpec) -> tuple[np.random.Generator, Light, Carriageway]:
    """Draw the light and the carriageway; return them with the generator for the rest of the scene."""
    rng = spec.rng(Stream.SCENE)
    return rng, draw_light(rng), draw_carriageway(rng, spec)


def _open(site: Site, side: int, edge: float, grass: int) -> None:
    """Add a kerb, a sidewalk, a lawn and trees on one side of the road."""
    level, outer = site.add_sidewalk(side, edge)
    site.add_slope(outer, side * np.inf, level, site.draw(-0.04, 0.06), grass)
    if site.rng.random() < 0.3:
        site.add_hedge(outer + side * site.draw(0.2, 1.0), level - 0.1)
    site.add_posts(outer - side * 0.3, level)
    site.add_trees(outer, outer + side * 25, level - 0.4)


def _street(site: Site, side: int, edge: float, yard: int) -> None:
    """Add a kerb, a sidewalk and house fronts on one side of the road."""
    level, outer = site.add_sidewalk(side, edge, beyond=yard)
    garden = float(site.rng.choice([0.0, 1.0])) * site.draw(1, 6)
    site.add_houses(side, outer + side * garden, level)
    site.add_posts(edge + side * 0.5, level)
    if site.rng.random() < 0.35:
        site.add_trees(edge + side * 0.8, edge + side * 0.9, level)


def _verge(site: Site, side: int, edge: float, grass: int) -> None:
    """Add a grass slope that is wider than the road on one side of it."""
    level = site.road.section.elevation(edge)
    slope = float(site.rng.choice([-1.0, 1.0])) * site.draw(0.03, 0.3)
    width = (site.road.right - site.road.left) * site.draw(1.2, 3)
    foot = edge + side * width
    site.add_slope(edge, foot, level, slope, grass)
    site.add_slope(foot, side * np.inf, level + slope * width, 0.0, grass)
    site.add_posts(edge + side * 0.6, level + 0.6 * slope, radius=0.05, height=1.0)
    if slope < 0.1:
        site.add_trees(foot, foot + side * 30, level + slope * width)


def _lay_road(site: Site, far: float, beside: int | None = None) -> None:
    """Add the ground of the road up to `far` ahead; and level ground of a material beside it."""
    road, elevation = site.road, site.road.section.elevation
    strips = [(piece, site.scene.road) for piece in road.section.pieces]
    if beside is not None:
        left = Piece(-np.inf, road.left, offset=elevation(road.left))
        right = Piece(road.right, np.inf, offset=elevation(road.right))
        strips = [(left, beside), *strips, (right, beside)]
    # pieces of one parabola are one ground
    for (slope, camber, offset), group in groupby(strips, key=lambda strip: strip[0][2:]):
        pieces, materials = zip(*group, strict=True)
        edges = (*(piece.start for piece in pieces), pieces[-1].end)
        ground = Ground(road.course, edges, materials, far, slope, offset, camber, road.relief)
        site.scene.surfaces.append(ground)


_ROADSIDES = {"open": _open, "street": _street, "verge": _verge}


def draw_dips(spec: FrameSpec, carriageway: Carriageway) -> tuple[Dip, ...]:
    """Draw the dips and bumps of a frame: apart from each other, and each within one piece of the road.

    Those for which there is no room are left out.
    """
    rng = spec.rng(Stream.DIPS)
    found: list[Dip] = []
    for _ in range(spec.dips or 0):
        for _ in range(_TRIES):
            across, along = rng.uniform(*_RADIUS), rng.uniform(*_RADIUS)
            height = rng.uniform(*_DEPTH) * float(rng.choice([-1.0, 1.0]))
            middle = carriageway.shift + carriageway.lane * rng.uniform(-0.5, 0.5)
            dip = Dip(middle, rng.uniform(*_AHEAD), across, along, height)
            if _fits(dip, found, carriageway):
                found.append(dip)
                break
    return tuple(found)


def _fits(dip: Dip, others: Sequence[Dip], carriageway: Carriageway) -> bool:
    ends = (dip.lateral - 1.3 * dip.across, dip.lateral + 1.3 * dip.across)
    section = carriageway.section
    one_piece = section.piece(ends[0]) == section.piece(ends[1])
    inside = section.pieces[0].start < ends[0] and ends[1] < section.pieces[-1].end
    apart = all(
        abs(dip.lateral - each.lateral) > 1.2 * (dip.across + each.across)
        or abs(dip.z - each.z) > dip.along + each.along + 1.0
        for each in others
    )
    return one_piece and inside and apart


def _dipped(surface: Surface, dips: Sequence[Dip]) -> Surface:
    if not isinstance(surface, Ground):
        return surface
    mine = tuple(dip for dip in dips if surface.edges[0] <= dip.lateral < surface.edges[-1])
    return replace(surface, relief=replace(surface.relief or LEVEL, dips=mine)) if mine else surface


def true_heights(scene: Scene, spec: FrameSpec, camera: Camera, view: View) -> Values:
    """Return how high the ground in a camera's view lies over the road, metres, (H, W); NaN for the rest.

    The road is the carriageway without dips, bumps and gutters, which goes on beyond its edges as it is at
    them. A rough road is what fits its lane ahead, and farther on parallel to a smooth one.
    """
    carriageway, smooth = carriageway_of(spec), replace(spec, gutter=0.0)
    section = cross_section(smooth, carriageway.left, carriageway.right, carriageway.course.bend)
    seen = np.array([isinstance(each, Ground) for each in scene.surfaces] + [False])[view.surface]
    v, u = np.nonzero(seen)
    rays, course = camera.rays(u, v), carriageway.course
    points = rays.origin + view.depth[seen] * rays.direction
    lateral = course.lateral(points)
    piece = section.piece(lateral)
    normal = -piece.slope_at(lateral) * course.across(points[2])
    normal[1] += 1.0
    normal[2] -= course.curvature * points[2]
    _, right, ahead, bend = carriageway.fit_ahead
    near = np.minimum(points[2], FAR_ENDS[-1])
    road = piece.elevation(lateral) + right * lateral + (ahead + bend * near) * near
    heights = np.full(seen.shape, np.nan, np.float32)
    heights[seen] = (course.elevation(points) - road) / np.linalg.norm(normal, axis=0)
    return heights


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
    heights : numpy.ndarray or None
        float32 (H, W), metres: how high the ground in the left view lies over the road without dips and
        bumps; NaN where it shows no ground. None unless the spec has a number of dips.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    disparity: Values
    road: NDArray[np.bool_]
    heights: Values | None = None


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
    heights = None if spec.dips is None else true_heights(scene, spec, cameras[0], views[0])
    return RenderedFrame(left, right, disparity, views[0].material == scene.road, heights)
