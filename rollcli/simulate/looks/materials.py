"""Materials: albedo at texture coordinates in metres, averaged over the pixel."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rollcli.simulate.looks.texture import Values, band, bars, cell, coarse, fine

Tint = tuple[float, float, float]  # blue, green, red; multiplies the albedo

GREY: Tint = (1.0, 1.0, 1.0)
WARM: Tint = (0.95, 0.98, 1.0)


class Material(Protocol):
    """The appearance of a surface."""

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        """Return the reflectance, 0 to 1, at (p, q) metres, averaged over `w` metres."""

    def colour(self, p: Values, q: Values) -> Values:
        """Return the factors of the albedo in blue, green and red: (3,) or (N, 3)."""


@dataclass(frozen=True, kw_only=True)
class _Tinted:
    """A material of one colour; `offset` shifts its noise, so that no two look alike."""

    tint: Tint = GREY
    offset: float = 0.0

    def colour(self, p: Values, q: Values) -> Values:
        return np.array(self.tint, np.float32)


@dataclass(frozen=True)
class Plain(_Tinted):
    """One albedo with grain and blotches, and with joints every `joint` metres where that is not 0."""

    level: float
    grain: float = 0.1
    blotch: float = 0.1
    joint: float = 0.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        noise = self.grain * fine(p, q, w, self.offset) + self.blotch * coarse(p, q, w, self.offset)
        base = self.level * np.maximum(1 + noise, 0.1)
        if self.joint:
            base = base * (1 - 0.6 * np.maximum(bars(p, self.joint, 0.015, w), bars(q, self.joint, 0.015, w)))
        return np.asarray(base, np.float32)


@dataclass(frozen=True)
class Leaves(_Tinted):
    """Grass, foliage, far trees: strong blotches of every size; `scale` above 1 makes them finer."""

    level: float
    contrast: float = 0.35
    scale: float = 1.0

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        p, q, w = p * np.float32(self.scale), q * np.float32(self.scale), w * np.float32(self.scale)
        noise = self.contrast * (fine(p, q, w, self.offset) + coarse(p, q, w, self.offset))
        return np.asarray(self.level * np.clip(1 + noise, 0.15, 2.5), np.float32)


@dataclass(frozen=True)
class Mark:
    """A painted line at `lateral`, with a dash of `dash` metres every `period` metres; 0: a solid line."""

    lateral: float
    width: float
    period: float = 0.0
    dash: float = 0.0


@dataclass(frozen=True)
class Patch:
    """A rectangle of the road, mended or worn, whose albedo changes by the share `change`."""

    left: float
    right: float
    start: float
    end: float
    change: float


@dataclass(frozen=True)
class Asphalt(_Tinted):
    """Road: grain, wheel tracks, patches, wandering tar lines, worn paint. p is lateral, q along.

    `wheels` are the lateral position of one wheel track and the distance between them, metres.
    """

    level: float
    grain: float = 0.16
    wheels: tuple[float, float] = (0.0, 1.8)
    marks: tuple[Mark, ...] = ()
    patches: tuple[Patch, ...] = ()
    seams: tuple[float, ...] = ()

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        grain, blotch = fine(p, q, w, self.offset), coarse(p, q, w, self.offset)
        base = 1 + np.float32(self.grain) * grain + np.float32(0.12) * blotch
        track, spacing = self.wheels
        base -= np.float32(0.25) * bars(
            p - np.float32(track - 0.25), spacing, 0.5, np.maximum(w, np.float32(0.6))
        )
        for patch in self.patches:
            at = np.flatnonzero((p > patch.left - 0.2) & (p < patch.right + 0.2))
            inside = band(p[at], patch.left, patch.right, w[at]) * band(q[at], patch.start, patch.end, w[at])
            base[at] += np.float32(patch.change) * inside
        for seam in self.seams:
            # the line of tar follows the blotches of the surface to the left and right
            at = np.flatnonzero(np.abs(p - np.float32(seam)) < 0.6)
            place = p[at] + np.float32(0.12) * blotch[at]
            base[at] *= 1 - np.float32(0.45) * band(place, seam - 0.02, seam + 0.02, w[at])
        base = self.level * np.maximum(base, np.float32(0.15))
        wear = np.clip(0.8 + 0.18 * grain + 0.15 * blotch, 0, 1)
        for mark in self.marks:
            at = np.flatnonzero(np.abs(p - np.float32(mark.lateral)) < mark.width + w)
            paint = wear[at] * band(p[at] - np.float32(mark.lateral), -mark.width / 2, mark.width / 2, w[at])
            if mark.period:
                paint *= bars(q[at], mark.period, mark.dash, w[at])
            base[at] += paint * (np.float32(0.75) - base[at])
        return np.asarray(base, np.float32)


@dataclass(frozen=True)
class Paving(_Tinted):
    """Slabs of a sidewalk with joints between them; each slab has a brightness of its own."""

    level: float
    slab: float

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        noise = 0.1 * fine(p, q, w, self.offset) + 0.1 * coarse(p, q, w, self.offset)
        own = cell(np.floor(p / self.slab), np.floor(q / self.slab)) - 0.5
        joints = np.maximum(bars(p, self.slab, 0.015, w), bars(q, self.slab, 0.015, w))
        # slabs smaller than a pixel average out
        base = 1 + noise + 0.25 * own * np.clip(1.5 - w / self.slab, 0, 1)
        return np.asarray(self.level * np.maximum(base * (1 - 0.6 * joints), 0.1), np.float32)


@dataclass(frozen=True)
class CarPaint(_Tinted):
    """Body panels: a smooth paint with dark joints, a sill and reflections."""

    level: float

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        sheen = 1 + 0.12 * coarse(p * 3, q * 3, w * 3, self.offset) + 0.03 * fine(p, q, w, self.offset)
        sill = 1 - 0.5 * band(q, 0.0, 0.38, w)
        joints = 1 - 0.5 * bars(p + 10, 1.05, 0.02, w)
        waist = 1 + 0.35 * band(q, 0.70, 0.76, w)
        return np.asarray(np.maximum(self.level * sheen * sill * joints * waist, 0.015), np.float32)


@dataclass(frozen=True)
class Glass(_Tinted):
    """Car windows: dark, with a blurred mirror image and pillars."""

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        mirror = 0.09 + 0.06 * coarse(p * 5, q * 5, w * 5, self.offset)
        pillar = bars(p + 10, 1.1, 0.07, w)
        return np.asarray(np.maximum(mirror * (1 - 0.7 * pillar), 0.01), np.float32)
