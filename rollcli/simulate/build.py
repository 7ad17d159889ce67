"""The kinds of scenes, each drawn from a frame's seeds."""

import numpy as np

from rollcli.simulate.light import draw_light
from rollcli.simulate.materials import Plain
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
from rollcli.simulate.scene import FAR, Scene, draw, draw_offset
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Ground
from rollcli.simulate.way import Way, draw_asphalt, draw_way

_HORIZON = 2000.0  # metres: the end of a bare world


def build_scene(spec: FrameSpec) -> Scene:
    """The scene of a frame: the same for the same scene name, curvature and seeds."""
    rng = spec.scene_rng()
    scene, way = Scene(draw_light(rng)), draw_way(rng, spec)
    scene.road = scene.material(draw_asphalt(rng, way))
    _KINDS[spec.scene](scene, rng, way)
    return scene


def _bare(scene: Scene, rng: np.random.Generator, way: Way) -> None:
    """The road, and grass level with it, to the horizon."""
    grass = add_grass(scene, rng)
    edges = (-np.inf, way.left, way.right, np.inf)
    scene.surfaces.append(Ground(way.course, edges, (grass, scene.road, grass), _HORIZON))


def _open(scene: Scene, rng: np.random.Generator, way: Way) -> None:
    """Kerbs, sidewalks, lawns, trees, cars."""
    _lay_road(scene, way)
    grass = add_grass(scene, rng)
    for side, edge in way.sides:
        height, outer = add_sidewalk(scene, rng, way, side, edge)
        add_slope(scene, way, side, outer, side * np.inf, height, draw(rng, -0.04, 0.06), grass)
        if rng.random() < 0.3:
            add_hedge(scene, rng, way, outer + side * draw(rng, 0.2, 1.0), height - 0.1)
        add_posts(scene, rng, way, outer - side * 0.3, height)
        add_trees(scene, rng, way, outer, outer + side * 25, height - 0.4)
    add_cars(scene, rng, way)
    add_backdrop(scene, rng, way)


def _street(scene: Scene, rng: np.random.Generator, way: Way) -> None:
    """A street between house fronts."""
    _lay_road(scene, way)
    yard = scene.material(Plain(0.3, tint=(0.9, 0.97, 1.0), offset=draw_offset(rng)))
    for side, edge in way.sides:
        height, outer = add_sidewalk(scene, rng, way, side, edge, beyond=yard)
        garden = float(rng.choice([0.0, 1.0])) * draw(rng, 1, 6)
        add_houses(scene, rng, way.course, side, outer + side * garden, height)
        add_posts(scene, rng, way, edge + side * 0.5, height)
        if rng.random() < 0.35:
            add_trees(scene, rng, way, edge + side * 0.8, edge + side * 0.9, height)
    add_cars(scene, rng, way)
    add_backdrop(scene, rng, way)


def _verge(scene: Scene, rng: np.random.Generator, way: Way) -> None:
    """A country road between grass slopes that are wider than it is."""
    _lay_road(scene, way)
    grass = add_grass(scene, rng)
    for side, edge in way.sides:
        slope = float(rng.choice([-1.0, 1.0])) * draw(rng, 0.03, 0.3)
        width = (way.right - way.left) * draw(rng, 1.2, 3)
        foot = edge + side * width
        add_slope(scene, way, side, edge, foot, 0.0, slope, grass)
        add_slope(scene, way, side, foot, side * np.inf, slope * width, 0.0, grass)
        add_posts(scene, rng, way, edge + side * 0.6, 0.6 * slope, radius=0.05, height=1.0)
        if slope < 0.1:
            add_trees(scene, rng, way, foot, foot + side * 30, slope * width)
    add_cars(scene, rng, way)
    add_backdrop(scene, rng, way)


def _lay_road(scene: Scene, way: Way) -> None:
    scene.surfaces.append(Ground(way.course, (way.left, way.right), (scene.road,), FAR))


_KINDS = {"bare": _bare, "open": _open, "street": _street, "verge": _verge}
