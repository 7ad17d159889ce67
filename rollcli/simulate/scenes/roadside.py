"""Objects beside a road and on it. Each function draws its objects and adds them to the scene.

`side` is -1 on the left and 1 on the right; lateral positions and elevations are metres in road coordinates.
"""

import numpy as np

from rollcli.simulate.geometry.solids import Post, Solid, TreeCrown
from rollcli.simulate.geometry.surfaces import Backdrop, Course, Ground, Wall
from rollcli.simulate.looks.facade import Facade
from rollcli.simulate.looks.materials import WARM, Leaves, Paving, Plain, Tint
from rollcli.simulate.scenes.carriageway import Carriageway
from rollcli.simulate.scenes.cars import box, car_materials, vehicle
from rollcli.simulate.scenes.scene import FAR, Scene, draw, draw_offset

_GRASS: Tint = (0.45, 1.0, 0.72)
_FOREST: Tint = (0.55, 1.0, 0.75)


def add_grass(scene: Scene, rng: np.random.Generator) -> int:
    """Add the material of lawns and verges; return its index."""
    look = Leaves(draw(rng, 0.14, 0.24), draw(rng, 0.15, 0.3), tint=_GRASS, offset=draw_offset(rng))
    return scene.material(look)


def add_slope(
    scene: Scene,
    carriageway: Carriageway,
    side: int,
    start: float,
    end: float,
    level: float,
    slope: float,
    material: int,
) -> None:
    """Add ground from `start` outward to `end`, which starts at elevation `level` with an outward `slope`."""
    signed = side * slope
    edges = (start, end) if side > 0 else (end, start)
    scene.surfaces.append(Ground(carriageway.course, edges, (material,), FAR, signed, level - signed * start))


def add_sidewalk(
    scene: Scene,
    rng: np.random.Generator,
    carriageway: Carriageway,
    side: int,
    edge: float,
    beyond: int | None = None,
) -> tuple[float, float]:
    """Add a kerb, a sidewalk and, of the material `beyond`, level ground behind it.

    Returns the sidewalk's elevation and the lateral position of its outer edge.
    """
    height, width = draw(rng, *carriageway.kerb), draw(rng, 1.5, 3.5)
    base = carriageway.section.elevation(edge)
    level = base + height
    stone = scene.material(Plain(draw(rng, 0.35, 0.5), joint=1.0, offset=draw_offset(rng)))
    look = Paving(draw(rng, 0.28, 0.42), draw(rng, 0.3, 0.6), tint=WARM, offset=draw_offset(rng))
    ends = [edge, edge + side * 0.15, edge + side * width]
    materials = [stone, scene.material(look)]
    if beyond is not None:
        ends.append(side * np.inf)
        materials.append(beyond)
    kerb = Wall(carriageway.course, edge, base, np.array([-50.0, FAR]), np.array([level]), stone)
    strips = Ground(carriageway.course, tuple(ends[::side]), tuple(materials[::side]), FAR, offset=level)
    scene.surfaces += [kerb, strips]
    return level, edge + side * width


def add_houses(
    scene: Scene, rng: np.random.Generator, course: Course, side: int, front: float, base: float
) -> None:
    """Add a row of house fronts with gaps, and the bodies of the houses behind them."""
    n = 24
    widths, storeys = rng.uniform(7, 16, n), rng.uniform(2.8, 3.4, n)
    edges = -20 + np.concatenate([[0.0], np.cumsum(widths)])
    heights = storeys * rng.integers(2, 5, n) + rng.uniform(0.3, 0.8, n)
    heights[rng.random(n) < 0.1] = 0.0
    levels, bays = rng.uniform(0.25, 0.65, n), rng.uniform(2.2, 3.6, n)
    tints = np.stack([rng.uniform(0.6, 1.0, n), rng.uniform(0.85, 1.0, n), np.ones(n)], axis=1)
    looks = (x.astype(np.float32) for x in (edges, levels, tints, storeys, bays))
    look = Facade(draw_offset(rng), *looks)
    scene.surfaces.append(Wall(course, front, base, edges, base + heights, scene.material(look)))
    before = np.concatenate([[0.0], heights[:-1]])
    # the only part of a body that is visible from the street is the gable above the house before it
    for i in np.flatnonzero((heights > before + 0.3) & (edges[:-1] > 3) & (edges[:-1] < 120)):
        tint = tuple(float(x) for x in tints[i])
        plaster = scene.material(Plain(float(0.9 * levels[i]), tint=(tint[0], tint[1], tint[2])))
        height, half, depth = float(heights[i]), float(widths[i] / 2), 5.0
        extent = np.array([[-depth, depth], [0.0, height], [-half, half]])
        middle = float(edges[i] + half)
        # set back: the body is straight, and must stay behind a front that follows the bend
        place = course.point(front + side * (depth + 0.25), middle, base)
        body = box(depth, height, half, plaster)
        scene.surfaces.append(Solid(course.frame(middle), place, (body,), extent))


