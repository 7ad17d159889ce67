"""A robust fit of the road's parabola, roll and camber to the pixels near its plane."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Floats
from rollcli.estimator.normal import solve_normal
from rollcli.estimator.road.find import HARDLY_A_PIXEL, Road
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.neighbours import Singles
from rollcli.estimator.road.profile import Profile, read_profile
from rollcli.estimator.road.subsample import Sample
from rollcli.estimator.road.surroundings import look_around
from rollcli.estimator.road.tuning import FitTuning, ProfileTuning

X, Y, D, ALONE, TOLERANCE, PLACE, AHEAD = range(7)  # rows of `NearPixels.rows`
# rows of a design, after 1, the coordinate along the road, and its square
BULGE, TURNING, LEFT = range(3, 6)
MOST_FADED = 30.0  # as exp(-30): products of such weights are no denormals, which take ten times as long
_LEAST_ROOT = np.float32(math.exp(-MOST_FADED / 4))
_LEAST_TOTAL = 1e-30  # of weights; keeps a division finite


class Fit(NamedTuple):
    """A road on normalised coordinates, and how the pixels lie around it.

    Attributes
    ----------
    model : RoadModel
    squares : ndarray, shape (N,)
        Squared distances from the road, in tolerances.
    limit : float
        Where the weights end, in tolerances.
    bulge : ndarray, shape (N,)
        What a camber of 1 adds to the disparities, px.
    camber_precision : float
        What the prior adds to the normal equation of the camber; infinite before the first round.
    """

    model: RoadModel
    squares: Singles
    limit: float
    bulge: Singles
    camber_precision: float = math.inf


@dataclass(frozen=True)
class NearPixels:
    """The pixels near a road's plane, with what stays the same through all fits.

    Attributes
    ----------
    rows : ndarray of float32, shape (7, N)
        x, y and tolerance as in `Sample`; disparity, averaged with pixels around, and that of the pixel
        alone, px; `place`, weights from 0 to 1 by place in the image and by slopes; and `ahead`, 1 in the
        middle of the lane ahead, fading towards its sides. One array: pixels are picked at once.
    stride : int
        How many near pixels of the sample each of them stands for.
    least_width : float
        Tolerances within which a pixel counts in any case.
    tuning : FitTuning
    """

    rows: Singles
    stride: int
    least_width: float
    tuning: FitTuning

    @classmethod
    def of(cls, sample: Sample, road: Road) -> "NearPixels":
        """Take the pixels near a road's plane from a sample."""
        tuning, model = sample.tuning.fit, road.model
        c0, c1, c2 = road.plane.tolist()  # of NumPy's double precision they would make everything double
        off = c1 * sample.x
        off += c2 * sample.y
        off += c0
        off -= sample.d
        close = np.abs(off, out=off) < tuning.reach * sample.tolerance
        stride = -(-int(np.count_nonzero(close)) // tuning.pixels) or 1
        near = close[::stride].nonzero()[0] * stride  # so that one pixel more moves no other
        rows = np.empty((7, len(near)), np.float32)
        for row, pixels in ((X, sample.x), (Y, sample.y), (ALONE, sample.d), (TOLERANCE, sample.tolerance)):
            pixels.take(near, out=rows[row], mode="clip")  # other modes make a copy first
        rows[D], rows[PLACE] = look_around(sample, road.plane, near)
        across, along = model.turned(rows[:2])
        half_height = sample.grid.centre_v / sample.grid.scale
        rows[PLACE] *= rows[PLACE]
        rows[PLACE] *= _seen(across, along, half_height, model.theta, tuning)
        across *= model.alpha[1] / tuning.lane
        across /= rows[D]
        np.exp(-np.minimum(np.square(np.square(across)), MOST_FADED), out=rows[AHEAD])
        # the steps of a map of whole pixels are no spread: within less, only stripes of one value are left
        usual = math.hypot(sample.noise, sample.tuning.sample.uneven_share * sample.typical)
        return cls(rows, stride, max(tuning.least_width, sample.quantum / usual), tuning)

    def pixels(self, some: NDArray[np.intp]) -> Floats:
        """Return x, y and the disparity of some of them, shape (3, M)."""
        return self.rows[: D + 1].take(some, 1).astype(np.float64)

    def lane(self, start: RoadModel, *, parabolic: bool) -> RoadModel:
        """Fit the lane ahead, in one round: it only has to show the profile.

        Its middle, for there is no second round that leaves out a verge: with the square of `ahead` in place
        of its 4th power, ground that is 0.0125 camera heights higher beside the lane passes for road.
        """
        design = self._design()
        across, squares = self._lay_out(design, start, self.rows[D])
        weights = self._weights(squares, self.tuning.start_width)
        weights *= np.square(np.square(np.maximum(self.rows[AHEAD], _LEAST_ROOT)))
        products = _products(design, start, across, weights, parabolic=parabolic)
        return self._moved(start, solve_normal(products[:LEFT]))

    def profile(self, lane: RoadModel, tuning: ProfileTuning) -> tuple[Profile, "NearPixels"]:
        """Read the profile across the lane; return it, and the pixels weighted by it."""
        d = self.rows[D]
        across, along = lane.turned(self.rows[:2])
        least = d * tuning.least_road
        road = np.maximum(lane.disparity_along(along), least)
        side = lane.side(across, road)
        unseen = (self.rows[PLACE] <= tuning.least_place) | (road <= least)
        profile = read_profile(np.where(unseen, np.inf, side), d / road - 1, tuning)
        weights: Singles = profile.at(side).astype(np.float32, copy=False)
        kept = (weights > self.tuning.least_weight).nonzero()[0]
        rows = self.rows.take(kept, 1)
        rows[PLACE] *= weights.take(kept)
        return profile, NearPixels(rows, self.stride, self.least_width, self.tuning)

    def fit(self, start: RoadModel, *, parabolic: bool) -> Fit:
        """Fit (a0, a1, a2, theta) and the camber, starting from the lane's.

        Gauss-Newton with Tukey's biweight, whose width shrinks from two tolerances as far as the spread of
        the pixels ahead allows. The camber has a prior: where the pixels do not determine it, it stays small.
        """
        design = self._design()
        ahead = self.rows[AHEAD] + np.float32(self.tuning.beside)
        # the bulge of the start: it changes so little that its changes need not be followed
        across, squares = self._lay_out(design, start, self.rows[D], bulge=True)
        fit = Fit(start, squares, self.tuning.start_width, design[BULGE])
        for _ in range(self.tuning.rounds):
            weights = self._weights(fit.squares, fit.limit)
            products = _products(design, fit.model, across, weights, parabolic=parabolic)
            precision = self._camber_precision(products)
            products[BULGE][BULGE] += precision
            products[BULGE][LEFT] -= precision * fit.model.camber
            model = self._moved(fit.model, solve_normal(products[:LEFT]))
            across, squares = self._lay_out(design, model, self.rows[D])
            weights *= ahead
            limit = min(fit.limit, self._width(squares, weights))
            fit = Fit(model, squares, limit, fit.bulge, precision)
        return fit

    def weights(self, fit: Fit) -> Singles:
        """Return the weights that a fit leaves, 0 to 1; refuse a surface with hardly a pixel on it."""
        weights = self._weights(fit.squares, fit.limit)
        if np.count_nonzero(weights > 0) < self.tuning.least_pixels:
            raise EstimationError(HARDLY_A_PIXEL)
        return weights

    def limit_alone(self, model: RoadModel) -> float:
        """Return where the weights of single pixels around a road would end, in tolerances.

        Averaged ones lie closer together.
        """
        design = self._design()
        _, squares = self._lay_out(design, model, self.rows[ALONE], bulge=True)
        ahead = self.rows[AHEAD] + np.float32(self.tuning.beside)
        limit = self.tuning.start_width
        for _ in range(self.tuning.rounds):
            limit = min(limit, self._width(squares, self._weights(squares, limit) * ahead))
        return limit

    def _design(self) -> Singles:
        """Return room for a design, whose parabola has a constant and whose bulge is 0."""
        design = np.empty((6, self.rows.shape[1]), np.float32)
        design[0], design[BULGE] = 1, 0
        return design

    def _lay_out(
        self, design: Singles, model: RoadModel, d: Singles, *, bulge: bool = False
    ) -> tuple[Singles, Singles]:
        """Set what a design has of a road: along it, the square of that, and what it leaves of disparities.

        Its bulge, too, if asked for. Return the coordinate across the road, and the squares of what is
        left, in tolerances.
        """
        across, design[1] = model.turned(self.rows[:2])
        np.square(design[1], out=design[2])
        if bulge:
            design[BULGE] = model.bulge(across, np.array(model.alpha, np.float32).dot(design[:BULGE]))
        road: Singles = np.array([*model.alpha, model.camber], np.float32).dot(design[: BULGE + 1])
        np.subtract(d, road, out=design[LEFT])
        squares: Singles = design[LEFT] / self.rows[TOLERANCE]
        squares *= squares
        return across, squares

    def _moved(self, model: RoadModel, steps: list[float]) -> RoadModel:
        """Return a road whose parameters differ by some steps; no round turns it by more than it may."""
        most, (a0, a1, a2) = self.tuning.most_turn, model.alpha
        d0, d1, d2, camber, turned = steps
        turned = max(-most, min(most, turned))
        return RoadModel(model.theta + turned, (a0 + d0, a1 + d1, a2 + d2), model.camber + camber)

    def _weights(self, squares: Singles, limit: float) -> Singles:
        """Return Tukey's weights, times those by place."""
        weights = squares * (-1 / limit**2)
        weights += 1
        np.maximum(weights, 0, out=weights)
        weights *= weights
        weights *= self.rows[PLACE]
        return weights

    def _camber_precision(self, products: list[list[float]]) -> float:
        """Return what the camber's prior adds to its normal equation.

        The variance of the pixels over that of the prior, times how often neighbouring pixels repeat each
        other.
        """
        total = products[0][0]
        variance = products[LEFT][LEFT] / total
        repeated = max(1.0, total / self.tuning.independent_pixels)
        return variance * repeated / self.tuning.camber**2

    def _width(self, squares: Singles, weights: Singles) -> float:
        """Return how wide the weights should be, from the spread of the pixels ahead that have some.

        Every step is smooth: a pixel more or less must not turn the road.
        """
        tuning = self.tuning
        total = max(float(weights.sum()), _LEAST_TOTAL)
        spread = tuning.biweight_spread * math.sqrt(float(weights.dot(squares)) / total)
        mix = (spread - tuning.even_spread) / (tuning.uneven_spread - tuning.even_spread)
        times = tuning.even_width + max(0.0, min(1.0, mix)) * (tuning.uneven_width - tuning.even_width)
        return max(self.least_width, times * spread)


def _products(
    design: Singles, model: RoadModel, across: Singles, weights: Singles, *, parabolic: bool
) -> list[list[float]]:
    """Return the normal equations of a round, with what a road leaves as one row more, (6, 6)."""
    if not parabolic:
        design[2] = 0
    model.turning(across, design[1], out=design[TURNING])
    products: list[list[float]] = (design * weights).dot(design.T).tolist()
    if not products[0][0] > 0:
        raise EstimationError(HARDLY_A_PIXEL)
    return products


def _seen(across: Singles, along: Singles, half_height: float, theta: float, tuning: FitTuning) -> Singles:
    """Return weights: 1 where a rig sees the road at any roll near its own, less in the lower corners.

    A corner that is seen at one roll and not at another would turn the angle of a cambered road.
    """
    bottom = half_height / math.cos(theta) + max(0.0, abs(math.tan(theta)) - tuning.large_roll)
    beyond = along + tuning.other_roll * np.abs(across) - bottom
    seen: Singles = np.reciprocal(1 + np.exp(np.minimum(beyond / tuning.corner_fade, MOST_FADED)))
    return seen
