"""How many scenes without a road are called ok: rooms, tables, boards, shelves, stairs, cars' insides.

    python tests/benchmarks/bench_roadless.py [FRAMES [SEED]]

FRAMES (40) disparity maps of each kind, made by casting rays at rectangles. To reach: none is ok. Numbers
were fitted with seeds 1 to 10; SEED is 701.

The planes in them are as even as a road: what tells them from one is how much of the view they fill, and how
wide the view is from where the camera stands.
"""

import math
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll

# a scene depends on its kind's place here
KINDS = ("room", "table", "board", "boxes", "shelf", "desk", "stairs", "books", "robot", "car")

Array = NDArray[np.float64]
Rectangle = tuple[Array, Array, Array]  # a corner and two edges, camera coordinates: right, down, ahead


def roadless_map(kind: str, rng: np.random.Generator, size: tuple[int, int] = (320, 240)) -> Array:
    """Return a disparity map (H, W), px, of a scene of one of `KINDS`, with noise and holes as a matcher's.

    Parameters
    ----------
    kind : str
    rng : numpy.random.Generator
    size : tuple of int
        Width and height, px.
    """
    width, height = size
    focal = width * rng.uniform(0.6, 1.6)
    columns, rows = np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2
    u, v = np.meshgrid(columns / focal, rows / focal)
    inverse = np.zeros((height, width))  # of the depth
    for corner, first, second in _SCENES[kind](rng):
        normal = np.cross(first, second)
        level = normal @ corner
        if abs(level) < 1e-9:
            continue
        each = (normal[0] * u + normal[1] * v + normal[2]) / level
        nearer = np.nonzero(each > np.maximum(inverse, 1e-3))
        depth = 1 / each[nearer]
        inside = np.ones(len(depth), bool)
        for edge, other in ((first, second), (second, first)):
            axis = np.cross(np.cross(edge, other), other)  # edges need not be at right angles
            along = ((axis[0] * u[nearer] + axis[1] * v[nearer] + axis[2]) * depth - axis @ corner) / (
                edge @ axis
            )
            inside &= (along >= 0) & (along <= 1)
        inverse[nearer[0][inside], nearer[1][inside]] = each[nearer][inside]
    nearest = np.percentile(inverse, 98)
    disparity = inverse * rng.uniform(40, 110) * width / 640 / max(nearest, 1e-9)
    coarse = rng.normal(0, rng.uniform(0, 0.15), (height // 8 + 2, width // 8 + 2)).repeat(8, 0).repeat(8, 1)
    noise = rng.normal(0, rng.uniform(0.05, 0.3), disparity.shape) + coarse[:height, :width]
    holes = rng.random((height // 16 + 1, width // 16 + 1)) < rng.uniform(0, 0.2)
    lost = holes.repeat(16, 0).repeat(16, 1)[:height, :width] | (inverse == 0)
    return np.where(lost, 0, np.maximum(disparity + noise, 0.01))


def _tilt(rng: np.random.Generator, pitch_deg: tuple[float, float], roll_deg: float) -> Array:
    """Draw how level coordinates (right, down, ahead) turn into the camera's, (3, 3)."""
    pitch, roll = math.radians(rng.uniform(*pitch_deg)), math.radians(rng.uniform(-roll_deg, roll_deg))
    yaw = math.radians(rng.uniform(-60, 60))
    turned = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    looks_down = np.array(
        [[1, 0, 0], [0, math.cos(pitch), -math.sin(pitch)], [0, math.sin(pitch), math.cos(pitch)]]
    )
    rolled = np.array([[math.cos(roll), math.sin(roll), 0], [-math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    return np.asarray(rolled @ looks_down @ turned)


def _box(rotation: Array, low: Array, high: Array) -> Iterator[Rectangle]:
    """Yield the faces of a box that is upright in level coordinates."""
    extent = np.diag(high - low)
    for axis in range(3):
        first, second = (rotation @ extent[:, (axis + k) % 3] for k in (1, 2))
        for corner in (low, low + extent[:, axis]):
            yield rotation @ corner, first, second


def _things(
    rng: np.random.Generator, rotation: Array, top: float, area: Array, count: int
) -> Iterator[Rectangle]:
    """Yield boxes that stand on a level `top` (down is positive), in an area of (x, z) from low to high."""
    for _ in range(count):
        x, z = rng.uniform(area[0], area[1])
        wide, tall, deep = rng.uniform(0.03, 0.3, 3) * (area[1] - area[0]).mean()
        yield from _box(rotation, np.array([x, top - tall, z]), np.array([x + wide, top, z + deep]))


def _room(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a room with furniture near ahead: its floor shows here and there."""
    rotation, eye = _tilt(rng, (-5, 30), 8), rng.uniform(0.8, 1.8)
    low = np.array([-rng.uniform(1, 3), eye - rng.uniform(2.3, 3), -rng.uniform(1, 3)])
    high = np.array([rng.uniform(1, 3), eye, rng.uniform(2, 5)])
    yield from _box(rotation, low, high)
    ahead = rotation[2]  # the optical axis, level coordinates
    for _ in range(rng.integers(3, 9)):
        place = rng.uniform(0.9, 3) * ahead + rng.normal(0, 0.8, 3)
        wide, tall, deep = rng.uniform(0.3, 1.6, 3) * np.array([1.0, 0.7, 1.0])
        corner = np.array([place[0] - wide / 2, eye - tall, place[2]])
        yield from _box(rotation, corner, np.array([corner[0] + wide, eye, corner[2] + deep]))


def _table(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a table that is seen from above, with things on it, and the floor and walls behind."""
    rotation, above = _tilt(rng, (15, 65), 15), rng.uniform(0.3, 0.9)
    ahead = rotation[2] * above / max(rotation[2][1], 0.2)  # where the axis meets the table
    half = rng.uniform(0.3, 1.0, 2)
    area = np.array([[ahead[0] - half[0], ahead[2] - half[1]], [ahead[0] + half[0], ahead[2] + half[1]]])
    low, high = (np.array([area[k][0], above + 0.04 * k, area[k][1]]) for k in (0, 1))
    yield from _box(rotation, low, high)
    yield from _things(rng, rotation, above, area, rng.integers(0, 9))
    far = rng.uniform(1.5, 4)
    yield from _box(rotation, np.array([-far, -2, -far]), np.array([far, above + 0.75, far]))


def _desk(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a table near ahead that hides the lower image, and the floor of the room behind it."""
    rotation, eye = _tilt(rng, (0, 25), 8), rng.uniform(1.0, 1.6)
    ahead, near = rotation[2], rng.uniform(0.3, 0.8)
    half, top = rng.uniform(0.3, 0.9), rng.uniform(0.2, 0.7)
    middle = near * ahead
    low = np.array([middle[0] - half, top, middle[2] - half])
    yield from _box(rotation, low, np.array([middle[0] + half, top + 0.05, middle[2] + half]))
    yield from _things(
        rng, rotation, top, np.array([low[[0, 2]], low[[0, 2]] + 2 * half]), rng.integers(1, 6)
    )
    far = rng.uniform(2, 6)
    yield from _box(rotation, np.array([-far, eye - 2.6, -far]), np.array([far, eye, far]))


def _board(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a board at any angle before a wall at another."""
    for distance, half, tilt in (
        (rng.uniform(3, 6), 20.0, 0.5),
        (rng.uniform(0.8, 2), rng.uniform(0.3, 1.2), 1.2),
    ):
        normal = rng.normal(0, tilt, 3) + np.array([0.0, 0.0, 1.0])
        first = np.cross(normal, [0.0, 1.0, 0.0])
        first *= half / np.linalg.norm(first)
        second = np.cross(first, normal)
        second *= half * rng.uniform(0.4, 1) / np.linalg.norm(second)
        middle = np.array([*rng.normal(0, 0.1 * distance, 2), distance])
        yield middle - first - second, 2 * first, 2 * second


def _boxes(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield boxes that fly at all angles before a wall."""
    normal = rng.normal(0, 0.3, 3) + np.array([0.0, 0.0, 1.0])
    first = 40 * np.cross(normal, [0.0, 1.0, 0.0])
    second = 40 * np.cross(normal, first / 40)
    yield np.array([0, 0, 12.0]) - first / 2 - second / 2, first, second
    for _ in range(rng.integers(8, 30)):
        rotation = np.linalg.qr(rng.normal(0, 1, (3, 3)))[0]
        distance = rng.uniform(1.5, 9)
        middle = np.array([*(rng.uniform(-0.8, 0.8, 2) * distance), distance])
        half = rng.uniform(0.1, 0.9, 3)
        for corner, one, other in _box(rotation, -half, half):
            yield corner + middle, one, other


def _shelf(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield shelves, one over the other, with things on them and a wall behind."""
    rotation, distance = _tilt(rng, (-10, 25), 8), rng.uniform(0.6, 1.6)
    ahead = distance * np.array([rotation[2][0], 0, rotation[2][2]])
    half, deep, gap = rng.uniform(0.4, 1.5), rng.uniform(0.3, 0.9), rng.uniform(0.25, 0.5)
    start = rng.uniform(0, gap)
    low, high = ahead[[0, 2]] - half, ahead[[0, 2]] + half
    for level in np.arange(-4, 5) * gap + start:
        box = np.array([low[0], level, ahead[2]]), np.array([high[0], level + 0.03, ahead[2] + deep])
        yield from _box(rotation, *box)
        area = np.array([[low[0], ahead[2]], [high[0], ahead[2] + deep]])
        yield from _things(rng, rotation, level, area, rng.integers(0, 5))
    yield from _box(rotation, np.array([-4.0, -3, -3]), np.array([4.0, 3, ahead[2] + deep]))


def _stairs(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield stairs that go up or down ahead, from where the camera stands, between two walls."""
    rotation, eye = _tilt(rng, (-5, 45), 8), rng.uniform(1.0, 1.7)
    start, tread, rise = (
        rng.uniform(0.3, 2),
        rng.uniform(0.25, 0.35),
        rng.choice([-1, 1]) * rng.uniform(0.14, 0.2),
    )
    half, steps = rng.uniform(0.6, 1.5), rng.integers(6, 20)
    yield from _box(rotation, np.array([-half, eye, -2.0]), np.array([half, eye + 4, start]))
    for step in range(1, steps + 1):
        front, top = start + (step - 1) * tread, eye - step * rise
        yield from _box(rotation, np.array([-half, top, front]), np.array([half, eye + 4, front + tread]))
    far = start + steps * tread
    yield from _box(
        rotation, np.array([-half, -6.0, -2.0]), np.array([half, eye + 5, far + rng.uniform(0, 2)])
    )


def _books(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a row of books in a shelf: their backs and, from above, their tops are nearly planes."""
    rotation, distance = _tilt(rng, (-10, 60), 15), rng.uniform(0.3, 0.9)
    ahead, height = distance * rotation[2], rng.uniform(0.18, 0.3)
    left = ahead[0] - rng.uniform(0.4, 1)
    yield from _box(
        rotation,
        np.array([left, ahead[1] + height, ahead[2]]),
        np.array([left + 2, ahead[1] + height + 0.02, ahead[2] + 0.3]),
    )
    while left < ahead[0] + 1:
        thick, tall, deep = rng.uniform((0.01, 0.8 * height, 0), (0.06, height, 0.03))
        low = np.array([left, ahead[1] + height - tall, ahead[2] + deep])
        yield from _box(rotation, low, np.array([left + thick, ahead[1] + height, ahead[2] + 0.25]))
        left += thick
    yield from _box(rotation, np.array([-3.0, -2, -3]), np.array([3.0, 2, ahead[2] + 0.3]))


def _robot(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield a robot's table seen from above, with links of its arm that hang over it at all angles."""
    yield from (table := list(_table(rng)))
    middle = table[1][0] + (table[1][1] + table[1][2]) / 2  # of the table
    for _ in range(rng.integers(1, 5)):
        turned, half = np.linalg.qr(rng.normal(0, 1, (3, 3)))[0], rng.uniform(0.03, 0.08)
        place = middle * rng.uniform(0.5, 0.95) + rng.normal(0, 0.15, 3)
        for corner, one, other in _box(turned, -np.array([half, half, 0.25]), np.array([half, half, 0.25])):
            yield corner + place, one, other


def _car(rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield the inside of a car: seats and a dashboard, and through the window above it nothing."""
    rotation, ahead, rise = _tilt(rng, (-5, 25), 5), rng.uniform(0.5, 0.9), rng.uniform(0, 0.15)
    wide = rotation @ np.array([1.5, 0, 0])
    for corner, edge in (
        ((-0.75, 0.25, ahead), (0.0, -rise, 0.5)),  # the dashboard, and its front
        ((-0.75, 0.25, ahead), (0.0, 0.5, -0.1)),
        ((-0.75, 0.75, -1.0), (0.0, 0.0, 1.8)),  # the floor, and the roof
        ((-0.75, -0.3, -1.0), (0.0, 0.0, 1.3)),
    ):
        yield rotation @ np.array(corner), wide, rotation @ np.array(edge)
    for side in (-0.75, 0.75):
        door = np.array([side, 0.1, -1]), np.array([0, 0, 2.0]), np.array([0, 1.0, 0])
        first, second, third = (rotation @ each for each in door)
        yield first, second, third
    for left in (-0.65, 0.15):
        back = ahead - rng.uniform(0.45, 0.75)
        low = np.array([left, rng.uniform(-0.1, 0.45), back])
        yield from _box(rotation, low, np.array([left + 0.5, 0.75, back + 0.15]))


_SCENES = {
    "room": _room,
    "table": _table,
    "board": _board,
    "boxes": _boxes,
    "shelf": _shelf,
    "desk": _desk,
    "stairs": _stairs,
    "books": _books,
    "robot": _robot,
    "car": _car,
}


def main() -> None:
    """Print how many maps of each kind are ok, suspect, or without an angle."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 701
    total: Counter[str] = Counter()
    for number, kind in enumerate(KINDS):
        found: Counter[str] = Counter()
        for index in range(frames):
            disparity = roadless_map(kind, np.random.default_rng([seed, number, index]))
            try:
                found[estimate_roll(disparity.astype(np.float32)).status] += 1
            except EstimationError:
                found["error"] += 1
        total += found
        print(
            f"{kind:6} {found['ok']:3} ok  {found['suspect']:3} suspect  {found['error']:3} without an angle"
        )
    print(f"all    {total['ok']:3} ok of {total.total()}")


if __name__ == "__main__":
    main()