def add_hedge(
    scene: Scene, rng: np.random.Generator, carriageway: Carriageway, lateral: float, base: float
) -> None:
    """Add a clipped hedge along the road."""
    tint = (0.42, 1.0, 0.62)
    material = scene.material(Leaves(draw(rng, 0.08, 0.16), 0.4, tint=tint, offset=draw_offset(rng)))
    edges = np.arange(-20.0, 120.0, 1.0, dtype=np.float64)
    tops = base + draw(rng, 0.9, 1.8) + rng.uniform(-0.08, 0.08, len(edges) - 1)
    scene.surfaces.append(Wall(carriageway.course, lateral, base, edges, tops, material))


def add_posts(
    scene: Scene,
    rng: np.random.Generator,
    carriageway: Carriageway,
    lateral: float,
    level: float,
    radius: float = 0.07,
    height: float = 6.0,
) -> None:
    """Add lamp posts or delineators, evenly spaced."""
    metal = scene.material(Plain(draw(rng, 0.2, 0.6), 0.05, 0.05))
    gap = draw(rng, 18, 35)
    for z in np.arange(draw(rng, 6, gap), 90, gap):
        scene.surfaces.append(Post(carriageway.course.point(lateral, float(z), level), radius, height, metal))


def add_trees(
    scene: Scene, rng: np.random.Generator, carriageway: Carriageway, near: float, outer: float, level: float
) -> None:
    """Add trees between two lateral positions, each a trunk and two crowns that overlap."""
    bark = scene.material(Plain(0.12, 0.3, 0.2, tint=(0.75, 0.9, 1.0)))
    tint = (0.42, 1.0, draw(rng, 0.55, 0.8))
    leaves = scene.material(Leaves(draw(rng, 0.10, 0.2), 0.4, tint=tint, offset=draw_offset(rng)))
    z = draw(rng, 10, 25)
    while z < 90:
        lateral = near + (outer - near) * float(rng.random())
        stem, radius = draw(rng, 2.2, 3.2), draw(rng, 1.2, 2.2)
        half = radius * draw(rng, 0.9, 1.4)
        foot, top = (carriageway.course.point(lateral, z, level + rise) for rise in (0.0, stem + half))
        lower = top + np.array([draw(rng, -0.8, 0.8), -0.3 * half, draw(rng, -0.8, 0.8)])
        scene.surfaces += [
            Post(foot, draw(rng, 0.1, 0.2), stem + half, bark),
            TreeCrown(top, radius, half, leaves),
            TreeCrown(lower, 1.1 * radius, 0.6 * half, leaves),
        ]
        z += draw(rng, 7, 25)


def add_cars(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add vehicles: one ahead, one oncoming and parked ones, each with a probability."""
    places: list[tuple[float, float]] = []
    if rng.random() < 0.5:
        places.append((carriageway.shift + rng.normal(0, 0.2), rng.uniform(9, 40)))
    if rng.random() < 0.5 and not carriageway.single:
        places.append((carriageway.shift - carriageway.lane + rng.normal(0, 0.2), rng.uniform(9, 60)))
    if carriageway.parking:
        for edge in (carriageway.left + 1.15, carriageway.right - 1.15):
            z = rng.uniform(6, 12)
            while z < 70:
                if rng.random() < 0.6:
                    places.append((edge + rng.normal(0, 0.05), z))
                z += rng.uniform(8.2, 10)
    first, middle = len(scene.materials), carriageway.shift - carriageway.lane / 2
    scene.materials += car_materials(draw_offset(rng))
    course, section = carriageway.course, carriageway.section
    scene.cars += [
        vehicle(rng, course, section.piece(x), float(x), float(z), first, x < middle) for x, z in places
    ]
    scene.surfaces += scene.cars


def add_backdrop(scene: Scene, rng: np.random.Generator, carriageway: Carriageway) -> None:
    """Add a line of trees where the ground ends."""
    look = Leaves(draw(rng, 0.10, 0.2), scale=0.15, tint=_FOREST, offset=draw_offset(rng))
    steps = rng.normal(0, 1.2, 400)
    skyline = 9 + np.convolve(steps, np.ones(9) / 3, mode="same") + rng.uniform(-1, 1, 400)
    scene.surfaces.append(Backdrop(carriageway.course, FAR, -30.0, skyline, scene.material(look)))
