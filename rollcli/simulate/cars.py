"""A car, put together from convex solids."""

import numpy as np

from rollcli.simulate.camera import Array
from rollcli.simulate.materials import CarPaint, Glass, Material, Plain, Tint
from rollcli.simulate.surfaces import Course, Polytope

# convex outlines seen from the left, (ahead, up) in metres, clockwise
_BODY = ((-2.10, 0.28), (-2.20, 0.55), (-2.12, 0.95), (0.95, 0.95), (2.02, 0.80), (2.15, 0.50), (2.08, 0.26))
_CABIN = ((-1.95, 0.93), (-1.45, 1.42), (0.25, 1.42), (1.10, 0.93))
_ROOF = ((-1.47, 1.40), (-1.42, 1.46), (0.22, 1.46), (0.27, 1.40))
_WHEEL = tuple((0.32 * np.cos(a), 0.32 + 0.32 * np.sin(a)) for a in np.arange(10) * -np.pi / 5)

Outline = tuple[tuple[float, float], ...]

_PAINTS: tuple[tuple[float, Tint], ...] = (
    (0.70, (1.0, 1.0, 1.0)),
    (0.35, (1.0, 1.0, 1.0)),
    (0.06, (1.0, 1.0, 1.0)),
    (0.25, (0.35, 0.35, 1.3)),
    (0.22, (1.3, 0.7, 0.4)),
    (0.20, (0.6, 1.0, 0.6)),
)


def car(rng: np.random.Generator, course: Course, lateral: float, z: float) -> list[Polytope]:
    """The solids of a car that stands at (lateral, z) on the road and points along it."""
    frame = _frame(course, z)
    place = course.point(lateral, z)
    level, tint = _PAINTS[rng.integers(len(_PAINTS))]
    paint = CarPaint(level, tint, float(rng.uniform(0, 1000)))
    glass = Glass(offset=float(rng.uniform(0, 1000)))
    tyre, lamp = Plain(0.03, 0.3, 0.1), Plain(0.45, 0.05, 0.05, (0.15, 0.15, 1.0))
    plate = Plain(0.7, 0.1, 0.1)
    tall = float(rng.uniform(0.95, 1.2))
    parts: list[tuple[Outline, float, float, float, Material]] = [
        (_BODY, 0.0, 0.90, 0.10, paint),
        (_CABIN, 0.0, 0.98, 0.35, glass),
        (_ROOF, 0.0, 1.02, 0.35, paint),
        (_shift(_WHEEL, 1.35), 0.0, 0.88, 0.0, tyre),
        (_shift(_WHEEL, -1.35), 0.0, 0.88, 0.0, tyre),
        (((-2.23, 0.68), (-2.23, 0.85), (-2.0, 0.85), (-2.0, 0.68)), 0.66, 0.12, 0.0, lamp),
        (((-2.23, 0.68), (-2.23, 0.85), (-2.0, 0.85), (-2.0, 0.68)), -0.66, 0.12, 0.0, lamp),
        (((-2.22, 0.50), (-2.22, 0.61), (-2.0, 0.61), (-2.0, 0.50)), 0.0, 0.26, 0.0, plate),
    ]
    return [_extrude(frame, place, np.array(o) * [1, tall], x, h, t, m) for o, x, h, t, m in parts]


def _frame(course: Course, z: float) -> Array:
    ahead = np.array([course.heading + course.bend * z, course.curvature * z, 1.0])
    ahead /= np.linalg.norm(ahead)
    up = np.array([0.0, 1.0, 0.0]) - ahead[1] * ahead
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, ahead), up, ahead])


def _shift(outline: Outline, ahead: float) -> Outline:
    return tuple((a + ahead, b) for a, b in outline)


def _extrude(
    frame: Array,
    place: Array,
    outline: Array,
    centre: float,
    half_width: float,
    taper: float,
    material: Material,
) -> Polytope:
    """The solid of a convex outline (k, 2), `half_width` to each side; `taper` leans the sides inward."""
    edges = np.roll(outline, -1, axis=0) - outline
    out = np.stack([np.zeros(len(edges)), edges[:, 0], -edges[:, 1]], axis=1)
    sides = np.array([[1.0, taper, 0.0], [-1.0, taper, 0.0]])
    normals = np.concatenate([out, sides])
    low = outline[:, 1].min()
    offsets = np.concatenate(
        [
            out[:, 2] * outline[:, 0] + out[:, 1] * outline[:, 1],
            [half_width + taper * low + centre, half_width + taper * low - centre],
        ]
    )
    length = np.linalg.norm(normals, axis=1)
    extent = np.array(
        [
            [centre - half_width, centre + half_width],
            [low, outline[:, 1].max()],
            [outline[:, 0].min(), outline[:, 0].max()],
        ]
    )
    return Polytope(frame, place, normals / length[:, None], offsets / length, extent, material)
