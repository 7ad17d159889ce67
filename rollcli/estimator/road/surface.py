"""The surface of a road: a robust fit of its parabola, roll and camber, its edges and its pixels.

Each pixel is averaged with those around it. Most of what a matcher gets wrong differs from pixel to pixel and
from row to row, among other things because it prefers whole pixels: a mean of five has less of it.

The profile across the lane ahead tells how far to the sides the ground belongs to it. Heights above the road,
in camera heights, are relative differences of disparity: h = d / road - 1. Nothing is cut off: weights fade,
so that a kerb that is a little lower, or half a bin farther away, turns the angle a little and not at once.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Bools, Floats, Grid, Singles, powers, solve_normal, strips
from rollcli.estimator.request import Request
from rollcli.estimator.road.find import HARDLY_A_PIXEL, Road, agreement
from rollcli.estimator.road.model import Reals, RoadModel, column_ahead
from rollcli.estimator.road.sample import Sample, count, medians_of, quantile, reach_of, steps_to, tolerances
from rollcli.estimator.tuning import FitTuning, Tuning

MOST_FADED = 30.0  # as exp(-30): products of such weights are no denormals, which take ten times as long
_LEAST_PIXELS = 30  # with some weight, without which there is no road
_REACH = 3.0  # tolerances from the plane beyond which a pixel is not looked at again
_LEAST_WIDTH = 0.01  # tolerances, of a map without any error
_MOST_TURN = 0.2  # radians that a round may turn the road by
_LEAST_LEVEL = 0.5  # of the lane's level that ground has which is shown as road
ROUNDS = 3  # of the fit to the road, which starts from the lane ahead; with 2 it has not settled
_BINS = 10  # to each side of the profile, which reaches to twice its width
_BLOCK = 2**20  # pixels
# around a pixel: two pairs of opposite sides, in rows and columns of their own
_AROUND = np.array(((2, 1), (-2, -1), (1, -2), (-1, 2)))


@dataclass(frozen=True)
class Surface:
    """The pixels of the road, and how they lie around its parabola; arrays of shape (N,).

    Attributes
    ----------
    x, y : ndarray
        Normalised coordinates.
    d : ndarray
        Disparity less what the road's camber adds, px.
    weights : ndarray
        More than 0, at most 1.
    model : RoadModel
        The fit, on x and y.
    grid : Grid
        Of x and y.
    noise : float
        `Sample.noise`, px.
    parabolic : bool
        The road model: parabola or line.
    share : float
        The share of the sampled pixels that is road.
    moved : float
        How far the roll moved from the plane's, radians.
    level : ndarray, shape (2 * bins,), or None
        How much the ground counts by how far to the side it lies, by its height over the lane; None where
        all of it does.
    camber_precision : float
        What the prior of the camber adds to its normal equation; infinite where none was fitted.
    limit : float
        How far single pixels of the road are off it at most, tolerances.
    lowest : float
        The y of the lowest row that was looked at.
    sides : tuple of float
        How far the map's first column is to the left of the origin, and its last one to the right, units.
    yields : ndarray
        The share of its weight that a pixel loses of its pull on the road: as the road moves towards it, its
        weight grows, and moves the road the further. 0 where weights are fixed.
    """

    x: Floats
    y: Floats
    d: Floats
    weights: Floats
    model: RoadModel
    grid: Grid
    noise: float
    parabolic: bool
    share: float = 1.0
    moved: float = 0.0
    level: Floats | None = None
    camber_precision: float = math.inf
    limit: float = math.inf
    lowest: float = 0.0
    sides: tuple[float, float] = (1.0, 1.0)
    yields: Floats | float = 0.0

    def covers(self, disparity: NDArray[Any], tuning: Tuning) -> Bools:
        """Return which pixels of a map (H, W) lie on the surface and rise as it does."""
        height, width = disparity.shape
        reach = min(reach_of(height, width, tuning.sample), height - 1)
        covered = np.empty(disparity.shape, bool)
        for rows in strips(height, _BLOCK // width):  # a large map leaves no room for eight more
            first = max(0, rows.start - reach)
            some = self._covers(disparity[first : rows.stop + reach], first, reach, tuning)
            covered[rows] = some[rows.start - first : rows.stop - first]
        return covered

    def _covers(self, disparity: NDArray[Any], first: int, reach: int, tuning: Tuning) -> Bools:
        """Return the same of some rows, from `first` on: they are compared with those `reach` away."""
        disparity = np.fmax(disparity, 0)  # no data is 0, however the map writes it
        rows, columns = (np.arange(side, dtype=np.float64) for side in disparity.shape)
        x, y = self.grid.normalised(columns, rows[:, None] + first)
        road = self.model.disparity(x, y)
        tolerance = tolerances(disparity, self.noise, tuning.sample)
        on_it: Bools = np.abs(road - disparity) < self.limit * tolerance
        if self.level is not None:
            lateral = self.model.lateral(self.model.across(x, y), self.model.along(x, y))
            side = self.model.side(lateral, road)
            on_it &= _level_at(self.level, side, tuning.fit) > _LEAST_LEVEL
        # where a wall crosses the surface it is as near as the road, but it does not rise as the road does
        off = disparity - road
        most = np.maximum(tolerance[reach:], np.abs(road[reach:] - road[:-reach]) / 2)
        steady = np.abs(off[reach:] - off[:-reach]) < most
        rises = np.zeros_like(on_it)
        rises[reach:] |= steady
        rises[:-reach] |= steady
        return on_it & rises


def _with_lane_ahead(sample: Sample, theta: float, request: Request) -> Sample:
    """Move a sample's origin to where the lane ahead of an image rolled by theta crosses its row."""
    if request.middle is None:
        return sample
    grid = sample.grid
    column = column_ahead(theta, request.middle, grid.centre_v, grid.aspect)
    right = np.float32((column - grid.centre_u) / grid.scale)
    return replace(sample, grid=replace(grid, centre_u=column), x=sample.x - right)


