"""The carriageway: its course, its lanes and its surface."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.materials import Asphalt, Mark, Patch
from rollcli.simulate.scene import FAR, draw, draw_offset
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Course


@dataclass(frozen=True)
class Way:
    """One or two lanes between two edges (lateral, metres); the middle of ours, the right one, is `shift`."""

    course: Course
    left: float
    right: float
    lane: float
    shift: float
    single: bool
    parking: bool

    @property
    def sides(self) -> tuple[tuple[int, float], tuple[int, float]]:
        """-1 and the left edge, 1 and the right edge."""
        return (-1, self.left), (1, self.right)


def draw_way(rng: np.random.Generator, spec: FrameSpec) -> Way:
    """Half of the roads bend; country roads can have a single lane, others room to park."""
    bend = float(rng.choice([0.0, 1.0])) * draw(rng, -1 / 250, 1 / 250)
    heading = float(rng.normal(0, 0.015))
    course = Course(heading, 0.0 if spec.scene == "bare" else bend, spec.curvature)
    lane, shift = draw(rng, 2.8, 3.7), float(rng.normal(0, 0.25))
    country = spec.scene in ("bare", "verge")
    single = bool(rng.random() < 0.3) and country
    parking = bool(rng.random() < 0.4) and not country
    shoulder = 2.2 if parking else draw(rng, 0.1, 0.6)
    left = shift - (0.5 if single else 1.5) * lane - shoulder
    return Way(course, left, shift + 0.5 * lane + shoulder, lane, shift, single, parking)


def draw_asphalt(rng: np.random.Generator, way: Way) -> Asphalt:
    """Its marks, gutters, mended patches and seams."""
    middle, left, right = (way.shift + x * way.lane for x in (-0.5, -1.5, 0.5))
    marks = []
    if not way.single:
        marks.append(Mark(middle, 0.13, 12.0, 6.0) if rng.random() < 0.8 else Mark(middle, 0.13))
        if rng.random() < 0.6:
            marks += [Mark(left, 0.12), Mark(right, 0.12)]
    gutters = ((way.left, way.left + 0.35), (way.right - 0.35, way.right))
    patches = [Patch(start, end, -50, FAR, -0.2) for start, end in gutters]
    for _ in range(rng.integers(1, 6)):
        x, z = draw(rng, way.left, way.right), draw(rng, 3, 40)
        wide, long = draw(rng, 0.5, 2.0), draw(rng, 0.8, 6.0)
        patches.append(Patch(x, x + wide, z, z + long, draw(rng, -0.35, 0.2)))
    return Asphalt(
        draw(rng, 0.16, 0.30),
        draw(rng, 0.04, 0.2),
        wheels=(way.shift + 0.25 * way.lane, way.lane / 2),
        marks=tuple(marks),
        patches=tuple(patches),
        seams=tuple(draw(rng, way.left, way.right) for _ in range(rng.integers(1, 4))),
        offset=draw_offset(rng),
    )
