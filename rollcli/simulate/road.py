"""The carriageway, with its course, cross-section and surface, and the objects beside it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rollcli.simulate.materials import WARM, Asphalt, Facade, Leaves, Mark, Patch, Paving, Plain, Tint
from rollcli.simulate.options import GUTTER_WIDTH
from rollcli.simulate.relief import Array, Relief, draw_relief, lane_parabola
from rollcli.simulate.scene import FAR, Post, Scene, Solid, TreeCrown, draw_offset
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Backdrop, Course, Ground, Wall
from rollcli.simulate.vehicles import Shape, car_materials, extruded, rectangle, vehicle


class Piece(NamedTuple):
    """elevation = offset + slope * lateral + camber / 2 * lateral^2, metres, for laterals in [start, end)."""

    start: float
    end: float
    slope: float = 0.0
    camber: float = 0.0
    offset: float = 0.0

    def elevation(self, lateral: Any) -> Any:
        """Return the height at lateral positions, metres."""
        return self.offset + (self.slope + self.camber / 2 * lateral) * lateral

    def slope_at(self, lateral: Any) -> Any:
        """Return the slope at lateral positions; positive where the road rises to the right."""
        return self.slope + self.camber * lateral


@dataclass(frozen=True)
class CrossSection:
    """Pieces from left to right, without steps; the elevation is 0 where lateral is 0."""

    pieces: tuple[Piece, ...]

    def piece(self, lateral: Any) -> Piece:
        """Return the piece at a lateral position, or at each of several; beyond the edges the outermost."""
        at = np.searchsorted([piece.end for piece in self.pieces[:-1]], lateral, side="right")
        return Piece(*np.array(self.pieces).T[:, at])

    def elevation(self, lateral: Any) -> Any:
        """Return the height above the point below the rig, metres; beyond an edge that of the edge."""
        inside = np.clip(lateral, self.pieces[0].start, self.pieces[-1].end)
        return self.piece(inside).elevation(inside)


def cross_section(spec: FrameSpec, left: float, right: float, bend: float) -> CrossSection:
    """Make the cross section of a carriageway.

    Parameters
    ----------
    spec : FrameSpec
        Says its shape, the crossfall, and how much steeper its outer `GUTTER_WIDTH` falls outward.
    left, right : float
        The edges (lateral, metres).
    bend : float
        The road's horizontal curvature, 1/m: superelevation raises the outer side of a bend. A straight
        road falls to the right.
    """
    middle, crossfall = (left + right) / 2, spec.crossfall
    camber = crossfall / ((right - left) / 2)
    rising = Piece(left, middle, crossfall, offset=-2 * crossfall * middle)
    pieces = {
        "flat": [Piece(left, right)],
        "crown": [Piece(left, right, camber * middle, -camber)],
        "roof": [rising, Piece(middle, right, -crossfall)],
        "dish": [Piece(left, right, -camber * middle, camber)],
        "superelevated": [Piece(left, right, crossfall if bend < 0 else -crossfall)],
    }[spec.cross_section]
    if spec.gutter:
        inner, outer = left + GUTTER_WIDTH, right - GUTTER_WIDTH
        pieces = [
            _straight(left, inner, inner, pieces[0], spec.gutter),
            *(piece._replace(start=max(piece.start, inner), end=min(piece.end, outer)) for piece in pieces),
            _straight(outer, right, outer, pieces[-1], -spec.gutter),
        ]
    below_rig = CrossSection(tuple(pieces)).elevation(0.0)
    return CrossSection(tuple(piece._replace(offset=piece.offset - below_rig) for piece in pieces))


def _straight(start: float, end: float, at: float, beside: Piece, steeper: float) -> Piece:
    slope = beside.slope_at(at) + steeper
    return Piece(start, end, slope, offset=beside.elevation(at) - slope * at)


@dataclass(frozen=True)
class Carriageway:
    """One or two lanes between two edges (lateral, metres).

    The rig drives in the right lane, whose middle is at `shift`. `kerb` is the lowest and the highest kerb,
    metres, `relief` its unevenness.
    """

    course: Course
    left: float
    right: float
    lane: float
    shift: float
    single: bool
    parking: bool
    section: CrossSection
    kerb: tuple[float, float]
    relief: Relief | None = None

    @property
    def fit_ahead(self) -> list[float]:
        """What `lane_parabola` fits to the unevenness of the lane ahead, metres; zeros on a smooth road."""
        return [0.0] * 4 if self.relief is None else lane_parabola(self.relief)

    @property
    def curvature_ahead(self) -> float:
        """How the road curves upward straight ahead of the rig, 1/m: in a bend its slope across does, too."""
        across, (_, _, _, uneven) = self.section.piece(0.0).slope, self.fit_ahead
        return self.course.curvature - across * self.course.bend + 2 * uneven

    @property
    def normal(self) -> Array:
        """The upward unit normal (3,) of the plane that touches the road where the rig stands.

        On a rough road: of the parabola that fits the lane ahead, in place of what lies below the wheels.
        """
        _, right, rising, _ = self.fit_ahead
        slope = self.section.piece(0.0).slope + right
        normal = np.array([-slope, 1.0, slope * self.course.heading - rising])
        return np.asarray(normal / np.linalg.norm(normal))


def draw_carriageway(rng: np.random.Generator, spec: FrameSpec) -> Carriageway:
    """Draw a carriageway: half of them bend; country roads can have a single lane, others room to park."""
    bend = float(rng.choice([0.0, 1.0])) * rng.uniform(-1 / 250, 1 / 250)
    heading = float(rng.normal(0, 0.015))
    if spec.bend is not None:
        bend = spec.bend
    elif spec.scene == "bare":
        bend = 0.0
    course = Course(heading, bend, spec.curvature)
    lane, shift = rng.uniform(2.8, 3.7), float(rng.normal(0, 0.25))
    country = spec.scene in ("bare", "verge")
    # the ridge of a roof runs between two lanes
    single = bool(rng.random() < 0.3) and country and spec.cross_section != "roof"
    parking = bool(rng.random() < 0.4) and not country
    shoulder = 2.2 if parking else rng.uniform(0.1, 0.6)
    left = shift - (0.5 if single else 1.5) * lane - shoulder
    right = shift + 0.5 * lane + shoulder
    section = cross_section(spec, left, right, course.bend)
    relief = None
    if spec.roughness is not None:
        wheels = shift - lane / 4, shift + lane / 4
        relief = draw_relief(spec.rng(Stream.ROUGHNESS), spec.roughness, (left, right), wheels)
    return Carriageway(course, left, right, lane, shift, single, parking, section, spec.kerb, relief)


def draw_asphalt(rng: np.random.Generator, carriageway: Carriageway) -> Asphalt:
    """Draw the carriageway's surface: its marks, gutters, mended patches and seams."""
    middle, left, right = (carriageway.shift + x * carriageway.lane for x in (-0.5, -1.5, 0.5))
    marks = []
    if not carriageway.single:
        marks.append(Mark(middle, 0.13, 12.0, 6.0) if rng.random() < 0.8 else Mark(middle, 0.13))
        if rng.random() < 0.6:
            marks += [Mark(left, 0.12), Mark(right, 0.12)]
    gutters = carriageway.left, carriageway.right - GUTTER_WIDTH
    patches = [Patch(start, start + GUTTER_WIDTH, -50, FAR, -0.2) for start in gutters]
    for _ in range(rng.integers(1, 6)):
        x, z = rng.uniform(carriageway.left, carriageway.right), rng.uniform(3, 40)
        wide, long = rng.uniform(0.5, 2.0), rng.uniform(0.8, 6.0)
        patches.append(Patch(x, x + wide, z, z + long, rng.uniform(-0.35, 0.2)))
    level, grain = rng.uniform(0.16, 0.30), rng.uniform(0.04, 0.2)
    seams = [rng.uniform(carriageway.left, carriageway.right) for _ in range(rng.integers(1, 4))]
    wheels = carriageway.shift + 0.25 * carriageway.lane, carriageway.lane / 2
    return Asphalt(level, grain, wheels, marks, patches, seams, offset=draw_offset(rng))