def whole_surface(sample: Sample, energy: Energy, request: Request) -> Surface:
    """Return a surface that takes every sampled pixel for road."""
    _, c1, c2 = energy.plane
    plane = RoadModel.of_plane(0.0, c1, c2, sample.grid.aspect)
    sample = _with_lane_ahead(sample, plane.theta, request)
    x, y, d = (values.astype(np.float64) for values in (sample.x, sample.y, sample.d))
    rows = powers(plane.along(x, y), 2)
    rows[2] *= energy.parabolic
    alpha = solve_normal(rows @ rows.T, rows @ d)
    model = plane._replace(alpha=tuple(alpha.tolist()))
    return Surface(
        x, y, d, np.ones(len(d)), model, sample.grid, sample.noise, energy.parabolic, sides=sample.sides
    )


def fit_surface(sample: Sample, road: Road, request: Request) -> Surface:
    """Fit the road's parabola, roll and camber to the pixels near the road's plane.

    The lane ahead of the rig is fitted first. The profile across it says how much of the ground beside it is
    still the same road, and the fit to all that is left starts from the lane's.

    Parameters
    ----------
    sample : Sample
    road : Road
    request : Request
        The road model, parabola or line, and the tuning.

    Returns
    -------
    Surface

    Raises
    ------
    EstimationError
        When hardly any pixel lies on the road.
    """
    before, sample = sample.grid, _with_lane_ahead(sample, road.model.theta, request)
    right = (sample.grid.centre_u - before.centre_u) / before.scale
    road = replace(road, plane=road.plane + np.array([right * road.plane[1], 0, 0]))
    near = _near_pixels(sample, road, request)
    lane = near.lane(road.model)
    level, near = near.profiled(lane)
    model, weights, bulge, camber_precision, limit = near.fitted(lane)
    used = (weights > 0).nonzero()[0]
    if len(used) < _LEAST_PIXELS:
        raise EstimationError(HARDLY_A_PIXEL)
    x, y = near.places[:, used].astype(np.float64)
    inside = np.sqrt(weights[used] / near.place[used].astype(np.float64))  # 1 - (distance / limit)^2
    return Surface(
        x,
        y,
        (near.d - np.float32(model.camber) * bulge)[used].astype(np.float64),
        weights[used].astype(np.float64),
        model,
        sample.grid,
        sample.noise,
        request.parabolic,
        share=min(1.0, len(used) * near.stride / len(sample.d)),
        moved=abs(model.theta - road.model.theta),
        level=level,
        camber_precision=camber_precision,
        limit=limit,
        lowest=sample.lowest,
        sides=sample.sides,
        yields=4 / inside - 4,  # Tukey's (1 - s)^2 r has the derivative (1 - s)^2 (1 - 4 s / (1 - s))
    )


