"""How well planes explain what lies ahead of the rig; see `road`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rollcli.estimator.road.subsample import Sample, Singles, rising

CORRIDOR = 1.0  # half-width, in camera heights; that of its core is 1 / sqrt(8) of it
_FITS = 4
_BELOW = 0.85  # what a coherent pixel under the road costs beyond one that is merely not on it
_OFF_SLOPE = 0.2  # weight of a pixel around which the map does not rise as the road does
_SLOPE_SHARE = 0.4  # of the road's own slope: how far the map's may be off
_BESIDE = 0.03  # weight of a pixel far beside it
_NEAR = 1.5  # typical disparities: weights grow up to here, for what is near ahead is the road driven on
_HORIZON = 2.0  # half image lengths from the centre; a plane whose horizon is farther away is rather a wall
_RIDGE, _TINY = 1 + 1e-8 * np.eye(3), 1e-30 * np.eye(3)
_LEAST, _LEAST_CORE = 0.05, 0.02  # shares of the pixels that the corridor and its core should weigh


def first_costs(sample: Sample, planes: Singles, pixels: int) -> Singles:
    """Return a cheap cost for each plane, with one guess of the road's slope for the corridor of all."""
    few = sample.about(pixels)
    x, d = sample.x[few], sample.d[few]
    middle = len(planes) // 2
    side = np.square(x * np.partition(planes[:, 2], middle)[middle] / d)
    corridor = _BESIDE + (1 - _BESIDE) * np.exp(side * np.float32(-1 / CORRIDOR**2))
    weight = np.where(rising(sample.slopes[:, few]), corridor, corridor * np.float32(_OFF_SLOPE))
    scaled = np.stack([np.ones_like(x), x, sample.y[few], d]) / sample.tolerance[few]
    costs: Singles = _excess(planes, scaled, _caps(sample.coherence[few])) @ weight
    return costs


@dataclass(frozen=True)
class Judge:
    """Some of a sample's pixels, laid out for judging many planes at once."""

    x: Singles
    y: Singles
    d: Singles
    scaled: Singles  # 1, x, y, d over the tolerance, shape (4, N)
    caps: Singles
    near: Singles  # weights of mean 1
    slopes: Singles
    slope_noise: float

    @classmethod
    def of(cls, sample: Sample, pixels: int) -> Judge:
        few = sample.about(pixels)
        x, y, d = sample.x[few], sample.y[few], sample.d[few]
        scaled = np.stack([np.ones_like(x), x, y, d]) / sample.tolerance[few]
        near = np.minimum(d, np.float32(_NEAR * sample.typical))
        near /= near.mean()
        caps = _caps(sample.coherence[few])
        return cls(x, y, d, scaled, caps, near, sample.slopes[:, few], sample.slope_noise)

    def scores(self, planes: Singles) -> Singles:
        """Return the score of each plane (K, 3); see `Road.score`."""
        excess = _excess(planes, self.scaled, self.caps)
        excess -= 1
        slope, core, corridor = self._weights(planes)
        scores = _explained(excess, slope, core, _LEAST_CORE) + _explained(excess, slope, corridor, _LEAST)
        scores /= 2
        rise = np.square(planes[:, 1]) + np.square(planes[:, 2])
        steep = np.square(planes[:, 0]) / np.maximum(rise, np.float32(1e-30))
        return np.where(scores > 0, scores / (1 + steep * np.float32(_HORIZON**-2)), scores)

    def fitted(self, planes: Singles) -> Singles:
        """Fit each plane (K, 3) to the pixels on it, a few times over."""
        slope, _, corridor = self._weights(planes)
        fixed = slope * corridor
        products = (self.scaled[:3, None] * self.scaled[None]).reshape(12, -1)
        for fit in range(_FITS):
            off = np.square(_residuals(planes, self.scaled))
            weight = fixed * np.maximum(0, 1 - off * np.float32(0.25 if fit == 0 else 1))
            sums = (weight @ products.T).astype(np.float64).reshape(-1, 3, 4)
            planes = np.linalg.solve(sums[..., :3] * _RIDGE + _TINY, sums[..., 3:])[..., 0].astype(np.float32)
        return planes

    def _weights(self, planes: Singles) -> tuple[Singles, Singles, Singles]:
        """Return, for each plane and pixel, the agreement of slopes and the places in core and corridor."""
        c1, c2 = planes[:, 1:2], planes[:, 2:3]
        # x' / d in units of the plane's slope is the way to the side in camera heights, whatever the rig
        side = np.square((self.x * c2 - self.y * c1) / self.d)
        corridor = np.exp(side * np.float32(-1 / CORRIDOR**2))
        core = np.square(np.square(np.square(corridor)))
        corridor += core
        corridor *= np.float32((1 - _BESIDE) / 2)
        corridor += np.float32(_BESIDE)
        core *= self.near
        corridor *= self.near
        return slope_weights(self.slopes, self.slope_noise, planes), core, corridor


def slope_weights(slopes: Singles, slope_noise: float, planes: Singles) -> Singles:
    """Return (K, N) weights: the map's one-sided slopes, the better of each pair, against the planes'."""
    c1, c2 = planes[:, 1:2], planes[:, 2:3]
    left, right, up, down = slopes
    apart: Singles = np.square(np.minimum(np.abs(left - c1), np.abs(right - c1)))
    apart += np.square(np.minimum(np.abs(up - c2), np.abs(down - c2)))
    apart *= -0.5 / (np.float32(_SLOPE_SHARE**2) * (c1 * c1 + c2 * c2) + np.float32(slope_noise**2))
    np.exp(apart, out=apart)
    apart *= np.float32(1 - _OFF_SLOPE)
    apart += np.float32(_OFF_SLOPE)
    return apart


def _explained(excess: Singles, slope: Singles, place: Singles, least: float) -> Singles:
    """Return (K,): the share of the road-like pixels of a place that lie on each plane, less those below."""
    reached = place * slope
    lost = np.einsum("kn,kn->k", np.where(excess < 0, reached, place), excess)
    shares: Singles = -lost / (reached.sum(1) + np.float32(least * place.shape[1]))
    return shares


def _excess(planes: Singles, scaled: Singles, caps: Singles) -> Singles:
    """Return squared residuals in tolerances (K, N), at most 1 above a plane and more below it."""
    off = _residuals(planes, scaled)
    np.minimum(off, caps, out=off)
    np.maximum(off, -1, out=off)
    np.square(off, out=off)
    return off


def _residuals(planes: Singles, scaled: Singles) -> Singles:
    """Return plane minus disparity in tolerances, (K, N); `scaled` holds 1, x, y and d."""
    minus = np.full((len(planes), 1), -1, np.float32)
    residuals: Singles = np.concatenate([planes, minus], 1) @ scaled
    return residuals


def _caps(coherence: Singles) -> Singles:
    caps: Singles = np.sqrt(1 + np.float32(_BELOW) * coherence)
    return caps
