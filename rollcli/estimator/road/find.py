"""Which pixels are road: the plane that best explains what lies ahead of the rig.

Planes through triples of pixels are judged by what they leave unexplained. Three things tell a road from the
walls, verges and sky that may cover more of the image: nothing lies below a road; around each of its pixels
the map rises as the road itself does; and it is what the rig drives on, so it fills the corridor straight
ahead, a few camera heights wide. All three are measured in units of the hypothesis itself: they need neither
the focal length nor the scale of the disparities.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.least_squares import solve_normal
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.sample import Sample, Singles, every, rising, take_sample
from rollcli.estimator.tuning import ScoreTuning, SearchTuning


def draw_planes(sample: Sample, max_roll: float, seed: int) -> Singles:
    """Return planes (K, 3) through triples of neighbouring coherent pixels, disparity growing downward."""
    tuning, radius = sample.tuning.hypotheses, sample.tuning.hypotheses.radius
    coarse = sample.coarse
    coherent = coarse.coherence >= sample.tuning.sample.coherent_from
    pool = (coherent & rising(coarse.slopes)).nonzero()[0]
    if len(pool) < 3:
        return np.empty((0, 3), np.float32)
    column = coarse.column[pool]
    pool = pool[column.argsort(kind="stable")]
    before = np.zeros(int(column.max()) + 2, np.intp)  # how many lie left of each column
    np.cumsum(np.bincount(column), out=before[1:])
    points = np.array([coarse.x, coarse.y, coarse.d])
    first, second, third = _draws(seed, tuning.draws)
    central = pool[np.abs(points[0].take(pool)) < radius]  # the road is more likely there
    both = np.concatenate([pool, central])
    a = both[(first * len(both)).astype(np.intp)]
    at, reach = coarse.column[a].astype(np.intp), int(radius / sample.pitch)
    from_ = before[np.maximum(at - reach, 0)]
    to = before[np.minimum(at + reach + 1, len(before) - 1)]
    b = pool[from_ + (second * (to - from_)).astype(np.intp)]
    c = pool[from_ + (third * (to - from_)).astype(np.intp)]
    corner = points.take(a, 1)
    x1, y1, d1 = points.take(b, 1) - corner
    x2, y2, d2 = points.take(c, 1) - corner
    area = x1 * y2 - x2 * y1
    wide = (np.abs(area) > tuning.least_area) & (np.maximum(np.abs(y1), np.abs(y2)) < radius)
    area = np.where(wide, area, 1)
    c1, c2 = (d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area
    steep = c2 * radius > tuning.least_rise * coarse.tolerance[a]  # a wall's noise is not a road
    good = (wide & steep & (np.abs(c1) <= math.tan(max_roll) * c2)).nonzero()[0][: tuning.kept]
    c1, c2, (x, y, d) = c1.take(good), c2.take(good), corner.take(good, 1)
    planes = np.empty((len(good), 3), np.float32)
    planes[:, 0], planes[:, 1], planes[:, 2] = d - c1 * x - c2 * y, c1, c2
    return planes


@lru_cache(maxsize=8)
def _draws(seed: int, count: int) -> NDArray[np.float64]:
    """Return three numbers in [0, 1) for each triple: shape (3, count)."""
    return np.random.default_rng(seed).random((3, count))


_LEAST_ROOT = np.float32(1e-4)  # its 8th power is no denormal: these take ten times as long


@dataclass(frozen=True)
class PlaneScorer:
    """The coarse pixels of a sample, laid out for scoring many planes at once; arrays of shape (N,).

    Attributes
    ----------
    bearings : ndarray, shape (2, N)
        x and -y over the disparity.
    scaled : ndarray, shape (4, N)
        1, x, y and d over the tolerance.
    caps : ndarray
        Square root of the cost of each pixel when it lies below a plane.
    near : ndarray
        Weights of mean 1 that grow with the disparity.
    slopes : ndarray, shape (4, N)
    slope_noise : float
        As in `Sample`.
    tuning : ScoreTuning
    """

    bearings: Singles
    scaled: Singles
    caps: Singles
    near: Singles
    slopes: Singles
    slope_noise: float
    tuning: ScoreTuning

    @classmethod
    def of(cls, sample: Sample) -> "PlaneScorer":
        """Take the coarse pixels of a sample."""
        tuning, coarse = sample.tuning.score, sample.coarse
        near = np.minimum(coarse.d, np.float32(tuning.nearness * sample.typical))
        near *= len(near) / near.sum()
        scaled = np.empty((4, len(coarse.d)), np.float32)
        scaled[0], scaled[1], scaled[2], scaled[3] = 1, coarse.x, coarse.y, coarse.d
        scaled /= coarse.tolerance
        caps = np.sqrt(1 + np.float32(tuning.below_penalty) * coarse.coherence)
        bearings = scaled[1:3] / scaled[3]
        np.negative(bearings[1], out=bearings[1])
        return cls(bearings, scaled, caps, near, coarse.slopes, sample.slope_noise, tuning)

    def first_costs(self, planes: Singles, pixels: int) -> Singles:
        """Return a cheap cost for each plane, on about so many of the pixels, with one corridor for all."""
        few, tuning = every(len(self.caps), pixels), self.tuning
        middle = len(planes) // 2
        usual = np.partition(planes[:, 2], middle)[middle]  # a guess of the road's slope
        side = np.square(self.bearings[0, few] * usual)
        beside = tuning.beside_weight
        corridor = beside + (1 - beside) * np.exp(side * np.float32(-1 / tuning.corridor**2))
        weight = np.where(rising(self.slopes[:, few]), 1, np.float32(tuning.off_slope_weight)) * corridor
        costs: Singles = _excess(planes, self.scaled[:, few].copy(), self.caps[few]).dot(weight)
        return costs

    def scores(self, planes: Singles) -> Singles:
        """Return the score of each plane (K, 3); see `Road.score`."""
        excess = _excess(planes, self.scaled, self.caps)
        excess -= 1
        slope, core, corridor = self._weights(planes)
        # what speaks for a plane counts as far as the slopes agree, what speaks against it in any case
        lost = np.minimum(excess, 0)
        lost *= slope
        lost += np.maximum(excess, 0, out=excess)
        each = zip(planes.tolist(), lost, slope, core, corridor, strict=True)
        return np.array([self._score(*one) for one in each], np.float32)

    def _score(
        self, plane: list[float], lost: Singles, slope: Singles, core: Singles, corridor: Singles
    ) -> float:
        """Return the mean of two shares, less if it is good and the plane's horizon is far away."""
        score = _explained(lost, slope, core, self.tuning.least_core) / 2
        score += _explained(lost, slope, corridor, self.tuning.least_corridor) / 2
        c0, c1, c2 = plane
        steep = c0 * c0 / max(c1 * c1 + c2 * c2, 1e-30)
        return score / (1 + steep / self.tuning.horizon**2) if score > 0 else score

    def fitted(self, planes: Singles) -> Singles:
        """Fit each plane (K, 3) to the pixels on it, a few times over."""
        slope, _, corridor = self._weights(planes)
        fixed = np.multiply(slope, corridor, out=corridor)
        products = (self.scaled[:3, None] * self.scaled[None]).reshape(12, -1)
        for fit in range(self.tuning.fits):
            width = self.tuning.first_fit_width if fit == 0 else 1.0
            weight = _residuals(planes, self.scaled)
            np.square(weight, out=weight)
            weight *= np.float32(-(width**-2))
            weight += 1
            np.maximum(weight, 0, out=weight)
            weight *= fixed
            sums = weight.dot(products.T).reshape(-1, 3, 4).tolist()
            planes = np.array([solve_normal(each) for each in sums], np.float32)
        return planes

    def _weights(self, planes: Singles) -> tuple[Singles, Singles, Singles]:
        """Return, for each plane and pixel, the agreement of slopes and the places in core and corridor."""
        # how far to the side each pixel lies, in camera heights, as `RoadModel.side` says
        corridor = planes[:, :0:-1].dot(self.bearings)
        np.square(corridor, out=corridor)
        corridor *= np.float32(-1 / self.tuning.corridor**2)
        np.exp(corridor, out=corridor)
        core = np.maximum(corridor, _LEAST_ROOT)
        for _ in range(3):
            np.square(core, out=core)
        corridor += core
        beside = self.tuning.beside_weight
        corridor *= np.float32((1 - beside) / 2)
        corridor += np.float32(beside)
        core *= self.near
        corridor *= self.near
        return slope_weights(self.slopes, self.slope_noise, planes, self.tuning), core, corridor