@dataclass(frozen=True)
class NearPixels:
    """The pixels near a road's plane, with what stays the same through all fits; arrays of shape (N,).

    Attributes
    ----------
    places : ndarray of float32, shape (2, N)
        x and y.
    d, alone : ndarray of float32
        Disparity, averaged with pixels around, and that of the pixel alone, px.
    tolerance : ndarray of float32
        As in `Sample`.
    place : ndarray of float32
        Weights from 0 to 1 by place in the image and by slopes.
    ahead : ndarray of float32
        1 in the middle of the lane ahead, fading towards its sides.
    least_width : float
        Tolerances within which a pixel counts in any case.
    stride : int
        How many near pixels each of these stands for.
    request : Request
        The road model, parabola or line, and the tuning.
    """

    places: Singles
    d: Singles
    alone: Singles
    tolerance: Singles
    place: Singles
    ahead: Singles
    least_width: float
    stride: int
    request: Request

    @property
    def tuning(self) -> FitTuning:
        """Numbers of the fit."""
        return self.request.tuning.fit

    def lane(self, start: RoadModel) -> RoadModel:
        """Fit the lane ahead, in one round: it only has to show the profile.

        Its middle, for there is no second round that leaves out a verge: with the square of `ahead` in place
        of its 4th power, ground that is 0.0125 camera heights higher beside the lane passes for road.
        """
        design = np.ones((6, len(self.d)), np.float32)
        design[3] = 0
        squares = self._place_on(design, start)
        weights = self._weights(squares, self.tuning.start_width) * np.square(np.square(self.ahead))
        return _moved(start, self._products(design, weights))

    def profiled(self, lane: RoadModel) -> tuple[Floats, "NearPixels"]:
        """Return how much of the lane's level the ground has in bins across, left to right, 0 to 1.

        And the pixels that count, weighted by that and by how far to the side they lie.
        """
        tuning = self.tuning
        across, along = lane.turned(self.places)
        road = np.maximum(lane.disparity_along(along), self.d / 10)
        side = lane.side(lane.lateral(across, along), road)
        places = np.floor(side / np.float32(2 * tuning.profile / _BINS)) + _BINS
        seen = (self.place > 0.1) & (road > self.d / 10) & (places >= 0) & (places < 2 * _BINS)
        seen = seen.nonzero()[0]
        medians = medians_of(places[seen].astype(np.uint16), self.d[seen] / road[seen] - 1, 2 * _BINS)
        medians[_BINS - 2 : _BINS + 2] = [0.0] * 4  # the lane is level
        for place in range(_BINS - 3, -1, -1):  # and where nothing is seen it goes on outward
            for here, inner in ((place, place + 1), (2 * _BINS - 1 - place, 2 * _BINS - 2 - place)):
                medians[here] = medians[inner] if math.isnan(medians[here]) else medians[here]
        level = 1 / (1 + (np.array(medians) / tuning.off_level) ** 4)
        fade = np.exp(-np.square(np.square(np.minimum(np.square(side / np.float32(tuning.profile)), 4))))
        weights = (_level_at(level, side, tuning) * fade).astype(np.float32)
        kept = (weights > 1e-3).nonzero()[0]  # others would only take time
        arrays = ("places", "d", "alone", "tolerance", "place", "ahead")
        pixels = {name: getattr(self, name)[..., kept] for name in arrays}
        pixels["place"] *= weights[kept]
        return level, replace(self, **pixels)

    def fitted(self, start: RoadModel) -> tuple[RoadModel, Singles, Singles, float, float]:
        """Fit (a0, a1, a2, theta) and the camber, starting from the lane's.

        Gauss-Newton with Tukey's biweight, whose width goes from `start_width` to what the spread of the
        pixels ahead asks for: to less as a rule, to more where the map has more noise than the tolerances
        know of. The camber has a prior: where the pixels do not determine it, it stays small.

        Returns
        -------
        model : RoadModel
        weights : ndarray of float32, shape (N,)
            Those that it leaves the pixels.
        bulge : ndarray of float32, shape (N,)
            What a camber of 1 adds to the disparities, px.
        camber_precision, limit : float
            As in `Surface`.
        """
        tuning, limit, precision = self.tuning, self.tuning.start_width, math.inf
        model, design = start, np.ones((6, len(self.d)), np.float32)
        across, along = start.turned(self.places)
        # of the start: camber adds so much the same to roads that differ little
        design[3] = start.bulge(start.lateral(across, along), start.disparity_along(along))
        squares = self._place_on(design, model)
        weights = self._weights(squares, limit)
        for _ in range(ROUNDS):
            products = self._products(design, weights)
            # the variance of the pixels over that of the prior, times how often they repeat each other
            total = products[0, 0]
            repeated = max(1.0, total / self.request.tuning.interval.independent_pixels)
            precision = products[5, 5] / total * repeated / tuning.camber**2
            products[3, 3] += precision
            products[3, 5] -= precision * model.camber
            model = _moved(model, products)
            squares = self._place_on(design, model)
            limit = self._width(squares, weights)
            weights = self._weights(squares, limit)
        alone = np.square((design[5] + self.alone - self.d) / self.tolerance)
        limit = min(tuning.start_width, self._width(alone, weights))
        return model, weights, design[3], float(precision), limit

    def _place_on(self, design: Singles, model: RoadModel) -> Singles:
        """Lay out a design for a road; return the squares of what is left of disparities, in tolerances.

        Its rows (6, N): 1, the coordinate along the road and its square, what a camber of 1 adds, the
        derivative by theta, and what is left.
        """
        across, along = model.turned(self.places)
        design[1] = along
        np.square(along, out=design[2])
        model.turning(across, along, out=design[4])
        np.subtract(self.d, np.array([*model.alpha, model.camber], np.float32).dot(design[:4]), out=design[5])
        return np.asarray(np.square(design[5] / self.tolerance))

    def _weights(self, squares: Singles, limit: float) -> Singles:
        """Return Tukey's weights, times those by place."""
        return np.asarray(np.square(np.maximum(1 - squares / np.float32(limit**2), 0)) * self.place)

    def _products(self, design: Singles, weights: Singles) -> Floats:
        """Return the normal equations of a design (6, N), right-hand side included: shape (6, 6)."""
        if not self.request.parabolic:
            design[2] = 0
        products: Floats = (design * weights).dot(design.T).astype(np.float64)
        if not products[0, 0] > 0:
            raise EstimationError(HARDLY_A_PIXEL)
        return products

    def _width(self, squares: Singles, weights: Singles) -> float:
        """Return how wide the weights should be, from the spread of the pixels ahead that have some.

        Every step is smooth: a pixel more or less must not turn the road.
        """
        weights = weights * self.ahead
        total = max(float(weights.sum()), 1e-30)
        return max(self.least_width, self.tuning.width * math.sqrt(float(weights.dot(squares)) / total))