_GRASS: Tint = (0.45, 1.0, 0.72)
_FOREST: Tint = (0.55, 1.0, 0.75)


@dataclass(frozen=True)
class Site:
    """A scene that is built along a carriageway: each method adds objects, drawn from `rng`."""

    scene: Scene
    rng: np.random.Generator
    road: Carriageway

    def draw(self, low: float, high: float) -> float:
        """Draw a number evenly from `low` to `high`."""
        return self.rng.uniform(low, high)

    def add_grass(self) -> int:
        """Add the material of lawns and verges; return its index."""
        look = Leaves(self.draw(0.14, 0.24), self.draw(0.15, 0.3), tint=_GRASS, offset=draw_offset(self.rng))
        return self.scene.material(look)

    def add_yard(self) -> int:
        """Add the material of the ground between sidewalks and houses; return its index."""
        return self.scene.material(Plain(0.3, tint=(0.9, 0.97, 1.0), offset=draw_offset(self.rng)))

    def add_leaves(self, low: float, high: float, tint: Tint, contrast: float, scale: float = 1.0) -> int:
        """Add the material of foliage of an albedo between two; return its index."""
        look = Leaves(self.draw(low, high), contrast, scale, tint=tint, offset=draw_offset(self.rng))
        return self.scene.material(look)

    def add_slope(self, start: float, end: float, level: float, slope: float, material: int) -> None:
        """Add ground from `start` outward to `end`: from elevation `level` on with an outward `slope`."""
        right, edges = (slope, (start, end)) if end > start else (-slope, (end, start))
        course, relief, offset = self.road.course, self.road.relief, level - right * start
        self.scene.surfaces.append(Ground(course, edges, (material,), FAR, right, offset, relief=relief))

    def add_sidewalk(self, side: int, edge: float, beyond: int | None = None) -> tuple[float, float]:
        """Add a kerb, a sidewalk and, of the material `beyond`, level ground behind it.

        Returns the sidewalk's elevation and the lateral position of its outer edge.
        """
        height, width = self.draw(*self.road.kerb), self.draw(1.5, 3.5)
        base = self.road.section.elevation(edge)
        level = base + height
        stone = self.scene.material(Plain(self.draw(0.35, 0.5), joint=1.0, offset=draw_offset(self.rng)))
        look = Paving(self.draw(0.28, 0.42), self.draw(0.3, 0.6), tint=WARM, offset=draw_offset(self.rng))
        ends = [edge, edge + side * 0.15, edge + side * width]
        materials = [stone, self.scene.material(look)]
        if beyond is not None:
            ends.append(side * np.inf)
            materials.append(beyond)
        foot = base + (self.road.relief.span[0] if self.road.relief else 0.0)
        edges, course, relief = tuple(ends[::side]), self.road.course, self.road.relief
        kerb = Wall(course, edge, foot, np.array([-50.0, FAR]), np.array([level]), stone, relief)
        strips = Ground(course, edges, tuple(materials[::side]), FAR, offset=level, relief=relief)
        self.scene.surfaces += [kerb, strips]
        return level, edge + side * width

    def add_houses(self, side: int, front: float, base: float) -> None:
        """Add a row of house fronts with gaps, and the bodies of the houses behind them."""
        n, course, rng = 24, self.road.course, self.rng
        widths, storeys = rng.uniform(7, 16, n), rng.uniform(2.8, 3.4, n)
        edges = -20 + np.concatenate([[0.0], np.cumsum(widths)])
        heights = storeys * rng.integers(2, 5, n) + rng.uniform(0.3, 0.8, n)
        heights[rng.random(n) < 0.1] = 0.0
        levels, bays = rng.uniform(0.25, 0.65, n), rng.uniform(2.2, 3.6, n)
        tints = np.stack([rng.uniform(0.6, 1.0, n), rng.uniform(0.85, 1.0, n), np.ones(n)], axis=1)
        looks = (x.astype(np.float32) for x in (edges, levels, tints, storeys, bays))
        fronts = self.scene.material(Facade(draw_offset(rng), *looks))
        self.scene.surfaces.append(Wall(course, front, base, edges, base + heights, fronts))
        before = np.concatenate([[0.0], heights[:-1]])
        # the only part of a body that is visible from the street is the gable above the house before it
        for i in np.flatnonzero((heights > before + 0.3) & (edges[:-1] > 3) & (edges[:-1] < 120)):
            blue, green, red = tints[i].tolist()
            plaster = self.scene.material(Plain(float(0.9 * levels[i]), tint=(blue, green, red)))
            height, half, depth = float(heights[i]), float(widths[i] / 2), 5.0
            extent = np.array([[-depth, depth], [0.0, height], [-half, half]])
            middle = float(edges[i] + half)
            # set back: the body is straight, and must stay behind a front that follows the bend
            place = course.point(front + side * (depth + 0.25), middle, base)
            body = extruded(Shape(rectangle(-half, half, 0.0, height), plaster, depth))
            self.scene.surfaces.append(Solid(course.frame(middle), place, (body,), extent))

    def add_hedge(self, lateral: float, base: float) -> None:
        """Add a clipped hedge along the road."""
        material = self.add_leaves(0.08, 0.16, (0.42, 1.0, 0.62), 0.4)
        edges = np.arange(-20.0, 120.0, 1.0, dtype=np.float64)
        tops = base + self.draw(0.9, 1.8) + self.rng.uniform(-0.08, 0.08, len(edges) - 1)
        self.scene.surfaces.append(Wall(self.road.course, lateral, base, edges, tops, material))

    def add_posts(self, lateral: float, level: float, radius: float = 0.07, height: float = 6.0) -> None:
        """Add lamp posts or delineators, evenly spaced."""
        metal = self.scene.material(Plain(self.draw(0.2, 0.6), 0.05, 0.05))
        gap = self.draw(18, 35)
        for z in np.arange(self.draw(6, gap), 90, gap).tolist():
            self.scene.surfaces.append(Post(self.road.course.point(lateral, z, level), radius, height, metal))

    def add_trees(self, near: float, outer: float, level: float) -> None:
        """Add trees between two lateral positions, each a trunk and two crowns that overlap."""
        bark = self.scene.material(Plain(0.12, 0.3, 0.2, tint=(0.75, 0.9, 1.0)))
        leaves = self.add_leaves(tint=(0.42, 1.0, self.draw(0.55, 0.8)), low=0.10, high=0.2, contrast=0.4)
        z = self.draw(10, 25)
        while z < 90:
            lateral = near + (outer - near) * float(self.rng.random())
            stem, radius = self.draw(2.2, 3.2), self.draw(1.2, 2.2)
            half = radius * self.draw(0.9, 1.4)
            foot, top = (self.road.course.point(lateral, z, level + rise) for rise in (0.0, stem + half))
            lower = top + np.array([self.draw(-0.8, 0.8), -0.3 * half, self.draw(-0.8, 0.8)])
            self.scene.surfaces += [
                Post(foot, self.draw(0.1, 0.2), stem + half, bark),
                TreeCrown(top, radius, half, leaves),
                TreeCrown(lower, 1.1 * radius, 0.6 * half, leaves),
            ]
            z += self.draw(7, 25)

    def add_cars(self) -> None:
        """Add vehicles: one ahead, one oncoming and parked ones, each with a probability."""
        rng, road = self.rng, self.road
        places: list[tuple[float, float]] = []
        if rng.random() < 0.5:
            places.append((road.shift + rng.normal(0, 0.2), rng.uniform(9, 40)))
        if rng.random() < 0.5 and not road.single:
            places.append((road.shift - road.lane + rng.normal(0, 0.2), rng.uniform(9, 60)))
        for edge in (road.left + 1.15, road.right - 1.15) if road.parking else ():
            z = rng.uniform(6, 12)
            while z < 70:
                if rng.random() < 0.6:
                    places.append((edge + rng.normal(0, 0.05), z))
                z += rng.uniform(8.2, 10)
        first, middle = len(self.scene.materials), road.shift - road.lane / 2
        self.scene.materials += car_materials(draw_offset(rng))
        for x, z in places:
            ground = road.section.piece(x)
            facing = np.array([[-1.0], [1.0], [-1.0]]) if x < middle else 1.0
            frame = facing * road.course.frame(z, ground.slope_at(x))
            place = road.course.point(x, z, ground.elevation(x))
            self.scene.cars.append(vehicle(rng, frame, place, first))
        self.scene.surfaces += self.scene.cars

    def add_backdrop(self) -> None:
        """Add a line of trees where the ground ends."""
        material = self.add_leaves(0.10, 0.2, _FOREST, 0.35, scale=0.15)
        steps = self.rng.normal(0, 1.2, 400)
        skyline = 9 + np.convolve(steps, np.ones(9) / 3, mode="same") + self.rng.uniform(-1, 1, 400)
        self.scene.surfaces.append(Backdrop(self.road.course, FAR, -30.0, skyline, material))
