"""Noise and edges averaged over a pixel: the components of textures.

A pixel on a distant road covers metres of it along the driving direction. Detail finer than a pixel must be
averaged, not sampled: aliased detail would differ between the two views and mislead a stereo matcher.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float32]

_SIDE = 512  # texels of a tile, a power of two: wrapping is a bit mask


class NoiseTile:
    """Periodic noise of unit variance as a pyramid of averages: texels of level k are 2^k times as large."""

    def __init__(self, seed: int, slope: float, longest: float) -> None:
        """Make noise with amplitudes of frequency^-slope, without waves longer than `longest` texels."""
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
        self._table = np.concatenate(levels)
        sides = _SIDE >> np.arange(len(levels))
        self._starts = np.concatenate([[0], np.cumsum(sides**2)[:-1]]).astype(np.int32)
        self._bits = np.log2(sides).astype(np.int32)
        self._scales = (sides / _SIDE).astype(np.float32)
        self._masks = (sides - 1).astype(np.int32)

    def sample(self, x: Values, y: Values, level: NDArray[np.int32]) -> Values:
        """Return the noise at (x, y), texels of level 0, averaged over 2^level texels; bilinear."""
        level = np.minimum(np.maximum(level, 0), len(self._starts) - 1)
        start, bits, mask = (table[level] for table in (self._starts, self._bits, self._masks))
        scale = self._scales[level]
        x, y = x * scale - np.float32(0.5), y * scale - np.float32(0.5)
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
    return NoiseTile(1, 0.75, 80.0), NoiseTile(2, 1.1, float(_SIDE))


FINE_TEXEL, COARSE_TEXEL = 0.006, 0.1  # metres


def fine(p: Values, q: Values, w: Values, offset: float = 0.0) -> Values:
    """Return grain from 1 cm to half a metre, of unit variance, at (p, q) metres averaged over `w` metres."""
    # rotated against the road, so that no row of texels runs along it
    x, y = 0.946 * p + 0.324 * q, 0.946 * q - 0.324 * p
    return _sample(_tiles()[0], x + np.float32(offset), y, w, FINE_TEXEL)


def coarse(p: Values, q: Values, w: Values, offset: float = 0.0) -> Values:
    """Return patches from 20 cm to 50 m, of unit variance, at (p, q) metres averaged over `w` metres."""
    x, y = 0.79 * p - 0.613 * q, 0.79 * q + 0.613 * p
    return _sample(_tiles()[1], x + np.float32(offset), y, w, COARSE_TEXEL)


def _sample(tile: NoiseTile, x: Values, y: Values, w: Values, texel: float) -> Values:
    # rint(log2(w / texel)) from the exponent bits of a float32, which is several times faster
    level = ((w * np.float32(np.sqrt(2) / texel)).view(np.int32) >> 23) - np.int32(127)
    scale = np.float32(1 / texel)
    return tile.sample(x * scale, y * scale, level)


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
