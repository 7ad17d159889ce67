"""From the road's plane to its pixels: a parabola fitted ever more strictly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.profile import falls_away
from rollcli.estimator.road import Road, road_weights
from rollcli.estimator.sample import UNEVEN_SHARE, Sample, reach_of

_ROUNDS = 6
_START = 2.0  # tolerances within which a pixel counts at first;
_STRICT = 5.0  # in the end this many standard deviations,
_NARROW = 3.5  # this many of those in the corridor ahead,
_EVEN = 0.35  # or three, of a road that deviates by less than this, in tolerances,
_LEAST = 0.2  # but at least this many tolerances
_AHEAD = 0.8  # half-width of the corridor ahead, in camera heights
_SAME = math.radians(0.02)
_EDGE = 0.65  # half-width of the part of the image that counts; it ends as exp(-(x / _EDGE)^8)
_STEADY = 0.5  # of the road's own rise: how far that of the map may be off
_DROP = 3.0  # farther than this many tolerances from the plane, a pixel is not looked at again
_PIXELS = 3000  # looked at; more of them would repeat each other
MIN_PIXELS = 30


@dataclass(frozen=True)
class Surface:
    """The pixels of the road, and how they lie around its parabola; arrays of shape (N,).

    Attributes
    ----------
    x, y, d : ndarray
        Normalised coordinates and disparity, px.
    weights : ndarray
        More than 0, at most 1.
    theta : float
        Roll of the fit, radians.
    alpha : tuple of float
        The parabola in the rolled, normalised y.
    grid : Grid
        Of x and y.
    noise : float
        `Sample.noise`, px.
    limit : float
        Where the weight ends, in tolerances.
    share : float
        The share of the sampled pixels that is road.
    moved : float
        How far the roll moved from the plane's, radians.
    parabolic : bool
        The road model: parabola or line.
    """

    x: Floats
    y: Floats
    d: Floats
    weights: Floats
    theta: float
    alpha: tuple[float, float, float]
    grid: Grid
    noise: float
    limit: float
    share: float
    moved: float
    parabolic: bool

    def covers(self, disparity: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which pixels of a map (H, W) lie on the surface and rise as it does."""
        height, width = disparity.shape
        x = (np.arange(width) - self.grid.centre_u) / self.grid.scale
        y = (np.arange(height) - self.grid.centre_v) / self.grid.scale
        level = y[:, None] * math.cos(self.theta) - x * math.sin(self.theta)
        a0, a1, a2 = self.alpha
        road = a0 + level * (a1 + level * a2)
        tolerance = np.hypot(self.noise, UNEVEN_SHARE * disparity)
        on_it: NDArray[np.bool_] = np.abs(road - disparity) < self.limit * tolerance
        # where a wall passes through the surface it is as near as the road, but it does not rise
        reach = min(reach_of(height, width), height - 1)
        off = disparity - road
        steady = np.abs(off[reach:] - off[:-reach]) < np.maximum(
            tolerance[reach:], _STEADY * np.abs(road[reach:] - road[:-reach])
        )
        rises = np.zeros_like(on_it)
        rises[reach:] |= steady
        rises[:-reach] |= steady
        return on_it & rises

    def parabola(self, theta: float) -> tuple[float, float, float]:
        """Return the best (a0, a1, a2) at a given roll, on the normalised y."""
        level = self.y * math.cos(theta) - self.x * math.sin(theta)
        design = np.stack([np.ones_like(level), level, level * level * self.parabolic])
        weighted = design * self.weights
        normal = weighted @ design.T
        ridge = np.diag(1e-12 * np.diag(normal) + 1e-300)
        a0, a1, a2 = np.linalg.solve(normal + ridge, weighted @ self.d)
        return float(a0), float(a1), float(a2)