def slope_weights(slopes: Singles, slope_noise: float, planes: Singles, tuning: ScoreTuning) -> Singles:
    """Return (K, N) weights by how well the map's slopes, the better of each pair, agree with the planes'."""
    c1, c2 = planes[:, 1:2], planes[:, 2:3]
    left, right, up, down = slopes
    weights = _off_slope(left, right, c1)
    weights += _off_slope(up, down, c2)
    share, noise = tuning.slope_share**2, slope_noise**2
    scales = [-0.5 / (share * (across * across + down * down) + noise) for _, across, down in planes.tolist()]
    weights *= np.array(scales, np.float32)[:, None]
    return slope_agreement(weights, tuning)


def slope_agreement(exponents: Singles, tuning: ScoreTuning) -> Singles:
    """Return weights that are 1 at 0 and fade towards `off_slope_weight`; the exponents are overwritten."""
    weights: Singles = np.exp(exponents, out=exponents)
    weights *= np.float32(1 - tuning.off_slope_weight)
    weights += np.float32(tuning.off_slope_weight)
    return weights


def _off_slope(one: Singles, other: Singles, slope: Singles) -> Singles:
    """Return (K, N): the square of how far the better of two slopes is off that of each plane (K, 1)."""
    off, off_other = one - slope, other - slope
    np.abs(off, out=off)
    np.abs(off_other, out=off_other)
    np.minimum(off, off_other, out=off)
    squares: Singles = np.square(off, out=off)
    return squares


