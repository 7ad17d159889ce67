"""Which pixels are road: the plane that best explains what lies ahead of the rig.

Planes through triples of pixels are judged by what they leave unexplained. Three things tell a road from the
walls, verges and sky that may cover more of the image: nothing lies below a road; around each of its pixels
the map rises as the road itself does; and it is what the rig drives on, so it fills the corridor straight
ahead, a few camera heights wide. All three are measured in units of the hypothesis itself: they need neither
the focal length nor the scale of the disparities.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.sample import NO_SLOPE, Sample, Singles

_POOL_PIXELS = 4000  # triples are drawn of these
_DRAWS = 1024  # triples drawn; about half are planes that could be a road
_HYPOTHESES = 320
_FIRST_PIXELS = 320  # all hypotheses are judged on these,
_FIRST_BESIDE = 0.2
_OF_EACH_ROLL = 4
_SECOND = 24  # this many on the next,
_SECOND_PIXELS = 640
_REFINED = 4  # and these are fitted and judged on
_THIRD_PIXELS = 2000
_FITS = 4
_RADIUS = 0.35  # of a triple, in half image lengths
_MIN_AREA = 0.004  # twice the area of its triangle, to be well conditioned
_LEAST_RISE = 4.0  # tolerances that a road rises by within the radius
_BELOW = 0.85  # what a coherent pixel under the road costs beyond one that is merely not on it
_OFF_SLOPE = 0.2  # weight of a pixel around which the map does not rise as the road does
_SLOPE_SHARE = 0.4  # of the road's own slope: how far the map's may be off
_CORRIDOR = 1.0  # half-width, in camera heights; that of its core is 1 / sqrt(8) of it
_BESIDE = 0.03  # weight of a pixel far beside it
_NEAR = 1.5  # typical disparities: weights grow up to here, for what is near ahead is the road driven on
_HORIZON = 3.0  # half image lengths from the centre; a plane whose horizon is farther away is rather a wall
_LEAST, _LEAST_CORE = 0.05, 0.02  # shares of the pixels that the corridor and its core should weigh
_INCOHERENT = 0.3  # a pixel with less coherence is noise,
_AT_LEAST = 0.3  # where the road's disparity is at least this, in typical ones: farther away edges are close
RIVAL_ANGLE = math.radians(2)


@dataclass(frozen=True)
class Road:
    """The plane that was found.

    Attributes
    ----------
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y on the sample's grid.
    score : float
        The share of the road-like pixels ahead that lie on it, less those below it, up to 1: the mean of that
        in its corridor and of that in the core of it, of which a wide verge has nothing. Less for a plane
        that looks like a wall, since its horizon is far outside of the image.
    rival : float
        The best score of another plane: one whose roll differs by more than 2 degrees.
    noise : float
        The share of its corridor that is noise: pixels that differ from those around them.
    """

    plane: NDArray[np.float64]
    score: float
    rival: float
    noise: float

    @property
    def theta(self) -> float:
        """The plane's roll, radians."""
        return math.atan2(-self.plane[1], self.plane[2])


def find_road(sample: Sample, max_roll: float, seed: int) -> Road:
    """Find the plane of the road.

    Parameters
    ----------
    sample : Sample
    max_roll : float
        The largest abs(roll) considered, radians; more than 0, less than pi / 2.
    seed : int
        Of the triples drawn.

    Returns
    -------
    Road

    Raises
    ------
    EstimationError
        When no plane through the pixels rises downward in the image, as a road's disparity does.
    """
    planes = _planes(sample, max_roll, seed)
    if len(planes) == 0:
        raise EstimationError("no road: nowhere does the disparity grow downward, as it does on a road")
    planes = planes[_varied(_first_costs(sample, planes), _rolls(planes))]
    second = _Judge.of(sample, _SECOND_PIXELS)
    scores = second.scores(planes)
    third = _Judge.of(sample, _THIRD_PIXELS)
    fitted = third.fitted(planes[_shortlist(planes, scores)])
    kept = np.abs(fitted[:, 1]) <= math.tan(max_roll) * fitted[:, 2]
    fitted = fitted[kept] if kept.any() else planes[_best(-scores, 1)]
    final = third.scores(fitted)
    winner = int(np.argmax(final))
    rolls = _rolls(fitted)
    far = np.abs(rolls - rolls[winner]) > RIVAL_ANGLE
    # a plane that was not fitted may be the same road, badly drawn
    others = np.abs(_rolls(planes) - rolls[winner]) > 2 * RIVAL_ANGLE
    rival = max(final[far].max(initial=-1), scores[others].max(initial=-1))
    plane = fitted[winner].astype(np.float64)
    return Road(plane, float(final[winner]), float(rival), _noise_share(sample, plane))