def fit_surface(sample: Sample, road: Road, *, parabolic: bool) -> Surface:
    """Fit the road's parabola and its roll to the pixels near the road's plane.

    Gauss-Newton on (a0, a1, a2, theta) with Tukey's biweight, whose width shrinks from two tolerances as far
    as the pixels' own spread allows. Ground beside the road keeps the fit wide where it is nearly as high.
    Where that ground falls away or rises from the road's edge like a verge, the spread of the corridor ahead
    counts instead, which leaves it out.

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
    near = _Near.of(sample, road)
    wide = near.fit(road, parabolic=parabolic, narrow=False)
    if wide.limit <= _STRICT * _EVEN:
        return near.surface(wide, sample, road, parabolic=parabolic)
    narrow = near.fit(road, parabolic=parabolic, narrow=True)
    verge = abs(narrow.theta - wide.theta) > _SAME and falls_away(
        near.x, near.y, near.d, near.place > 0.1, narrow.theta, narrow.alpha
    )
    return near.surface(narrow if verge else wide, sample, road, parabolic=parabolic)


class _Fit(NamedTuple):
    """Roll, parabola, and where the weights end, in tolerances."""

    theta: float
    alpha: tuple[float, float, float]
    limit: float


@dataclass(frozen=True)
class _Near:
    """The pixels near a road's plane, with what stays the same through all fits."""

    x: Floats
    y: Floats
    d: Floats
    tolerance: Floats
    place: Floats
    ahead: NDArray[np.bool_]
    share: float  # of the sampled pixels: how many are near

    @classmethod
    def of(cls, sample: Sample, road: Road) -> _Near:
        c0, c1, c2 = road.plane
        off = (c0 + c1 * sample.x + c2 * sample.y - sample.d) / sample.tolerance
        near = np.flatnonzero(np.abs(off) < _DROP)
        share = len(near) / len(sample.d)
        near = near[:: -(-len(near) // _PIXELS) or 1]
        kept = (sample.x, sample.y, sample.d, sample.tolerance)
        x, y, d, tolerance = (pixels[near].astype(np.float64) for pixels in kept)
        across = x * math.cos(road.theta) + y * math.sin(road.theta)
        edge = np.square(np.square(np.square(across / _EDGE)))
        place = np.square(road_weights(sample, road.plane, near)) * np.exp(-edge)
        return cls(x, y, d, tolerance, place, np.abs(across) * math.hypot(c1, c2) < _AHEAD * d, share)

    def fit(self, road: Road, *, parabolic: bool, narrow: bool) -> _Fit:
        """Start from the road's plane; `narrow`: the corridor ahead tells how wide the weights may be."""
        c0, c1, c2 = road.plane
        theta, alpha, limit = road.theta, (float(c0), math.hypot(c1, c2), 0.0), _START
        design = np.empty((5, len(self.x)))
        design[0], design[4] = 1, self.d
        strict = _NARROW if narrow else _STRICT
        off = self._off(theta, alpha)
        for _ in range(_ROUNDS):
            weights = self._weights(off, limit)
            cosine, sine = math.cos(theta), math.sin(theta)
            design[1] = self.y * cosine - self.x * sine
            design[2] = design[1] * design[1] if parabolic else 0
            design[3] = -(self.x * cosine + self.y * sine) * (alpha[1] + 2 * alpha[2] * design[1])
            products = (design * weights) @ design.T
            normal = products[:4, :4] + np.diag(1e-10 * np.diag(products)[:4] + 1e-300)
            a0, a1, a2, turned = np.linalg.solve(normal, products[:4, 4])
            theta, alpha = theta + max(-0.2, min(0.2, float(turned))), (float(a0), float(a1), float(a2))
            off = self._off(theta, alpha)
            deviation = self._deviation(off, weights > 0, narrow=narrow)
            limit = max(_LEAST, min(limit, (strict if deviation > _EVEN else 3.0) * deviation))
        return _Fit(theta, alpha, limit)

    def surface(self, fit: _Fit, sample: Sample, road: Road, *, parabolic: bool) -> Surface:
        """Return the pixels that a fit leaves, and the fit."""
        weights = self._weights(self._off(fit.theta, fit.alpha), fit.limit)
        used = weights > 0
        return Surface(
            x=self.x[used],
            y=self.y[used],
            d=self.d[used],
            weights=weights[used],
            theta=fit.theta,
            alpha=fit.alpha,
            grid=sample.grid,
            noise=sample.noise,
            limit=fit.limit,
            share=float(np.count_nonzero(used)) / len(used) * self.share,
            moved=abs(fit.theta - road.theta),
            parabolic=parabolic,
        )

    def _off(self, theta: float, alpha: tuple[float, float, float]) -> Floats:
        """Return road minus disparity in tolerances."""
        level = self.y * math.cos(theta) - self.x * math.sin(theta)
        off: Floats = (alpha[0] + level * (alpha[1] + level * alpha[2]) - self.d) / self.tolerance
        return off

    def _weights(self, off: Floats, limit: float) -> Floats:
        """Return the weights, 0 to 1; refuse a surface with hardly a pixel on it."""
        inside = np.maximum(0, 1 - np.square(off / limit))
        weights: Floats = inside * inside * self.place
        if np.count_nonzero(weights) < MIN_PIXELS:
            raise EstimationError("no road: hardly a pixel lies on the best plane that was found")
        return weights

    def _deviation(self, off: Floats, used: NDArray[np.bool_], *, narrow: bool) -> float:
        """Return a robust standard deviation of the pixels used, in tolerances."""
        if narrow and np.count_nonzero(used & self.ahead) >= MIN_PIXELS:
            used = used & self.ahead
        spread = np.abs(off[used])
        middle = len(spread) // 2
        return 1.4826 * float(np.partition(spread, middle)[middle])


def whole_surface(sample: Sample, energy: Energy) -> Surface:
    """Return the surface that every sampled pixel is taken to lie on."""
    pixels = len(sample.d)
    _, c1, c2 = energy.plane
    return Surface(
        x=sample.x.astype(np.float64),
        y=sample.y.astype(np.float64),
        d=sample.d.astype(np.float64),
        weights=np.ones(pixels),
        theta=math.atan2(-c1, c2),
        alpha=(0.0, 0.0, 0.0),
        grid=sample.grid,
        noise=sample.noise,
        limit=math.inf,
        share=1.0,
        moved=0.0,
        parabolic=energy.parabolic,
    )
