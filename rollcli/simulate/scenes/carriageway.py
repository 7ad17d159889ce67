"""The carriageway: its course, its lanes and its surface."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.geometry.surfaces import Course
from rollcli.simulate.geometry.vectors import Array
from rollcli.simulate.looks.materials import Asphalt, Mark, Patch
from rollcli.simulate.options import GUTTER_WIDTH
from rollcli.simulate.scenes.cross_section import CrossSection, cross_section
from rollcli.simulate.scenes.scene import FAR, draw, draw_offset
from rollcli.simulate.spec import FrameSpec


@dataclass(frozen=True)
class Carriageway:
    """One or two lanes between two edges (lateral, metres).

    The rig drives in the right lane, whose middle is at `shift`. `kerb` is the lowest and the highest kerb,
    metres.
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

    @property
    def sides(self) -> tuple[tuple[int, float], tuple[int, float]]:
        """The two sides: -1 with the left edge, 1 with the right edge."""
        return (-1, self.left), (1, self.right)

    @property
    def normal(self) -> Array:
        """The upward unit normal (3,) of the plane that touches the road where the rig stands."""
        slope = self.section.piece(0.0).slope_at(0.0)
        normal = np.array([-slope, 1.0, slope * self.course.heading])
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
    return Carriageway(course, left, right, lane, shift, single, parking, section, spec.kerb)


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
