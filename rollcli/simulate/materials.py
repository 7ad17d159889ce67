"""Materials: texture and albedo at coordinates in metres, averaged over the pixel."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float32]

_BITS = 9
_SIDE = 1 << _BITS  # texels of a tile, a power of two: wrapping is a bit mask


class NoiseTile:
    """Periodic noise of unit variance as a pyramid of averages: texels of level k are 2^k times as large."""

    def __init__(self, seed: int, slope: float, longest: float, texel: float) -> None:
        """Make noise with amplitudes of frequency^-slope, without waves longer than `longest` texels.

        Parameters
        ----------
        texel : float
            The side of a texel of level 0, metres.
        """
        rng = np.random.default_rng(seed)
        fy, fx = np.fft.fftfreq(_SIDE)[:, None], np.fft.rfftfreq(_SIDE)[None]
        frequency = np.hypot(fy, fx)
        frequency[0, 0] = 1.0
        keep = frequency > 1 / longest
        keep[0, 0] = False
        white = np.fft.rfft2(rng.standard_normal((_SIDE, _SIDE)))
        level = np.fft.irfft2(white * np.where(keep, frequency**-slope, 0.0), (_SIDE, _SIDE))
        level /= level.std()
        levels = []
        while level.shape[0] >= 2:
            levels.append(level.astype(np.float32).ravel())
            level = level.reshape(level.shape[0] // 2, 2, -1, 2).mean(axis=(1, 3))
        self._table, self._texel = np.concatenate(levels), texel
        self._starts = np.cumsum([0, *(each.size for each in levels)], dtype=np.int32)[:-1]

    def sample(self, x: Values, y: Values, w: Values) -> Values:
        """Return the noise at (x, y) metres averaged over about `w` metres; bilinear."""
        # rint(log2(w / texel)) from the exponent bits of a float32, which is several times faster
        level = ((w * np.float32(np.sqrt(2) / self._texel)).view(np.int32) >> 23) - np.int32(127)
        level = np.minimum(np.maximum(level, 0), len(self._starts) - 1)
        start, bits = self._starts[level], np.int32(_BITS) - level
        mask, scale = (np.int32(1) << bits) - np.int32(1), np.ldexp(np.float32(1), -level)
        x, y = (each * np.float32(1 / self._texel) * scale - np.float32(0.5) for each in (x, y))
        floor_x, floor_y = np.floor(x), np.floor(y)
        wx, wy = x - floor_x, y - floor_y
        column, row = floor_x.astype(np.int32) & mask, floor_y.astype(np.int32) & mask
        right = (column + np.int32(1)) & mask
        above, below = start + (row << bits), start + (((row + np.int32(1)) & mask) << bits)
        table = self._table
        top = table[above + column]
        top += wx * (table[above + right] - top)
        bottom = table[below + column]
        bottom += wx * (table[below + right] - bottom)
        top += wy * (bottom - top)
        return np.asarray(top)


@lru_cache(maxsize=1)
def _tiles() -> tuple[NoiseTile, NoiseTile]:
    # no long waves in the fine tile: its period would be visible; the coarse tile has them
    return NoiseTile(1, 0.75, 80.0, 0.006), NoiseTile(2, 1.1, float(_SIDE), 0.1)


def fine(p: Values, q: Values, w: Values, offset: float = 0.0) -> Values:
    """Return grain from 1 cm to half a metre, of unit variance, at (p, q) metres averaged over `w` metres."""
    # rotated against the road, so that no row of texels runs along it
    x, y = 0.946 * p + 0.324 * q, 0.946 * q - 0.324 * p
    return _tiles()[0].sample(x + np.float32(offset), y, w)


def coarse(p: Values, q: Values, w: Values, offset: float = 0.0) -> Values:
    """Return patches from 20 cm to 50 m, of unit variance, at (p, q) metres averaged over `w` metres."""
    x, y = 0.79 * p - 0.613 * q, 0.79 * q + 0.613 * p
    return _tiles()[1].sample(x + np.float32(offset), y, w)


def band(x: Values, low: float | Values, high: float | Values, w: Values) -> Values:
    """Return the share of a pixel of width `w` at `x` that lies between `low` and `high`."""
    half = w / 2
    covered = np.minimum(x + half, high) - np.maximum(x - half, low)
    return np.asarray(np.maximum(covered, np.float32(0)) / w, np.float32)


def bars(x: Values, period: float, width: float, w: Values) -> Values:
    """Return the share of a pixel of width `w` at `x` that bars of `width`, one every `period`, cover."""

    # the difference of integrals of the pattern is exact for a pixel of any width
    def integral(t: NDArray[np.floating[Any]]) -> Values:
        whole = np.floor(t / np.float32(period))
        rest = np.minimum(t - whole * np.float32(period), np.float32(width))
        return np.asarray(whole * np.float32(width) + rest, np.float32)

    half = w * np.float32(0.5)
    return np.asarray((integral(x + half) - integral(x - half)) / w, np.float32)


def cell(column: Values, row: Values) -> Values:
    """Return a pseudo-random number in [0, 1) for each cell of a grid."""
    # the usual hash of shaders, in float64: in float32 its sine would differ between platforms
    mixed = np.sin(column * 12.9898 + row * 78.233) * 43758.5453
    return np.asarray(mixed - np.floor(mixed), np.float32)


_RIM = np.float32(0.1)  # the width of window frames, metres


@dataclass(frozen=True)
class Facade:
    """A row of houses; p runs along the street, q up from the sidewalk.

    House i stands between edges[i] and edges[i + 1]. It has an albedo, a tint (N, 3), a height of its storeys
    and a width of its bays, both in metres; each bay of a storey has one window.
    """

    offset: float
    edges: Values
    levels: Values
    tints: Values
    storeys: Values
    bays: Values

    def _house(self, p: Values) -> NDArray[Any]:
        return np.clip(np.searchsorted(self.edges, p) - 1, 0, len(self.levels) - 1)

    def colour(self, p: Values, q: Values) -> Values:
        return np.asarray(self.tints[self._house(p)])

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        house = self._house(p)
        level, storey, bay = self.levels[house], self.storeys[house], self.bays[house]
        grain, blotch = fine(p, q, w, self.offset), coarse(p, q, w, self.offset)
        wall = level * np.maximum(1 + np.float32(0.07) * grain + np.float32(0.12) * blotch, np.float32(0.2))
        along, up = (p - self.edges[house]) / bay, q / storey
        column, row = np.floor(along), np.floor(up)
        x, y, own = (along - column) * bay, (up - row) * storey, cell(column + 31 * house, row)
        # one bay in six of the ground floor has a door instead of a window
        door = (row == 0) & (own < 0.17)
        low = np.where(door, np.float32(-1), np.float32(0.31) * storey)
        left, right, high = 0.30 * bay, 0.70 * bay, 0.79 * storey
        glass = band(x, left, right, w) * band(y, low, high, w)
        frame = band(x, left - _RIM, right + _RIM, w) * band(y, low - _RIM, high + _RIM, w) - glass
        glass *= 1 - 0.8 * band(x, 0.49 * bay, 0.51 * bay, w)
        pane = (0.04 + 0.2 * own * y / storey) * (1 + 0.5 * np.clip(blotch, -1, 1))
        wall += np.maximum(frame, 0) * (np.float32(0.65) - wall)
        wall += glass * (np.where(door, np.float32(0.12), pane) - wall)
        wall *= 1 - 0.35 * band(q, -9.0, 0.5, w) * (1 - glass)
        wall *= 1 - 0.2 * bars(q + np.float32(0.1), 3.1, 0.14, w)
        return np.asarray(np.maximum(wall, np.float32(0.02)), np.float32)


Tint = tuple[float, float, float]  # blue, green, red; multiplies the albedo

GREY: Tint = (1.0, 1.0, 1.0)
WARM: Tint = (0.95, 0.98, 1.0)


class Material(Protocol):
    """The appearance of a surface."""

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        """Return the reflectance, 0 to 1, at (p, q) metres, averaged over `w` metres."""

    def colour(self, p: Values, q: Values) -> Values:
        """Return the factors of the albedo in blue, green and red: (3,) or (N, 3)."""


@dataclass(frozen=True)
class _Tinted:
    """A material of one colour, with an albedo; `offset` shifts its noise, so that no two look alike."""

    level: float
    _: KW_ONLY
    tint: Tint = GREY
    offset: float = 0.0

    def colour(self, p: Values, q: Values) -> Values:
        return np.array(self.tint, np.float32)


@dataclass(frozen=True)
class Plain(_Tinted):
    """One albedo with grain and blotches, and with joints every `joint` metres where that is not 0."""

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

    grain: float = 0.16
    wheels: tuple[float, float] = (0.0, 1.8)
    marks: Sequence[Mark] = ()
    patches: Sequence[Patch] = ()
    seams: Sequence[float] = ()

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
        mirror = self.level + 0.06 * coarse(p * 5, q * 5, w * 5, self.offset)
        pillar = bars(p + 10, 1.1, 0.07, w)
        return np.asarray(np.maximum(mirror * (1 - 0.7 * pillar), 0.01), np.float32)
