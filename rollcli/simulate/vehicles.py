"""Cars and trucks: convex parts of a few paints."""

from typing import NamedTuple

import numpy as np

from rollcli.simulate.materials import GREY, CarPaint, Glass, Material, Plain, Tint
from rollcli.simulate.relief import Array
from rollcli.simulate.scene import ConvexPart, Solid

Outline = tuple[tuple[float, float], ...]


class Shape(NamedTuple):
    """A convex outline seen from the right, (ahead, up) in metres, clockwise, extruded to both sides.

    `taper` is the inward slope of the sides, `centre` the offset to the right of the middle, metres.
    """

    outline: Outline
    material: int
    half_width: float
    taper: float = 0.0
    centre: float = 0.0


def rectangle(back: float, front: float, low: float, high: float) -> Outline:
    """Return the outline of a rectangle."""
    return ((back, low), (back, high), (front, high), (front, low))


def _wheel(ahead: float, radius: float) -> Outline:
    angles = np.arange(10) * -np.pi / 5
    return tuple((ahead + radius * float(np.cos(a)), radius + radius * float(np.sin(a))) for a in angles)


_FAR = 40.0  # metres: vehicles farther away are drawn without their small parts
_SILHOUETTE = 5

_PAINTS: tuple[tuple[float, Tint], ...] = (
    (0.70, GREY),
    (0.35, GREY),
    (0.06, GREY),
    (0.25, (0.35, 0.35, 1.3)),
    (0.22, (1.3, 0.7, 0.4)),
    (0.20, (0.6, 1.0, 0.6)),
)
_GLASS, _BLACK, _RED, _WHITE, _CARGO = range(len(_PAINTS), len(_PAINTS) + 5)


def car_materials(offset: float) -> list[Material]:
    """Return the materials of `vehicle` in order: paints, glass, tyres, red and white lights, cargo box."""
    return [
        *(CarPaint(level, tint=tint, offset=offset) for level, tint in _PAINTS),
        Glass(0.09, tint=(1.05, 1.0, 0.95), offset=offset),
        Plain(0.03, 0.3, 0.1),
        Plain(0.45, 0.05, 0.05, tint=(0.15, 0.15, 1.0)),
        Plain(0.7, 0.1, 0.1),
        Plain(0.55, 0.04, 0.08, joint=1.1, tint=(0.97, 0.99, 1.0), offset=offset),
    ]


def vehicle(rng: np.random.Generator, frame: Array, place: Array, first_material: int) -> Solid:
    """Draw a car, or with a probability of 1/6 a truck, that stands at `place` (3,).

    Its axes (right, up, ahead) are the rows of `frame`; `first_material` is the index of the first of
    `car_materials`.
    """
    paint, tall = int(rng.integers(len(_PAINTS))), float(rng.uniform(0.95, 1.25))
    shapes = _truck(paint) if rng.random() < 1 / 6 else _car(paint)
    if place[2] > _FAR:
        shapes = shapes[:_SILHOUETTE]
    parts = tuple(extruded(shape, tall, first_material) for shape in shapes)
    half_width = max(shape.half_width + abs(shape.centre) for shape in shapes)
    ahead, up = np.array([point for shape in shapes for point in shape.outline]).T
    extent = np.array([[-half_width, half_width], [0.0, tall * up.max()], [ahead.min(), ahead.max()]])
    return Solid(frame, place, parts, extent)


def _car(paint: int) -> tuple[Shape, ...]:
    hood, tail = (0.95, 0.95), (-2.12, 0.95)
    body = ((-2.10, 0.28), (-2.20, 0.55), tail, hood, (2.02, 0.80), (2.15, 0.50), (2.08, 0.26))
    cabin = ((-1.95, 0.93), (-1.45, 1.42), (0.25, 1.42), (1.10, 0.93))
    roof = ((-1.50, 1.39), (-1.42, 1.46), (0.22, 1.46), (0.30, 1.39))
    rear, front = rectangle(-2.23, -2.0, 0.68, 0.85), rectangle(1.95, 2.16, 0.58, 0.72)
    return (
        Shape(body, paint, 0.90, taper=0.10),
        Shape(cabin, _GLASS, 0.86, taper=0.35),
        Shape(roof, paint, 0.72, taper=0.35),
        *(Shape(_wheel(axle, 0.32), _BLACK, 0.89) for axle in (1.35, -1.35)),
        *(Shape(rear, _RED, 0.13, centre=side) for side in (0.62, -0.62)),
        *(Shape(front, _WHITE, 0.15, centre=side) for side in (0.62, -0.62)),
        Shape(rectangle(1.95, 2.17, 0.45, 0.62), _BLACK, 0.40),
        Shape(rectangle(-2.22, -2.0, 0.50, 0.61), _WHITE, 0.26),
    )


def _truck(paint: int) -> tuple[Shape, ...]:
    cab = ((2.0, 0.5), (2.0, 2.45), (3.2, 2.45), (3.7, 1.5), (3.7, 0.5))
    rear = rectangle(-3.93, -3.7, 0.70, 0.88)
    return (
        Shape(rectangle(-3.9, 1.8, 0.95, 3.0), _CARGO, 1.22),
        Shape(cab, paint, 1.15),
        Shape(rectangle(-3.85, 3.5, 0.55, 0.95), _BLACK, 0.9),
        Shape(_wheel(2.7, 0.42), _BLACK, 1.12),
        Shape(_wheel(-2.4, 0.42), _BLACK, 1.18),
        Shape(((2.5, 1.55), (2.5, 2.3), (3.31, 2.3), (3.72, 1.55)), _GLASS, 1.17),
        *(Shape(rear, _RED, 0.15, centre=side) for side in (0.95, -0.95)),
        Shape(rectangle(-3.92, -3.7, 0.70, 0.82), _WHITE, 0.26),
        Shape(rectangle(3.5, 3.73, 0.70, 0.85), _WHITE, 1.05),
    )


def extruded(shape: Shape, tall: float = 1.0, first_material: int = 0) -> ConvexPart:
    """Return the solid of a shape whose heights are multiplied by `tall`."""
    outline: Array = np.array(shape.outline) * [1.0, tall]
    edges = np.roll(outline, -1, axis=0) - outline
    out = np.stack([np.zeros(len(edges)), edges[:, 0], -edges[:, 1]], axis=1)
    normals = np.concatenate([out, [[1.0, shape.taper, 0.0], [-1.0, shape.taper, 0.0]]])
    reach = shape.half_width + shape.taper * outline[:, 1].min()
    heights = out[:, 2] * outline[:, 0] + out[:, 1] * outline[:, 1]
    offsets = np.concatenate([heights, [reach + shape.centre, reach - shape.centre]])
    length = np.linalg.norm(normals, axis=1)
    return ConvexPart(normals / length[:, None], offsets / length, first_material + shape.material)
