"""A car, put together from convex solids."""

import numpy as np

from rollcli.simulate.materials import GREY, CarPaint, Glass, Material, Plain, Tint
from rollcli.simulate.solids import Part, Solid
from rollcli.simulate.surfaces import Course
from rollcli.simulate.vectors import Array

Outline = tuple[tuple[float, float], ...]

# convex outlines seen from the right, (ahead, up) in metres, clockwise
_BODY: Outline = (
    (-2.10, 0.28),
    (-2.20, 0.55),
    (-2.12, 0.95),
    (0.95, 0.95),
    (2.02, 0.80),
    (2.15, 0.50),
    (2.08, 0.26),
)
_CABIN: Outline = ((-1.95, 0.93), (-1.45, 1.42), (0.25, 1.42), (1.10, 0.93))
_ROOF: Outline = ((-1.50, 1.39), (-1.42, 1.46), (0.22, 1.46), (0.30, 1.39))
_WHEEL: Outline = tuple((0.32 * np.cos(a), 0.32 + 0.32 * np.sin(a)) for a in np.arange(10) * -np.pi / 5)
_TAIL: Outline = ((-2.23, 0.68), (-2.23, 0.85), (-2.0, 0.85), (-2.0, 0.68))
_HEAD: Outline = ((1.95, 0.58), (1.95, 0.72), (2.16, 0.72), (2.16, 0.58))
_GRILLE: Outline = ((1.95, 0.45), (1.95, 0.62), (2.17, 0.62), (2.17, 0.45))
_PLATE: Outline = ((-2.22, 0.50), (-2.22, 0.61), (-2.0, 0.61), (-2.0, 0.50))

_PAINTS: tuple[tuple[float, Tint], ...] = (
    (0.70, GREY),
    (0.35, GREY),
    (0.06, GREY),
    (0.25, (0.35, 0.35, 1.3)),
    (0.22, (1.3, 0.7, 0.4)),
    (0.20, (0.6, 1.0, 0.6)),
)
_GLASS, _TYRE, _LAMPS, _PLATES = range(len(_PAINTS), len(_PAINTS) + 4)


def car_materials(offset: float) -> list[Material]:
    """What `car` needs: paints, glass, tyres, lamps and plates, in the order that it counts on."""
    paints: list[Material] = [CarPaint(level, tint=tint, offset=offset) for level, tint in _PAINTS]
    return [
        *paints,
        Glass(tint=(1.05, 1.0, 0.95), offset=offset),
        Plain(0.03, 0.3, 0.1),
        Plain(0.45, 0.05, 0.05, tint=(0.15, 0.15, 1.0)),
        Plain(0.7, 0.1, 0.1),
    ]


def car(
    rng: np.random.Generator, course: Course, lateral: float, z: float, first_material: int, oncoming: bool
) -> Solid:
    """A car that stands at (lateral, z) on the road, its nose ahead or toward us.

    Its materials are those of `car_materials`, from `first_material` on.
    """
    paint = int(rng.integers(len(_PAINTS)))
    tall = float(rng.uniform(0.95, 1.25))
    shapes: tuple[tuple[Outline, float, float, float, int], ...] = (
        (_BODY, 0.0, 0.90, 0.10, paint),
        (_CABIN, 0.0, 0.86, 0.35, _GLASS),
        (_ROOF, 0.0, 0.72, 0.35, paint),
        (_shift(_WHEEL, 1.35), 0.0, 0.89, 0.0, _TYRE),
        (_shift(_WHEEL, -1.35), 0.0, 0.89, 0.0, _TYRE),
        (_TAIL, 0.62, 0.13, 0.0, _LAMPS),
        (_TAIL, -0.62, 0.13, 0.0, _LAMPS),
        (_HEAD, 0.62, 0.15, 0.0, _PLATES),
        (_HEAD, -0.62, 0.15, 0.0, _PLATES),
        (_GRILLE, 0.0, 0.40, 0.0, _TYRE),
        (_PLATE, 0.0, 0.26, 0.0, _PLATES),
    )
    parts = tuple(
        _extrude(np.array(outline) * [1, tall], centre, half, taper, first_material + material)
        for outline, centre, half, taper, material in shapes
    )
    extent = np.array([[-0.95, 0.95], [0.0, 1.5 * tall], [-2.25, 2.2]])
    about = np.array([[-1.0], [1.0], [-1.0]]) if oncoming else 1.0
    return Solid(about * course.frame(z), course.point(lateral, z), parts, extent)


def _shift(outline: Outline, ahead: float) -> Outline:
    return tuple((a + ahead, b) for a, b in outline)


def _extrude(outline: Array, centre: float, half_width: float, taper: float, material: int) -> Part:
    """The solid of a convex outline (k, 2), `half_width` to each side; `taper` leans the sides inward."""
    edges = np.roll(outline, -1, axis=0) - outline
    out = np.stack([np.zeros(len(edges)), edges[:, 0], -edges[:, 1]], axis=1)
    normals = np.concatenate([out, [[1.0, taper, 0.0], [-1.0, taper, 0.0]]])
    reach = half_width + taper * outline[:, 1].min()
    heights = out[:, 2] * outline[:, 0] + out[:, 1] * outline[:, 1]
    offsets = np.concatenate([heights, [reach + centre, reach - centre]])
    length = np.linalg.norm(normals, axis=1)
    return Part(normals / length[:, None], offsets / length, material)


def box(half_width: float, height: float, half_length: float, material: int) -> Part:
    """A box that stands on its frame's origin."""
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    return Part(normals, np.array([half_width, height, half_length, half_width, 0.0, half_length]), material)
