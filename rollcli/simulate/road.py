"""The carriageway: its course, its cross-section and its surface."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rollcli.simulate.materials import Asphalt, Mark, Patch
from rollcli.simulate.options import GUTTER_WIDTH
from rollcli.simulate.relief import Relief, draw_relief, lane_plane
from rollcli.simulate.scene import FAR, draw, draw_offset
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Course
from rollcli.simulate.vectors import Array


class Piece(NamedTuple):
    """elevation = offset + slope * lateral + camber / 2 * lateral^2, metres, for laterals in [start, end)."""

    start: float
    end: float
    slope: float = 0.0
    camber: float = 0.0
    offset: float = 0.0

    def elevation(self, lateral: float) -> float:
        """Return the height at a lateral position, metres."""
        return self.offset + (self.slope + self.camber / 2 * lateral) * lateral

    def slope_at(self, lateral: float) -> float:
        """Return the slope at a lateral position; positive where the road rises to the right."""
        return self.slope + self.camber * lateral

    def curvature_at(self, lateral: float) -> float:
        """Return the second derivative of the height over the plane tangent at a lateral position, 1/m."""
        return float(self.camber / math.hypot(1.0, self.slope_at(lateral)) ** 3)


@dataclass(frozen=True)
class CrossSection:
    """Pieces from left to right, without steps; the elevation is 0 where lateral is 0."""

    pieces: tuple[Piece, ...]

    def piece(self, lateral: float) -> Piece:
        """Return the piece at a lateral position; beyond the edges the outermost one."""
        return next((piece for piece in self.pieces if lateral < piece.end), self.pieces[-1])

    def elevation(self, lateral: float) -> float:
        """Return the height above the point below the rig, metres; beyond an edge that of the edge."""
        inside = min(max(lateral, self.pieces[0].start), self.pieces[-1].end)
        return self.piece(inside).elevation(inside)


def cross_section(
    shape: str, crossfall: float, gutter: float, left: float, right: float, bend: float
) -> CrossSection:
    """Make the cross section of a carriageway.

    Parameters
    ----------
    shape : str
        One of `CROSS_SECTIONS`.
    crossfall, gutter : float
        Slopes in metres per metre: the steepest of the carriageway, and how much steeper its outer
        `GUTTER_WIDTH` falls outward.
    left, right : float
        The edges (lateral, metres).
    bend : float
        The road's horizontal curvature, 1/m: superelevation raises the outer side of a bend. A straight
        road falls to the right.
    """
    middle, half = (left + right) / 2, (right - left) / 2
    start, end = middle - half, middle + half
    pieces: tuple[Piece, ...]
    if shape == "roof":
        rising = Piece(start, middle, crossfall, offset=-2 * crossfall * middle)
        pieces = rising, Piece(middle, end, -crossfall)
    elif shape in ("crown", "dish"):
        camber = (crossfall if shape == "dish" else -crossfall) / half
        pieces = (Piece(start, end, -camber * middle, camber),)
    elif shape == "superelevated":
        pieces = (Piece(start, end, crossfall if bend < 0 else -crossfall),)
    else:
        pieces = (Piece(start, end),)
    if gutter:
        pieces = _add_gutters(pieces, gutter)
    below_rig = CrossSection(pieces).elevation(0.0)
    return CrossSection(tuple(piece._replace(offset=piece.offset - below_rig) for piece in pieces))


def _add_gutters(pieces: tuple[Piece, ...], gutter: float) -> tuple[Piece, ...]:
    """Replace the outer ends of the carriageway by straight pieces that fall outward more steeply."""
    first, last = pieces[0], pieces[-1]
    left, right = first.start + GUTTER_WIDTH, last.end - GUTTER_WIDTH
    kept = [*pieces]
    kept[0] = kept[0]._replace(start=left)
    kept[-1] = kept[-1]._replace(end=right)
    return (
        _straight(first.start, left, left, first, gutter),
        *kept,
        _straight(right, last.end, right, last, -gutter),
    )


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
    def sides(self) -> tuple[tuple[int, float], tuple[int, float]]:
        """The two sides: -1 with the left edge, 1 with the right edge."""
        return (-1, self.left), (1, self.right)

    @property
    def normal(self) -> Array:
        """The upward unit normal (3,) of the plane that touches the road where the rig stands.

        On a rough road: of the plane that fits the lane ahead, in place of what lies below the wheels.
        """
        slope, rising = self.section.piece(0.0).slope_at(0.0), 0.0
        if self.relief is not None:
            _, right, rising = lane_plane(self.relief)
            slope += right
        normal = np.array([-slope, 1.0, slope * self.course.heading - rising])
        return np.asarray(normal / np.linalg.norm(normal))


def draw_carriageway(rng: np.random.Generator, spec: FrameSpec) -> Carriageway:
    """Draw a carriageway: half of them bend; country roads can have a single lane, others room to park."""
    bend = float(rng.choice([0.0, 1.0])) * draw(rng, -1 / 250, 1 / 250)
    heading = float(rng.normal(0, 0.015))
    if spec.bend is not None:
        bend = spec.bend
    elif spec.scene == "bare":
        bend = 0.0
    course = Course(heading, bend, spec.curvature)
    lane, shift = draw(rng, 2.8, 3.7), float(rng.normal(0, 0.25))
    country = spec.scene in ("bare", "verge")
    # the ridge of a roof runs between two lanes
    single = bool(rng.random() < 0.3) and country and spec.cross_section != "roof"
    parking = bool(rng.random() < 0.4) and not country
    shoulder = 2.2 if parking else draw(rng, 0.1, 0.6)
    left = shift - (0.5 if single else 1.5) * lane - shoulder
    right = shift + 0.5 * lane + shoulder
    section = cross_section(spec.cross_section, spec.crossfall, spec.gutter, left, right, course.bend)
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
    gutters = (
        (carriageway.left, carriageway.left + GUTTER_WIDTH),
        (carriageway.right - GUTTER_WIDTH, carriageway.right),
    )
    patches = [Patch(start, end, -50, FAR, -0.2) for start, end in gutters]
    for _ in range(rng.integers(1, 6)):
        x, z = draw(rng, carriageway.left, carriageway.right), draw(rng, 3, 40)
        wide, long = draw(rng, 0.5, 2.0), draw(rng, 0.8, 6.0)
        patches.append(Patch(x, x + wide, z, z + long, draw(rng, -0.35, 0.2)))
    return Asphalt(
        draw(rng, 0.16, 0.30),
        draw(rng, 0.04, 0.2),
        wheels=(carriageway.shift + 0.25 * carriageway.lane, carriageway.lane / 2),
        marks=tuple(marks),
        patches=tuple(patches),
        seams=tuple(draw(rng, carriageway.left, carriageway.right) for _ in range(rng.integers(1, 4))),
        offset=draw_offset(rng),
    )
