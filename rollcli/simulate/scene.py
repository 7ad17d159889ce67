"""A random road and what stands beside it, drawn from a frame's seeds."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.camera import Array
from rollcli.simulate.cars import car
from rollcli.simulate.materials import Asphalt, Facade, Leaves, Mark, Material, Patch, Paving, Plain
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Backdrop, Course, Ground, Post, Surface, Wall

FAR = 180.0  # metres: where the road ends before a backdrop of trees
BARE_FAR = 2000.0
_GRASS = (0.45, 1.0, 0.72)


@dataclass(frozen=True)
class Scene:
    """Surfaces in the world, the light on them, and which of them are the road.

    `sun` is a unit vector toward the light, `ambient` the share of light that comes from everywhere.
    """

    surfaces: tuple[Surface, ...]
    road: frozenset[int]
    sun: Array
    ambient: float
    exposure: float
    sky_offset: float


def build_scene(spec: FrameSpec) -> Scene:
    """The scene of a frame: the same for the same scene name, curvature and seeds."""
    rng = spec.scene_rng()
    elevation, azimuth = rng.uniform(0.5, 1.2), rng.uniform(-np.pi, np.pi)
    sun = np.array(
        [np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)]
    )
    layout = _Layout.draw(rng, spec)
    surfaces = _BUILDERS[spec.scene](rng, layout)
    return Scene(
        tuple(surfaces),
        frozenset(i for i, s in enumerate(surfaces) if s.material is layout.road.material),
        sun,
        ambient=float(rng.uniform(0.45, 0.75)),
        exposure=float(rng.uniform(0.85, 1.15)),
        sky_offset=float(rng.uniform(0, 1000)),
    )


@dataclass(frozen=True)
class _Layout:
    """The road itself: its course, its edges, its lanes and its surface."""

    course: Course
    left: float
    right: float
    lane: float
    parking: bool
    road: Ground

    @staticmethod
    def draw(rng: np.random.Generator, spec: FrameSpec) -> "_Layout":
        bend = float(rng.choice([0.0, 1.0]) * rng.uniform(-1 / 250, 1 / 250))
        heading = float(rng.normal(0, 0.015))
        bare = spec.scene == "bare"
        course = Course(heading, 0.0 if bare else bend, spec.curvature)
        lane = float(rng.uniform(2.8, 3.7))
        parking = bool(rng.random() < 0.4)
        shift = float(rng.normal(0, 0.25))
        left = -1.5 * lane - (2.2 if parking else 0.3) + shift
        right = 0.5 * lane + (2.2 if parking else 0.3) + shift
        surface = _asphalt(rng, lane, shift, left, right)
        road = Ground(course, left, right, 0.0, 0.0, BARE_FAR if bare else FAR, surface)
        return _Layout(course, left, right, lane, parking, road)


def _asphalt(rng: np.random.Generator, lane: float, shift: float, left: float, right: float) -> Asphalt:
    centre, edge_l, edge_r = shift - lane / 2, shift - 1.5 * lane, shift + lane / 2
    marks = [Mark(centre, 0.13, 12.0, 6.0) if rng.random() < 0.8 else Mark(centre, 0.13)]
    if rng.random() < 0.6:
        marks += [Mark(edge_l, 0.12), Mark(edge_r, 0.12)]
    patches = []
    for _ in range(rng.integers(1, 6)):
        x, z = rng.uniform(left, right), rng.uniform(3, 40)
        wide, long = rng.uniform(0.5, 2.0), rng.uniform(0.8, 6.0)
        patches.append(Patch(x, x + wide, z, z + long, float(rng.uniform(-0.35, 0.2))))
    return Asphalt(
        float(rng.uniform(0.16, 0.30)),
        tracks=tuple(shift + x * lane for x in (-1.27, -0.73, -0.27, 0.27)),
        marks=tuple(marks),
        patches=tuple(patches),
        seams=tuple(rng.uniform(left, right, rng.integers(1, 4))),
        offset=float(rng.uniform(0, 1000)),
    )


def _bare(rng: np.random.Generator, at: _Layout) -> list[Surface]:
    """One plane, or one profile, to the horizon: the road, and grass level with it."""
    grass = _grass(rng)
    return [
        at.road,
        Ground(at.course, -np.inf, at.left, 0.0, 0.0, BARE_FAR, grass),
        Ground(at.course, at.right, np.inf, 0.0, 0.0, BARE_FAR, grass),
    ]


def _open(rng: np.random.Generator, at: _Layout) -> list[Surface]:
    """Kerbs, sidewalks, lawns, cars, posts; nothing tall."""
    grass = _grass(rng)
    surfaces: list[Surface] = [at.road]
    for side, edge in ((-1, at.left), (1, at.right)):
        height, outer = _sidewalk(rng, at, side, edge, surfaces)
        surfaces.append(_slope(at.course, side, outer, np.inf, height, rng.uniform(-0.04, 0.06), grass))
        surfaces += _posts(rng, at, outer - side * 0.3, height)
    surfaces += _cars(rng, at)
    surfaces.append(_backdrop(rng, at))
    return surfaces


def _street(rng: np.random.Generator, at: _Layout) -> list[Surface]:
    """A street between house fronts."""
    yard = Plain(0.3, tint=(0.9, 0.97, 1.0), offset=float(rng.uniform(0, 1000)))
    surfaces: list[Surface] = [at.road]
    for side, edge in ((-1, at.left), (1, at.right)):
        height, outer = _sidewalk(rng, at, side, edge, surfaces)
        front = outer + side * rng.choice([0.0, rng.uniform(1, 6)])
        surfaces.append(_slope(at.course, side, outer, np.inf, height, 0.0, yard))
        surfaces.append(_houses(rng, at.course, front, height))
        surfaces += _posts(rng, at, edge + side * 0.5, height)
    surfaces += _cars(rng, at)
    surfaces.append(_backdrop(rng, at))
    return surfaces


def _verge(rng: np.random.Generator, at: _Layout) -> list[Surface]:
    """A country road between grass slopes that are wider than it is."""
    grass = _grass(rng)
    surfaces: list[Surface] = [at.road]
    width = at.right - at.left
    for side, edge in ((-1, at.left), (1, at.right)):
        slope = float(rng.choice([-1, 1]) * rng.uniform(0.03, 0.3))
        foot = edge + side * width * rng.uniform(1.2, 3)
        surfaces.append(_slope(at.course, side, edge, foot, 0.0, slope, grass))
        level = slope * abs(foot - edge)
        surfaces.append(_slope(at.course, side, foot, np.inf, level, 0.0, grass))
        surfaces += _posts(rng, at, edge + side * 0.6, 0.6 * slope, post=(0.05, 1.0))
    surfaces += _cars(rng, at)
    surfaces.append(_backdrop(rng, at))
    return surfaces


_BUILDERS = {"bare": _bare, "open": _open, "street": _street, "verge": _verge}


def _grass(rng: np.random.Generator) -> Material:
    return Plain(float(rng.uniform(0.14, 0.24)), 0.22, 0.22, _GRASS, float(rng.uniform(0, 1000)))


def _slope(
    course: Course, side: int, start: float, end: float, level: float, slope: float, material: Material
) -> Ground:
    """Ground from `start` outward to `end`, at `level` where it starts; a `slope` > 0 rises outward."""
    left, right = (start, end) if side > 0 else (side * abs(end), start)
    signed = side * slope
    return Ground(course, left, right, signed, level - signed * start, FAR, material)


def _sidewalk(
    rng: np.random.Generator, at: _Layout, side: int, edge: float, surfaces: list[Surface]
) -> tuple[float, float]:
    """Kerb and sidewalk beside the road; returns the height of the sidewalk and where it ends."""
    height, width = float(rng.uniform(0.10, 0.20)), float(rng.uniform(1.5, 3.5))
    stone = Plain(float(rng.uniform(0.35, 0.5)), offset=float(rng.uniform(0, 1000)))
    paving = Paving(
        float(rng.uniform(0.3, 0.45)), float(rng.uniform(0.3, 0.6)), offset=float(rng.uniform(0, 1000))
    )
    top, outer = edge + side * 0.15, edge + side * width
    whole = np.array([-50.0, FAR])
    surfaces.append(Wall(at.course, edge, 0.0, whole, np.array([height]), stone))
    surfaces.append(_slope(at.course, side, edge, top, height, 0.0, stone))
    surfaces.append(_slope(at.course, side, top, outer, height, 0.0, paving))
    return height, outer


def _houses(rng: np.random.Generator, course: Course, front: float, base: float) -> Wall:
    widths = rng.uniform(7, 18, 30)
    edges = -30 + np.concatenate([[0.0], np.cumsum(widths)])
    storeys = rng.uniform(2.8, 3.4, 30)
    tops = base + storeys * rng.integers(2, 5, 30) + rng.uniform(0.3, 1.2, 30)
    look = Facade(
        edges.astype(np.float32),
        rng.uniform(0.25, 0.7, 30).astype(np.float32),
        storeys.astype(np.float32),
        rng.uniform(2.2, 3.6, 30).astype(np.float32),
        offset=float(rng.uniform(0, 1000)),
    )
    return Wall(course, front, base, edges, tops, look)


def _posts(
    rng: np.random.Generator,
    at: _Layout,
    lateral: float,
    level: float,
    post: tuple[float, float] = (0.07, 6.0),
) -> list[Surface]:
    metal = Plain(float(rng.uniform(0.2, 0.6)), 0.05, 0.05)
    gap = rng.uniform(18, 35)
    return [
        Post(at.course.point(lateral, z, level), post[0], post[1], metal)
        for z in np.arange(rng.uniform(6, gap), 110, gap)
    ]


def _cars(rng: np.random.Generator, at: _Layout) -> list[Surface]:
    """One ahead, one oncoming, and parked ones, each there or not."""
    places: list[tuple[float, float]] = []
    if rng.random() < 0.5:
        places.append((rng.normal(0, 0.2), rng.uniform(9, 45)))
    if rng.random() < 0.5:
        places.append((-at.lane + rng.normal(0, 0.2), rng.uniform(12, 60)))
    if at.parking:
        for edge in (at.left + 1.15, at.right - 1.15):
            z = rng.uniform(6, 12)
            while z < 80:
                if rng.random() < 0.6:
                    places.append((edge + rng.normal(0, 0.05), z))
                z += rng.uniform(5.5, 7.5)
    parts: list[Surface] = []
    for lateral, z in places:
        parts += car(rng, at.course, float(lateral), float(z))
    return parts


def _backdrop(rng: np.random.Generator, at: _Layout) -> Backdrop:
    leaves = Leaves(float(rng.uniform(0.10, 0.2)), scale=0.15, offset=float(rng.uniform(0, 1000)))
    steps = rng.normal(0, 1.2, 400)
    skyline = 9 + np.convolve(steps, np.ones(9) / 3, mode="same") + rng.uniform(-1, 1, 400)
    return Backdrop(at.course, FAR, -30.0, skyline, leaves)