def _explained(lost: Singles, slope: Singles, place: Singles, least: float) -> float:
    """Return the share of the road-like pixels of a place that lie on a plane, less those below."""
    return -float(place.dot(lost)) / (float(place.dot(slope)) + least * len(place))


def _excess(planes: Singles, scaled: Singles, caps: Singles) -> Singles:
    """Return squared residuals in tolerances (K, N), at most 1 above a plane and more below it."""
    off = _residuals(planes, scaled)
    np.maximum(off, -1, out=off)  # np.clip takes twice as long
    np.minimum(off, caps, out=off)
    np.square(off, out=off)
    return off


def _residuals(planes: Singles, scaled: Singles) -> Singles:
    """Return plane minus disparity in tolerances, (K, N); `scaled` holds 1, x, y and d."""
    minus = np.full((len(planes), 1), -1, np.float32)
    residuals: Singles = np.concatenate([planes, minus], 1).dot(scaled)
    return residuals


HARDLY_A_PIXEL = "no road: hardly a pixel lies on the best plane that was found"


@dataclass(frozen=True)
class Road:
    """The plane that was found.

    Attributes
    ----------
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y on the sample's grid.
    score : float
        The share of the road-like pixels ahead that lie on the plane, less those below it; at most 1. It is
        the mean of two shares, in the corridor and in its core, where a wide verge has no pixel. A plane
        whose horizon is far outside of the image, as that of a wall, scores less.
    rival : float
        The best score of another plane, one whose roll differs by `SearchTuning.rival_angle` or more.
    """

    plane: NDArray[np.float64]
    score: float
    rival: float

    @property
    def model(self) -> RoadModel:
        """The plane as a road without curvature."""
        return RoadModel.of_plane(*self.plane.tolist())

    @property
    def horizon(self) -> float:
        """How far the plane's horizon is from the centre of the image, units: large for a wall or a table."""
        c0, c1, c2 = self.plane.tolist()
        return abs(float(c0)) / math.hypot(c1, c2)


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
        When no plane through the pixels rises downward in the image, as a road's disparity does, or none
        has pixels on it.
    """
    planes = draw_planes(sample, max_roll, seed)
    if len(planes) == 0:
        raise EstimationError("no road: nowhere does the disparity grow downward, as it does on a road")
    tuning = sample.tuning.search
    scorer = PlaneScorer.of(sample)
    planes = planes[_varied(scorer.first_costs(planes, tuning.first_pixels), _rolls(planes), tuning)]
    fitted = scorer.fitted(planes)
    kept = np.abs(fitted[:, 1]) <= math.tan(max_roll) * fitted[:, 2]
    fitted = _distinct(fitted[kept] if kept.any() else planes[:1], tuning.same_plane * sample.noise)
    scores = scorer.scores(fitted)
    winner = int(scores.argmax())
    if not fitted[winner, 2] > 0:  # fitted to no pixel, it scores 0, and the others have more against them
        raise EstimationError(HARDLY_A_PIXEL)
    rolls = _rolls(fitted)
    far = np.abs(rolls - rolls[winner]) > tuning.rival_angle
    return Road(fitted[winner].astype(np.float64), float(scores[winner]), float(scores[far].max(initial=-1)))


def _varied(costs: Singles, rolls: Singles, tuning: SearchTuning) -> list[int]:
    """Return the cheapest planes, few of each roll: a wide verge must not crowd out the road."""
    bins = np.floor(rolls / tuning.rival_angle).astype(np.intp).tolist()
    taken = dict.fromkeys(bins, 0)  # a Counter takes longer
    chosen: list[int] = []
    for plane in costs.argsort(kind="stable").tolist():
        alike = bins[plane]
        if taken[alike] < tuning.of_each_roll:
            taken[alike] += 1
            chosen.append(plane)
            if len(chosen) == tuning.refined:
                break
    return chosen


def _distinct(planes: Singles, least: float) -> Singles:
    """Return those planes that differ from all before them, by so much somewhere within a unit, px.

    Most fits on a good map end at the same plane.
    """
    distinct: list[list[float]] = []
    for plane in planes.tolist():
        a0, a1, a2 = plane
        if all(abs(a0 - b0) + abs(a1 - b1) + abs(a2 - b2) >= least for b0, b1, b2 in distinct):
            distinct.append(plane)
    return np.array(distinct, np.float32)


def _rolls(planes: Singles) -> Singles:
    return np.arctan2(-planes[:, 1], planes[:, 2])


# Rows of a map of about 16,000 pixels, above the horizon of the plane. In 224 pairs that was too low by 1.05
# rows (95 %), and by more than two in four of them, against the horizon of the map at full size
_SPARE = 2


def first_row_of_road(
    disparity: NDArray[Any], usable: NDArray[np.bool_] | None, max_roll: float, seed: int
) -> float:
    """Return the first row that the road's plane can reach, counted from 0.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        A small map, px; <= 0 is no data.
    usable : ndarray of bool, shape (H, W), or None
        Its pixels that may be used, where not all may.
    max_roll, seed
        See `find_road`.

    Returns
    -------
    float
        A few rows above the plane's horizon, at the side of the map where that is higher; 0 where no road is
        found.
    """
    try:
        sample = take_sample(disparity, usable)
        road = find_road(sample, max_roll, seed)
    except EstimationError:
        return 0.0
    c0, c1, c2 = road.plane.tolist()
    grid = sample.grid
    side = (disparity.shape[1] - 1) / 2 / grid.scale
    highest: float = -(c0 + abs(c1) * side) / c2
    return max(0.0, grid.centre_v + highest * grid.scale - _SPARE)
