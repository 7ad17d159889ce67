"""How well planes explain what lies ahead of the rig; see `find`."""

from dataclasses import dataclass

import numpy as np

from rollcli.estimator.normal import solve_normal
from rollcli.estimator.road.neighbours import Singles, rising
from rollcli.estimator.road.subsample import Sample, every
from rollcli.estimator.road.tuning import ScoreTuning

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
