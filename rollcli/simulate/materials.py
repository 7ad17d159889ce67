"""What surfaces look like: albedo at texture coordinates in metres, averaged over the pixel."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rollcli.simulate.texture import Values, band, bars, coarse, fine

Tint = tuple[float, float, float]  # blue, green, red; multiplies the albedo

NEUTRAL: Tint = (1.0, 1.0, 1.0)


class Material(Protocol):
    """The look of a surface."""

    @property
    def tint(self) -> Tint:
        """Colour of the whole surface."""

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        """Reflectance, 0 to 1, at (p, q) metres averaged over `w` metres."""


@dataclass(frozen=True)
class Plain:
    """One albedo with grain and blotches: kerb stone, grass, bark, metal, tyres."""

    level: float
    grain: float = 0.1
    blotch: float = 0.1
    tint: Tint = NEUTRAL
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        noise = self.grain * fine(p, q, w, self.offset) + self.blotch * coarse(p, q, w, self.offset)
        return np.asarray(self.level * np.maximum(1 + noise, 0.1), np.float32)


@dataclass(frozen=True)
class Mark:
    """A painted line at `lateral`; dashes of `dash` metres each `period`, or solid when that is 0."""

    lateral: float
    width: float
    period: float = 0.0
    dash: float = 0.0


@dataclass(frozen=True)
class Patch:
    """A mended rectangle of the road."""

    left: float
    right: float
    start: float
    end: float
    change: float


@dataclass(frozen=True)
class Asphalt:
    """Road: grain, wheel tracks, patches, wandering tar lines, worn paint. p is lateral, q along."""

    level: float
    tracks: tuple[float, ...] = ()
    marks: tuple[Mark, ...] = ()
    patches: tuple[Patch, ...] = ()
    seams: tuple[float, ...] = ()
    tint: Tint = (1.0, 0.98, 0.96)
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        grain, blotch = fine(p, q, w, self.offset), coarse(p, q, w, self.offset)
        base = 1 + 0.16 * grain + 0.12 * blotch
        for track in self.tracks:
            base -= 0.12 * np.exp(-(((p - np.float32(track)) / np.float32(0.35)) ** 2))
        for patch in self.patches:
            base += patch.change * band(p, patch.left, patch.right, w) * band(q, patch.start, patch.end, w)
        for seam in self.seams:
            # a line of tar that wanders with the blotches of the surface
            base *= 1 - 0.45 * band(p + 0.12 * blotch, seam - 0.02, seam + 0.02, w)
        base = self.level * np.maximum(base, np.float32(0.15))
        wear = np.clip(0.8 + 0.18 * grain + 0.15 * blotch, 0, 1)
        for mark in self.marks:
            paint = band(p, mark.lateral - mark.width / 2, mark.lateral + mark.width / 2, w) * wear
            if mark.period:
                paint = paint * bars(q, mark.period, mark.dash, w)
            base += paint * (0.75 - base)
        return np.asarray(base, np.float32)


@dataclass(frozen=True)
class Paving:
    """Sidewalk slabs with joints, each slab of its own brightness."""

    level: float
    slab: float
    tint: Tint = (0.95, 0.98, 1.0)
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        noise = 0.1 * fine(p, q, w, self.offset) + 0.1 * coarse(p, q, w, self.offset)
        own = _cell(np.floor(p / self.slab), np.floor(q / self.slab)) - 0.5
        joints = np.maximum(bars(p, self.slab, 0.015, w), bars(q, self.slab, 0.015, w))
        # slabs smaller than the pixel average out
        base = 1 + noise + 0.25 * own * np.clip(1.5 - w / self.slab, 0, 1)
        return np.asarray(self.level * np.maximum(base * (1 - 0.6 * joints), 0.1), np.float32)


@dataclass(frozen=True)
class Facade:
    """House fronts, one look a section: plaster, plinth, rows of windows. p is along the street, q up."""

    edges: Values
    levels: Values
    storeys: Values
    bays: Values
    tint: Tint = (0.88, 0.95, 1.0)
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        house = np.clip(np.searchsorted(self.edges, p) - 1, 0, len(self.levels) - 1)
        storey, bay = self.storeys[house], self.bays[house]
        noise = 0.07 * fine(p, q, w, self.offset) + 0.12 * coarse(p, q, w, self.offset)
        wall = self.levels[house] * np.maximum(1 + noise, np.float32(0.2))
        start = self.edges[house]
        along, up = (p - start) / bay, (q - np.float32(0.2)) / storey
        column, row = np.floor(along), np.floor(up)
        x, y = (along - column) * bay, (up - row) * storey
        frame = band(x, 0.26 * bay, 0.74 * bay, w) * band(y, 0.28 * storey, 0.82 * storey, w)
        glass = band(x, 0.30 * bay, 0.70 * bay, w) * band(y, 0.31 * storey, 0.79 * storey, w)
        glass = glass * (1 - 0.8 * band(x, 0.49 * bay, 0.51 * bay, w))
        pane = 0.05 + 0.22 * _cell(column + 31 * house, row) * (0.4 + 0.6 * y / storey)
        pane *= 1 + 0.25 * coarse(p, q, w, self.offset + 7)
        wall += frame * (np.float32(0.6) - wall)
        wall += glass * (pane - wall)
        plinth = band(q, -5.0, 0.5, w)
        ledge = bars(q - np.float32(0.2), 3.0, 0.12, w)
        wall = wall * (1 - 0.4 * plinth) * (1 - 0.15 * ledge)
        return np.asarray(np.maximum(wall, np.float32(0.02)), np.float32)


@dataclass(frozen=True)
class CarPaint:
    """Body panels: a smooth paint with dark joints, a sill and reflections."""

    level: float
    tint: Tint = NEUTRAL
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        sheen = 1 + 0.12 * coarse(p * 3, q * 3, w * 3, self.offset) + 0.03 * fine(p, q, w, self.offset)
        sill = 1 - 0.5 * band(q, 0.0, 0.38, w)
        joints = 1 - 0.5 * bars(p + 10, 1.05, 0.02, w)
        waist = 1 + 0.35 * band(q, 0.70, 0.76, w)
        return np.asarray(np.maximum(self.level * sheen * sill * joints * waist, 0.015), np.float32)


@dataclass(frozen=True)
class Glass:
    """Car windows: dark, with a blurred mirror image and pillars."""

    tint: Tint = (1.05, 1.0, 0.95)
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        mirror = 0.09 + 0.06 * coarse(p * 5, q * 5, w * 5, self.offset)
        pillar = bars(p + 10, 1.1, 0.07, w)
        return np.asarray(np.maximum(mirror * (1 - 0.7 * pillar), 0.01), np.float32)


@dataclass(frozen=True)
class Leaves:
    """Foliage and far trees: blotches at every scale."""

    level: float
    tint: Tint = (0.55, 1.0, 0.75)
    scale: float = 1.0
    offset: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        s = np.float32(self.scale)
        noise = 0.35 * fine(p * s, q * s, w * s, self.offset) + 0.35 * coarse(
            p * s, q * s, w * s, self.offset
        )
        return np.asarray(self.level * np.clip(1 + noise, 0.15, 2.5), np.float32)


def _cell(column: Values, row: Values) -> Values:
    """A number in [0, 1) that belongs to a cell of a grid."""
    mixed = np.sin(column * np.float32(12.9898) + row * np.float32(78.233)) * np.float32(437.5453)
    return np.asarray(mixed - np.floor(mixed), np.float32)
