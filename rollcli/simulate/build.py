"""Build the scenes, each drawn from the seeds of a frame."""

from collections.abc import Iterator
from itertools import groupby

import numpy as np

from rollcli.simulate.dips import add_dips
from rollcli.simulate.materials import Plain
from rollcli.simulate.road import Carriageway, Piece, draw_asphalt, draw_carriageway
from rollcli.simulate.roadside import (
    add_backdrop,
    add_cars,
    add_grass,
    add_hedge,
    add_houses,
    add_posts,
    add_sidewalk,
    add_slope,
    add_trees,
)
from rollcli.simulate.scene import FAR, Light, Scene, draw, draw_light, draw_offset
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Ground

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
    rng = spec.scene_rng()
    return rng, draw_light(rng), draw_carriageway(rng, spec)


def _bare(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add the road, and level grass from its edges to the horizon."""
    grass = add_grass(scene, rng)
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
    grass = add_grass(scene, rng)
    for side, edge in carriageway.sides:
        level, outer = add_sidewalk(scene, rng, carriageway, side, edge)
        add_slope(scene, carriageway, side, outer, side * np.inf, level, draw(rng, -0.04, 0.06), grass)
        if rng.random() < 0.3:
            add_hedge(scene, rng, carriageway, outer + side * draw(rng, 0.2, 1.0), level - 0.1)
        add_posts(scene, rng, carriageway, outer - side * 0.3, level)
        add_trees(scene, rng, carriageway, outer, outer + side * 25, level - 0.4)
    add_cars(scene, rng, carriageway)
    add_backdrop(scene, rng, carriageway)


def _street(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a street between house fronts."""
    _lay_road(scene, carriageway)
    yard = scene.material(Plain(0.3, tint=(0.9, 0.97, 1.0), offset=draw_offset(rng)))
    for side, edge in carriageway.sides:
        level, outer = add_sidewalk(scene, rng, carriageway, side, edge, beyond=yard)
        garden = float(rng.choice([0.0, 1.0])) * draw(rng, 1, 6)
        add_houses(scene, rng, carriageway.course, side, outer + side * garden, level)
        add_posts(scene, rng, carriageway, edge + side * 0.5, level)
        if rng.random() < 0.35:
            add_trees(scene, rng, carriageway, edge + side * 0.8, edge + side * 0.9, level)
    add_cars(scene, rng, carriageway)
    add_backdrop(scene, rng, carriageway)


def _verge(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a country road between grass slopes that are wider than the road."""
    _lay_road(scene, carriageway)
    grass = add_grass(scene, rng)
    for side, edge in carriageway.sides:
        level = carriageway.section.elevation(edge)
        slope = float(rng.choice([-1.0, 1.0])) * draw(rng, 0.03, 0.3)
        width = (carriageway.right - carriageway.left) * draw(rng, 1.2, 3)
        foot = edge + side * width
        add_slope(scene, carriageway, side, edge, foot, level, slope, grass)
        add_slope(scene, carriageway, side, foot, side * np.inf, level + slope * width, 0.0, grass)
        add_posts(scene, rng, carriageway, edge + side * 0.6, level + 0.6 * slope, radius=0.05, height=1.0)
        if slope < 0.1:
            add_trees(scene, rng, carriageway, foot, foot + side * 30, level + slope * width)
    add_cars(scene, rng, carriageway)
    add_backdrop(scene, rng, carriageway)


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