def road_weights(sample: Sample, plane: NDArray[np.float64], near: NDArray[np.intp]) -> Singles:
    """Return 0.2 to 1 for each of some pixels: how well the map's slopes around it agree with the plane's."""
    one = plane[None].astype(np.float32)
    weights: Singles = _slope_weights(sample.slopes[:, near], sample.slope_noise, one)[0]
    return weights


def _planes(sample: Sample, max_roll: float, seed: int) -> Singles:
    """Return planes (K, 3) through triples of neighbouring coherent pixels, disparity growing downward."""
    few = slice(None, None, max(1, round(len(sample.d) / _POOL_PIXELS)))
    pool = np.flatnonzero((sample.coherence[few] >= 0.5) & _rising(sample.slopes[:, few])) * few.step
    if len(pool) < 3:
        return np.empty((0, 3), np.float32)
    column = sample.column[pool]
    pool = pool[np.argsort(column, kind="stable")]
    before = np.concatenate([[0], np.cumsum(np.bincount(column))])  # how many lie left of each column
    x, y, d = sample.x, sample.y, sample.d
    first, second, third = _draws(seed)
    central = pool[np.abs(x[pool]) < _RADIUS]  # the road is more likely there
    both = np.concatenate([pool, central])
    a = both[(first * len(both)).astype(np.intp)]
    at, reach = sample.column[a].astype(np.intp), int(_RADIUS / sample.pitch)
    from_ = before[np.maximum(at - reach, 0)]
    to = before[np.minimum(at + reach + 1, len(before) - 1)]
    b = pool[from_ + (second * (to - from_)).astype(np.intp)]
    c = pool[from_ + (third * (to - from_)).astype(np.intp)]
    x1, y1, d1 = x[b] - x[a], y[b] - y[a], d[b] - d[a]
    x2, y2, d2 = x[c] - x[a], y[c] - y[a], d[c] - d[a]
    area = x1 * y2 - x2 * y1
    wide = (np.abs(area) > _MIN_AREA) & (np.maximum(np.abs(y1), np.abs(y2)) < _RADIUS)
    area = np.where(wide, area, 1)
    c1, c2 = (d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area
    steep = c2 * _RADIUS > _LEAST_RISE * sample.tolerance[a]  # a wall's noise is not a road
    good = np.flatnonzero(wide & steep & (np.abs(c1) <= math.tan(max_roll) * c2))[:_HYPOTHESES]
    c1, c2, a = c1[good], c2[good], a[good]
    return np.stack([d[a] - c1 * x[a] - c2 * y[a], c1, c2], 1)


@lru_cache(maxsize=8)
def _draws(seed: int) -> NDArray[np.float64]:
    """Return three numbers in [0, 1) for each triple: shape (3, _DRAWS)."""
    return np.random.default_rng(seed).random((3, _DRAWS))


def _first_costs(sample: Sample, planes: Singles) -> Singles:
    """Return a cheap cost for each plane, with one guess of the road's slope for the corridor of all."""
    few = slice(None, None, max(1, round(len(sample.d) / _FIRST_PIXELS)))
    x, d = sample.x[few], sample.d[few]
    middle = len(planes) // 2
    side = np.square(x * np.partition(planes[:, 2], middle)[middle] / d)
    corridor = _FIRST_BESIDE + (1 - _FIRST_BESIDE) * np.exp(side * np.float32(-1 / _CORRIDOR**2))
    weight = np.where(_rising(sample.slopes[:, few]), corridor, corridor * np.float32(_OFF_SLOPE))
    scaled = np.stack([np.ones_like(x), x, sample.y[few], d]) / sample.tolerance[few]
    costs: Singles = _excess(planes, scaled, _caps(sample.coherence[few])) @ weight
    return costs


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


def _rising(slopes: Singles) -> NDArray[np.bool_]:
    """Return where the disparity grows downward, above the pixel or below it."""
    up, down = slopes[2:]
    rising: NDArray[np.bool_] = ((up > 0) & (up < NO_SLOPE)) | ((down > 0) & (down < NO_SLOPE))
    return rising


@dataclass(frozen=True)
class _Judge:
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
    def of(cls, sample: Sample, pixels: int) -> _Judge:
        few = slice(None, None, max(1, round(len(sample.d) / pixels)))
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
            ridge = 1e-9 * np.trace(sums, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 1e-30 * np.eye(3)
            planes = np.linalg.solve(sums[..., :3] + ridge, sums[..., 3:])[..., 0].astype(np.float32)
        return planes

    def _weights(self, planes: Singles) -> tuple[Singles, Singles, Singles]:
        """Return, for each plane and pixel, the agreement of slopes and the places in core and corridor."""
        c1, c2 = planes[:, 1:2], planes[:, 2:3]
        # x' / d in units of the plane's slope is the way to the side in camera heights, whatever the rig
        side = np.square((self.x * c2 - self.y * c1) / self.d)
        corridor = np.exp(side * np.float32(-1 / _CORRIDOR**2))
        core = np.square(np.square(np.square(corridor)))
        corridor += core
        corridor *= np.float32((1 - _BESIDE) / 2)
        corridor += np.float32(_BESIDE)
        core *= self.near
        corridor *= self.near
        return _slope_weights(self.slopes, self.slope_noise, planes), core, corridor


def _explained(excess: Singles, slope: Singles, place: Singles, least: float) -> Singles:
    """Return (K,): the share of the road-like pixels of a place that lie on each plane, less those below."""
    reached = place * slope
    lost = np.einsum("kn,kn->k", np.where(excess < 0, reached, place), excess)
    shares: Singles = -lost / (reached.sum(1) + np.float32(least * place.shape[1]))
    return shares


def _noise_share(sample: Sample, plane: NDArray[np.float64]) -> float:
    """Return the share of the plane's corridor in which neighbouring pixels disagree."""
    few = slice(None, None, max(1, len(sample.d) // _THIRD_PIXELS))
    c0, c1, c2 = plane
    x, y = sample.x[few], sample.y[few]
    road = c0 + c1 * x + c2 * y
    seen = road > _AT_LEAST * sample.typical
    side = (x * c2 - y * c1)[seen] / road[seen]  # by the road's disparity, for that of noise says nothing
    weight = np.exp(-np.square(side / _CORRIDOR))
    noisy = weight @ (sample.coherence[few][seen] < _INCOHERENT)
    return float(noisy / weight.sum()) if weight.sum() > 0 else 1.0


def _slope_weights(slopes: Singles, slope_noise: float, planes: Singles) -> Singles:
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


def _varied(costs: Singles, rolls: Singles) -> NDArray[np.intp]:
    """Return the cheapest planes, few of each roll: a wide verge must not crowd out the road."""
    order = _best(costs, len(costs))
    bins = np.floor(rolls[order] / RIVAL_ANGLE).astype(np.int64)
    by_bin = np.argsort(bins, kind="stable")
    starts = np.searchsorted(bins[by_bin], bins[by_bin])
    rank = np.empty_like(by_bin)
    rank[by_bin] = np.arange(len(order)) - starts
    return order[rank < _OF_EACH_ROLL][:_SECOND]


def _shortlist(planes: Singles, scores: Singles) -> NDArray[np.intp]:
    """Return the best few, one of them a rival of the best: it may win once fitted."""
    order = _best(-scores, len(scores))
    rolls = _rolls(planes)
    rivals = order[np.abs(rolls[order] - rolls[order[0]]) > RIVAL_ANGLE]
    return np.concatenate([order[: _REFINED - 1], rivals[:1]])


def _rolls(planes: Singles) -> Singles:
    return np.arctan2(-planes[:, 1], planes[:, 2])


def _best(costs: Singles, count: int) -> NDArray[np.intp]:
    return np.argsort(costs, kind="stable")[:count]
