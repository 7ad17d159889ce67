"""Which pixels are road: the plane that best explains what lies ahead of the rig.

Planes through triples of pixels are judged by what they leave unexplained. Three things tell a road from the
walls, verges and sky that may cover more of the image: nothing lies below a road; around each of its pixels
the map rises as the road itself does; and it is what the rig drives on, so it fills the corridor straight
ahead, a few camera heights wide. All three are measured in units of the hypothesis itself: they need neither
the focal length nor the scale of the disparities.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Bools, Floats, Singles, solve_normal
from rollcli.estimator.request import DEFAULT_REQUEST, Request
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.sample import Sample, every, quantile, take_sample, values_at
from rollcli.estimator.tuning import SearchTuning

Plane = tuple[float, float, float]
"""Disparity at pixel (0, 0), px, and what a pixel to the right and one further down add, of a map."""
HARDLY_A_PIXEL = "no road: hardly a pixel lies on the best plane that was found"
_SPARSE = 0.1  # of the pixels have neighbours at most, where these are too few to tell a road
_FITS = 2  # of each plane that is judged again


@dataclass(frozen=True)
class Road:
    """The plane that was found.

    Attributes
    ----------
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y on the sample's grid.
    score : float
        The share of the road-like pixels ahead that lie on the plane, less those below it; at most 1.
    rival : float
        The best score of another plane, one whose roll differs by more than `DoubtTuning.other_angle`; -1
        where there is none.
    aspect : float
        See `Request`.
    """

    plane: Floats
    score: float
    rival: float
    aspect: float

    @property
    def model(self) -> RoadModel:
        """The plane as a road without curvature."""
        c0, c1, c2 = self.plane.tolist()
        return RoadModel.of_plane(c0, c1, c2, self.aspect)

    @property
    def horizon(self) -> float:
        """How far its horizon is above the centre of the image, units: large for a wall or a table.

        Negative where the camera looks up.
        """
        c0, c1, c2 = self.plane.tolist()
        return float(c0) / math.hypot(c1, c2)


def find_road(sample: Sample, request: Request) -> Road:
    """Find the plane of the road.

    Parameters
    ----------
    sample : Sample
    request : Request
        The largest roll considered, the seed of the triples drawn, and the tuning.

    Returns
    -------
    Road

    Raises
    ------
    EstimationError
        When no plane through the pixels rises downward in the image, as a road's disparity does, and is
        rolled by less than the largest one, or none has pixels on it.
    """
    search, other = request.tuning.search, request.tuning.doubts.other_angle
    planes = draw_planes(sample, request)
    if len(planes) == 0:
        raise EstimationError(_why_no_plane(sample, request.max_roll))
    judge = Judge(sample, search)
    scores = judge.scores(planes, every(judge.pixels, search.first_pixels))
    bins, best = np.floor(_rolls(planes) / other).tolist(), dict[float, int]()
    for plane in (-scores).argsort(kind="stable").tolist():
        best.setdefault(bins[plane], plane)  # of each roll: a wide verge must not crowd out the road
        if len(best) == search.refined:
            break
    planes = start = planes[list(best.values())]
    planes = judge.refined(planes)
    within = np.abs(planes[:, 1]) <= request.max_tangent * planes[:, 2]
    planes = planes[within] if within.any() else start[:1]
    scores, rolls = judge.scores(planes, slice(None)), _rolls(planes)
    winner = int(scores.argmax())
    if not planes[winner, 2] > 0:  # fitted to no pixel, it scores 0, and the others have more against them
        raise EstimationError(HARDLY_A_PIXEL)
    far = np.abs(rolls - rolls[winner]) > other
    plane, rival = planes[winner].astype(np.float64), float(scores[far].max(initial=-1))
    return Road(plane, float(scores[winner]), rival, sample.grid.aspect)


def _why_no_plane(sample: Sample, max_roll: float) -> str:
    """Say why no plane through the pixels can be a road."""
    row = sample.reach * sample.disparity.shape[1]
    beside = values_at(sample.places[sample.few] + np.array([[-row], [row]]), sample.disparity) > 0
    if (share := beside.any(0).mean()) < _SPARSE:
        return (
            f"no road: the map is too sparse: {share:.0%} of its pixels with data have others {sample.reach} "
            "px above or below them"
        )
    if (sample.slopes[1] > 0).mean() < 0.5:  # noise alone rises at some pixels
        return "no road: nowhere does the disparity grow downward, as it does on a road"
    return (
        "no road: what grows downward in the map does so by hardly more than its noise, or is rolled by more "
        f"than {math.degrees(max_roll):.3g} degrees"
    )


def draw_planes(sample: Sample, request: Request) -> Singles:
    """Return planes (K, 3) through triples of neighbouring coherent pixels, disparity growing downward."""
    radius, draws = request.tuning.search.radius, request.tuning.search.draws
    x, y, d = (each[sample.few] for each in (sample.x, sample.y, sample.d))
    pool = (sample.coherent & (sample.slopes[1] > 0)).nonzero()[0]
    if len(pool) < 3:
        return np.empty((0, 3), np.float32)
    pool = pool[sample.column[pool].argsort(kind="stable")]
    column = sample.column[pool].astype(np.intp)
    first, second, third = _draws(request.seed, draws)
    central = pool[np.abs(x[pool]) < radius]  # the road is more likely there
    both = np.concatenate([pool, central])
    a = both[(first * len(both)).astype(np.intp)]
    reach = int(radius * sample.grid.scale / sample.spacing.columns)
    at = sample.column[a].astype(np.intp)
    left, right = column.searchsorted(at - reach), column.searchsorted(at + reach, "right")
    b, c = (pool[left + (chance * (right - left)).astype(np.intp)] for chance in (second, third))
    (x1, y1, d1), (x2, y2, d2) = ((x[other] - x[a], y[other] - y[a], d[other] - d[a]) for other in (b, c))
    area = x1 * y2 - x2 * y1
    wide = (np.abs(area) > 0.03 * radius**2) & (np.maximum(np.abs(y1), np.abs(y2)) < radius)
    area = np.where(wide, area, 1)
    c1, c2 = (d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area
    good = (wide & (c2 > 0) & (np.abs(c1) <= request.max_tangent * c2)).nonzero()[0][: draws // 2]
    return np.asarray(np.stack([d[a] - c1 * x[a] - c2 * y[a], c1, c2], 1)[good])


@lru_cache(maxsize=8)
def _draws(seed: int, count: int) -> NDArray[np.float64]:
    """Return three numbers in [0, 1) for each triple: shape (3, count)."""
    return np.random.default_rng(seed).random((3, count))


class Judge:
    """How well planes explain the coarse pixels of a sample.

    Each pixel has one weight, by how far to the side of a plane's road it lies and by how well the map's
    slopes around it agree with the plane's, and one cost: what it is off the plane, squared, up to a
    tolerance. A coherent pixel that is farther below the plane costs more.
    """

    def __init__(self, sample: Sample, tuning: SearchTuning) -> None:
        x, y, d, tolerance = (each[sample.few] for each in (sample.x, sample.y, sample.d, sample.tolerance))
        across, along = sample.slopes
        self._tuning, self.pixels = tuning, len(d)
        self._slope_noise = sample.noise * sample.grid.scale / sample.reach  # px per unit
        self._rows = np.stack([np.ones_like(d), x, y, d]) / tolerance
        self._near = np.minimum(d, quantile(d, 0.5))  # what is near ahead is the road driven on
        products = (self._rows[:3, None] * self._rows[None]).reshape(12, -1) * self._near
        # sums of single precision differ by BLAS: planes by a 50,000th, angles of pairs by 0.006 degrees
        self._products = products.astype(np.float64)
        aspect = np.float32(sample.grid.aspect)
        self._bearings = np.stack([-y / (aspect * d), aspect * x / d])
        self._slopes = np.stack([-across, -along, np.ones_like(d), across**2 + along**2])
        # below a plane a coherent pixel costs twice as much as one that is merely off it
        self._caps = np.where(sample.coherent, np.float32(math.sqrt(2)), np.float32(1))

    def scores(self, planes: Singles, some: slice) -> Singles:
        """Return the score of each plane (K, 3) on some of the pixels; see `Road.score`."""
        place, slope, off = self._weighed(planes, some)
        cost = np.minimum(np.maximum(off, -1, out=off), self._caps[some], out=off)
        cost *= cost
        cost -= 1
        slope *= place
        place *= np.maximum(cost, 0)
        # what speaks for a plane counts as far as the slopes agree, what speaks against it in any case
        near = self._near[some]
        total, lost = slope.dot(near), place.dot(near)
        slope *= np.minimum(cost, 0, out=cost)
        lost += slope.dot(near)
        return np.asarray(-lost / np.maximum(total, np.float32(1e-30)))

    def refined(self, planes: Singles) -> Singles:
        """Fit each plane (K, 3) to the pixels on it, a few times, by the places and slopes of the first."""
        place, slope, off = self._weighed(planes, slice(None))
        place *= slope
        for fit in range(_FITS):
            off = self._off(planes, slice(None)) if fit else off
            off *= off
            weight = np.maximum(1 - off, 0, out=off)
            weight *= place
            sums = weight.dot(self._products.T).reshape(-1, 3, 4)
            planes = solve_normal(sums[..., :3], sums[..., 3]).astype(np.float32)
        return planes

    def _off(self, planes: Singles, some: slice) -> Singles:
        """Return what planes are over pixels, in tolerances, (K, N)."""
        return np.asarray(np.column_stack([planes, np.full_like(planes[:, 0], -1)]).dot(self._rows[:, some]))

    def _weighed(self, planes: Singles, some: slice) -> tuple[Singles, Singles, Singles]:
        """Return the weights of pixels by place and by slopes, and what planes are over them, (K, N).

        The latter in tolerances.
        """
        tuning, (_, c1, c2) = self._tuning, planes.T
        # how far to the side each pixel lies, in camera heights, as `RoadModel.side` says
        place = planes[:, 1:].dot(self._bearings[:, some])
        place *= place
        place *= np.float32(tuning.corridor**-2)
        place += 1
        place *= place
        np.reciprocal(place, out=place)
        steepness = c1 * c1 + c2 * c2
        variance = np.float32(tuning.slope_share**2) * steepness + np.float32(self._slope_noise**2)
        apart = np.stack([2 * c1, 2 * c2, steepness, np.ones_like(c1)], 1) / (-2 * variance[:, None])
        return place, agreement(apart.dot(self._slopes[:, some]), tuning), self._off(planes, some)


def agreement(exponents: Singles, tuning: SearchTuning) -> Singles:
    """Return weights that are 1 at 0 and fade towards `off_slope_weight`; the exponents are overwritten."""
    weights: Singles = np.exp(exponents, out=exponents)
    weights *= np.float32(1 - tuning.off_slope_weight)
    weights += np.float32(tuning.off_slope_weight)
    return weights


def _rolls(planes: Singles) -> Singles:
    return np.arctan2(-planes[:, 1], planes[:, 2])


def road_plane(
    disparity: NDArray[Any],
    smaller: float = 1.0,
    usable: Bools | None = None,
    request: Request = DEFAULT_REQUEST,
) -> Plane | None:
    """Return the plane of the road in a small map, nearly; None where no road is found.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        A small map, px; <= 0 is no data.
    smaller : float
        How many times smaller the map is than the views. Matching errs by as many pixels in it, so by as many
        times more of its disparities; with the tolerances of full size, another plane was found in 26 of 896
        searches of 41 real pairs.
    usable : ndarray of bool, shape (H, W), or None
        Its pixels that may be used, where not all may.
    request : Request
        See `find_road`.
    """
    tuning = request.tuning.sample
    noise, uneven = smaller * tuning.noise_share, smaller * tuning.uneven_share
    try:
        tuning = replace(tuning, noise_share=noise, uneven_share=uneven)
        sample = take_sample(disparity, usable, tuning, aspect=request.aspect)
        c0, c1, c2 = find_road(sample, request).plane.tolist()
    except EstimationError:
        return None
    grid = sample.grid
    across, down = c1 / grid.scale, c2 / grid.scale
    return c0 - across * grid.centre_u - down * grid.centre_v, across, down
