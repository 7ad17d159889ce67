"""The surface of a road: a robust fit of its parabola, roll and camber, its edges and its pixels.

Each pixel is averaged with those around it. Most of what a matcher gets wrong differs from pixel to pixel and
from row to row, among other things because it prefers whole pixels: a mean of five has less of it.

The profile across the lane ahead tells how far to the sides the ground belongs to it. Heights above the road,
in camera heights, are relative differences of disparity: h = d / road - 1. Nothing is cut off: weights fade,
so that a kerb that is a little lower, or half a bin farther away, turns the angle a little and not at once.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import Energy
from rollcli.estimator.least_squares import solve_normal
from rollcli.estimator.moments import Floats, Grid, powers
from rollcli.estimator.road.find import HARDLY_A_PIXEL, Road, slope_agreement
from rollcli.estimator.road.model import Reals, RoadModel
from rollcli.estimator.road.sample import Sample, Singles, Spacing, count_true, reach_of, steps_to
from rollcli.estimator.tuning import FitTuning, ProfileTuning, RoadTuning

_MOST_OFF = 10  # times `off_level`: ground that is farther over or under the lane weighs nothing


@dataclass(frozen=True, eq=False)
class Profile:
    """How much the ground counts, by how far to the side it lies.

    Attributes
    ----------
    weights : ndarray, shape (2 * bins,)
        From left to right, 0 to 1.
    tuning : ProfileTuning
    """

    weights: Floats
    tuning: ProfileTuning

    def at(self, side: Reals) -> Reals:
        """Return the weights of pixels that lie this far to the right of the middle, in camera heights."""
        # to the power of 8: a square is three times as fast as a power
        fade = np.minimum(np.square(side / self.tuning.width), 4)
        fade *= fade
        fade *= fade
        weights: Reals = self.level(side)
        weights *= np.exp(-fade)
        return weights

    def level(self, side: Reals) -> Reals:
        """Return how much of the lane's level the ground there has, 0 to 1, however far it is."""
        # np.interp takes three times as long
        weights = self.weights.astype(side.dtype)
        rises = np.empty_like(weights)
        np.subtract(weights[1:], weights[:-1], out=rises[:-1])
        rises[-1] = 0
        last = len(weights) - 1
        places = np.fmin(np.fmax(side / self.tuning.bin_width + last / 2, 0), last)
        below = np.floor(places)
        level: Reals = places - below
        below = below.astype(np.intp)
        level *= rises.take(below)
        level += weights.take(below)
        return level


def read_profile(side: Reals, height: Reals, tuning: ProfileTuning) -> Profile:
    """Read the profile across the lane ahead.

    Parameters
    ----------
    side : ndarray, shape (N,)
        How far to the right of the middle each pixel lies, camera heights; infinite where it does not count.
    height : ndarray, shape (N,)
        Its height over the lane, camera heights.
    tuning : ProfileTuning

    Returns
    -------
    Profile
    """
    level = np.array(_outward(_medians(side, height, tuning), tuning)) / tuning.off_level
    return Profile(1 / (1 + np.square(np.square(level))), tuning)