def _near_pixels(sample: Sample, road: Road, request: Request) -> NearPixels:
    """Take the pixels near a road's plane."""
    tuning, fit, model = request.tuning, request.tuning.fit, road.model
    c0, c1, c2 = road.plane.tolist()
    close = np.abs(c0 + c1 * sample.x + c2 * sample.y - sample.d) < _REACH * sample.tolerance
    stride = -(-int(np.count_nonzero(close)) // fit.pixels) or 1
    near = close[::stride].nonzero()[0] * stride  # so that one pixel more moves no other
    places = np.array([sample.x.take(near), sample.y.take(near)])
    mean, place = _look_around(sample, road.plane, near, tuning)
    across, along = model.turned(places)
    # what a rig does not see that is rolled a little more or less would turn the angle of a cambered road
    bottom = sample.grid.centre_v / sample.grid.scale / math.cos(model.theta)
    beyond = (along + fit.other_roll * np.abs(across) - bottom) * (10 / fit.other_roll)
    place = np.square(place) / (1 + np.exp(np.minimum(beyond, MOST_FADED)))
    lateral = model.lateral(across, along)
    ahead = np.square(np.square(lateral * (model.alpha[1] / tuning.search.corridor) / mean))
    # the steps of a map of whole pixels are no spread: within less, only stripes of one value are left
    least = max(_LEAST_WIDTH, sample.quantum / quantile(sample.tolerance[sample.few], 0.5))
    return NearPixels(
        places=places,
        d=mean,
        alone=sample.d[near],
        tolerance=sample.tolerance[near],
        place=place,
        ahead=np.exp(-np.minimum(ahead, MOST_FADED)) + np.float32(0.01),  # a lane may be hidden
        least_width=least,
        stride=stride,
        request=request,
    )


def _look_around(
    sample: Sample, plane: Floats, near: NDArray[np.intp], tuning: Tuning
) -> tuple[Singles, Singles]:
    """Return the mean disparity of some pixels and those around, and how well slopes agree with the plane's.

    In the mean are those that are off the plane's slope by at most the tolerance, or a step of a map of whole
    pixels; others belong to another surface, or are wrong. They are as far away as neighbours are, or fill
    the spaces between sampled pixels evenly.
    """
    d, width = sample.d[near], sample.disparity.shape[1]
    unit = np.maximum(np.array(sample.spacing) / 5, sample.reach / 2)
    moves = np.rint(_AROUND * unit).clip(-sample.reach, sample.reach).astype(np.intp)
    there = sample.places[near] + moves @ [[width], [1]]
    slope = plane[:0:-1] / sample.grid.scale
    off = steps_to(there, sample.disparity, d) - moves.dot(slope).astype(np.float32)[:, None]
    apart = np.abs(off)
    better = np.square(np.minimum(apart[::2], apart[1::2]))
    steepness = tuning.search.slope_share**2 * float(slope.dot(slope))
    variance = steepness * np.square(moves[::2]).sum(1) + sample.noise**2
    agreeing = agreement((-0.5 / variance).astype(np.float32).dot(better), tuning.search)
    same = apart <= np.maximum(sample.tolerance[near], np.float32(sample.quantum))
    if sample.usable is not None:
        same &= sample.usable.reshape(-1)[there]
    mean: Singles = d + np.where(same, off, 0).sum(0) / (1 + count(same)).astype(np.float32)
    return mean, agreeing


def _level_at(level: Floats, side: Reals, tuning: FitTuning) -> Reals:
    """Return how much of the lane's level the ground has, so far to the right of the middle, 0 to 1."""
    centres = (np.arange(len(level)) - (len(level) - 1) / 2) * (2 * tuning.profile / _BINS)
    return np.interp(side, centres, level)


def _moved(model: RoadModel, products: Floats) -> RoadModel:
    """Return the road that solves normal equations; no round turns it by more than it may."""
    d0, d1, d2, camber, turned = solve_normal(products[:5, :5], products[:5, 5]).tolist()
    a0, a1, a2 = model.alpha
    turned = max(-_MOST_TURN, min(_MOST_TURN, turned))
    alpha = a0 + d0, a1 + d1, a2 + d2
    return RoadModel(model.theta + turned, alpha, model.camber + camber, model.aspect)