def _medians(sides: Reals, heights: Reals, tuning: ProfileTuning) -> list[float]:
    """Return the median height of each bin, left to right; NaN where hardly a pixel is."""
    # one sort for all bins, and for one more to each side; of 16 bits it takes a quarter of the time
    of_bin = 2**16 // (2 * tuning.bins + 2)
    level = of_bin // 2
    step, most = tuning.off_level / ((level - 1) // _MOST_OFF), _MOST_OFF * tuning.off_level
    steps = np.minimum(np.maximum(heights, -most), most) / step + (level + 0.5)
    places = np.floor(sides / tuning.bin_width) + (tuning.bins + 1)
    keys = (np.minimum(np.maximum(places, 0), 2 * tuning.bins + 1) * of_bin).astype(np.uint16)
    keys += steps.astype(np.uint16)
    keys.sort(kind="stable")
    starts = np.arange(1, 2 * tuning.bins + 2) * of_bin
    bounds = itertools.pairwise(keys.searchsorted(starts.astype(np.uint16)).tolist())
    return [
        (int(keys[(low + high) // 2]) - start - level) * step if high - low >= tuning.bin_pixels else math.nan
        for start, (low, high) in zip(starts.tolist(), bounds, strict=False)
    ]


def _outward(heights: list[float], tuning: ProfileTuning) -> list[float]:
    """Return the heights of all bins: the lane is level, and where nothing is seen it goes on outward."""
    first, end = tuning.bins - tuning.core_bins, tuning.bins + tuning.core_bins
    filled = [*heights[:first], *[0.0] * (end - first), *heights[end:]]
    for place in range(first - 1, -1, -1):
        if math.isnan(filled[place]):
            filled[place] = filled[place + 1]
    for place in range(end, len(filled)):
        if math.isnan(filled[place]):
            filled[place] = filled[place - 1]
    return filled


# two pairs of opposite sides, in rows and columns of their own
_AROUND = np.array(((2, 1), (-2, -1), (1, -2), (-1, 2)))


class Surroundings(NamedTuple):
    """What lies around some pixels; arrays of shape (N,).

    Attributes
    ----------
    mean : ndarray of float32
        The mean disparity of each and of those around it that agree, px.
    agreement : ndarray of float32
        0.2 to 1: how well the map's slopes around it agree with the plane's.
    """

    mean: Singles
    agreement: Singles


def look_around(sample: Sample, plane: NDArray[np.float64], near: NDArray[np.intp]) -> Surroundings:
    """Look at the pixels around some of a sample's.

    Parameters
    ----------
    sample : Sample
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y.
    near : ndarray of int, shape (N,)
        Which pixels of the sample.

    Returns
    -------
    Surroundings
        In the mean are those that are off the plane's slope by at most the tolerance, or a step of a map of
        whole pixels; others belong to another surface, or are wrong. Slopes agree by the better one of each
        pair of opposite sides.
    """
    d, tuning = sample.d[near], sample.tuning.score
    moves, offsets, lengths = _moves(sample.spacing, sample.reach, sample.disparity.shape[1])
    there = sample.places[near] + offsets
    slope = plane[:0:-1] / sample.grid.scale
    off = steps_to(there, sample.disparity, d)
    off -= moves.dot(slope).astype(np.float32)[:, None]
    apart = np.abs(off)
    better = np.minimum(apart[::2], apart[1::2])
    steepness = tuning.slope_share**2 * float(slope.dot(slope))
    variance = steepness * lengths + sample.noise**2
    agreement = slope_agreement((-0.5 / variance).astype(np.float32).dot(np.square(better)), tuning)
    other = apart > np.maximum(sample.tolerance[near], np.float32(sample.quantum))
    if sample.usable is not None:
        other |= ~sample.usable.reshape(-1).take(there)
    np.copyto(off, 0, where=other)
    mean: Singles = off.sum(0)
    mean /= len(off) + 1 - count_true(other)
    mean += d
    return Surroundings(mean, agreement)


@lru_cache(maxsize=8)
def _moves(
    spacing: Spacing, reach: int, width: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return how far down and right of a pixel others are looked at, px (4, 2).

    They are as far away as neighbours are, or fill the spaces between sampled pixels evenly. Return these
    moves in pixels counted row by row, too, (4, 1), and the square of how far each pair is away, px^2 (2,).
    """
    unit = np.maximum(np.array(spacing) / 5, reach / 2)
    moves = np.rint(_AROUND * unit).clip(-reach, reach).astype(np.intp)
    return moves, moves @ [[width], [1]], np.square(moves[::2]).sum(1)


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


_BLOCK = 2**20  # pixels


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
    share : float
        The share of the sampled pixels that is road.
    moved : float
        How far the roll moved from the plane's, radians.
    parabolic : bool
        The road model: parabola or line.
    profile : Profile or None
        How much the ground counts by how far to the side it lies; None where all of it does.
    camber_precision : float
        What the prior of the camber adds to its normal equation; infinite where none was fitted.
    near : NearPixels or None
        What the road was fitted to; None where every pixel is taken for road.
    tuning : RoadTuning
        The numbers by which it was found.
    """

    x: Floats
    y: Floats
    d: Floats
    weights: Floats
    model: RoadModel
    grid: Grid
    noise: float
    share: float
    moved: float
    parabolic: bool
    profile: Profile | None
    camber_precision: float
    near: NearPixels | None
    tuning: RoadTuning

    def covers(self, disparity: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which pixels of a map (H, W) lie on the surface and rise as it does."""
        height, width = disparity.shape
        limit = math.inf if self.near is None else self.near.limit_alone(self.model)
        reach = min(reach_of(height, width, self.tuning.sample), height - 1)
        covered = np.empty(disparity.shape, bool)
        step = max(1, _BLOCK // width)  # a few rows at a time: a large map leaves no room for eight more
        for top in range(0, height, step):
            first, end = max(0, top - reach), min(height, top + step)
            rows = slice(first, min(height, end + reach))
            covered[top:end] = self._covers(disparity[rows], first, reach, limit)[top - first : end - first]
        return covered

    def _covers(self, disparity: NDArray[Any], first: int, reach: int, limit: float) -> NDArray[np.bool_]:
        """Return the same of some rows, from `first` on: they are compared with those `reach` away.

        Pixels on the surface are within `limit` tolerances of it.
        """
        rows, columns = (np.arange(side, dtype=np.float64) for side in disparity.shape)
        x: Floats = (columns - self.grid.centre_u) / self.grid.scale
        y: Floats = ((rows + first - self.grid.centre_v) / self.grid.scale)[:, None]
        road = self.model.disparity(x, y)
        tolerance = np.hypot(self.noise, self.tuning.sample.uneven_share * disparity)
        on_it: NDArray[np.bool_] = np.abs(road - disparity) < limit * tolerance
        if self.profile is not None:
            on_it &= (
                self.profile.level(self.model.side(self.model.across(x, y), road))
                > self.tuning.surface.least_level
            )
        # where a wall crosses the surface it is as near as the road, but it does not rise as the road does
        off = disparity - road
        steady = np.abs(off[reach:] - off[:-reach]) < np.maximum(
            tolerance[reach:], self.tuning.surface.steady * np.abs(road[reach:] - road[:-reach])
        )
        rises = np.zeros_like(on_it)
        rises[reach:] |= steady
        rises[:-reach] |= steady
        return on_it & rises


def fit_surface(sample: Sample, road: Road, *, parabolic: bool) -> Surface:
    """Fit the road's parabola, roll and camber to the pixels near the road's plane.

    The lane ahead of the rig is fitted first. The profile across it says how much of the ground beside it is
    still the same road, and the fit to all that is left starts from the lane's.

    Parameters
    ----------
    sample : Sample
    road : Road
    parabolic : bool
        The road model: parabola or line.

    Returns
    -------
    Surface

    Raises
    ------
    EstimationError
        When hardly any pixel lies on the road.
    """
    near, tuning = NearPixels.of(sample, road), sample.tuning
    lane = near.lane(road.model, parabolic=parabolic)
    profile, weighted = near.profile(lane, tuning.profile)
    fit = weighted.fit(lane, parabolic=parabolic)
    return _surface(weighted, fit, profile, sample, road, parabolic=parabolic)


def _surface(
    near: NearPixels, fit: Fit, profile: Profile, sample: Sample, road: Road, *, parabolic: bool
) -> Surface:
    """Return the pixels that a fit leaves, and the fit."""
    weights, model = near.weights(fit), fit.model
    used = (weights > 0).nonzero()[0]  # of floats alone it takes three times as long
    x, y, d = near.pixels(used)
    return Surface(
        x=x,
        y=y,
        d=d - model.camber * fit.bulge.take(used),
        weights=weights[used].astype(np.float64),
        model=model,
        grid=sample.grid,
        noise=sample.noise,
        share=min(1.0, len(used) * near.stride / len(sample.d)),
        moved=abs(model.theta - road.model.theta),
        parabolic=parabolic,
        profile=profile,
        camber_precision=fit.camber_precision,
        near=near,
        tuning=sample.tuning,
    )


def whole_surface(sample: Sample, energy: Energy) -> Surface:
    """Return a surface that takes every sampled pixel for road."""
    x, y, d = (values.astype(np.float64) for values in (sample.x, sample.y, sample.d))
    _, c1, c2 = energy.plane
    plane = RoadModel.of_plane(0.0, c1, c2)
    rows = powers(plane.along(x, y), 2 if energy.parabolic else 1)
    a0, a1, *a2 = np.linalg.lstsq(rows @ rows.T, rows @ d, rcond=None)[0].tolist()
    return Surface(
        x=x,
        y=y,
        d=d,
        weights=np.ones(len(d)),
        model=plane._replace(alpha=(a0, a1, a2[0] if a2 else 0.0)),
        grid=sample.grid,
        noise=sample.noise,
        share=1.0,
        moved=0.0,
        parabolic=energy.parabolic,
        profile=None,
        camber_precision=math.inf,
        near=None,
        tuning=sample.tuning,
    )
