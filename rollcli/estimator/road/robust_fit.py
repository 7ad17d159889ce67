"""A robust fit of the road's parabola and roll to the pixels near its plane."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Floats
from rollcli.estimator.road.edges import Edges, sides
from rollcli.estimator.road.find import Road, road_weights
from rollcli.estimator.road.subsample import Sample, Singles

_START = 2.0  # tolerances within which a pixel counts at first;
_PLAIN = 3.0  # in the end this many standard deviations,
_WIDE = 5.0  # or this many of an uneven road, since its rises and dips are no noise,
_LANE = 3.5  # or this many of an uneven lane ahead,
_LEAST = 0.2  # but at least this many tolerances
_SMOOTH, _UNEVEN = 0.35, 0.55  # standard deviations of even and of uneven roads, in tolerances
_OF_BIWEIGHT = 1.25  # times the weighted root mean square it is a normal distribution's standard deviation
_AHEAD = 0.8  # half-width of the lane ahead, in camera heights
_EDGE = 0.7  # half-width of the part of the image that counts; it ends as exp(-(x / _EDGE)^8)
_OTHER_ROLL = 0.06  # radians: what a rig rolled by this much more or less would not see does not count
_LARGE_ROLL = 0.2  # its tangent: from here on less and less is left out
_FADE = 0.01  # how softly
_DROP = 3.0  # farther than this many tolerances from the plane, a pixel is not looked at again
_PIXELS = 2500  # looked at; more of them would repeat each other
MIN_PIXELS = 30
_RIDGE, _TINY = 1 + 1e-10 * np.eye(4), 1e-300 * np.eye(4)


class Fit(NamedTuple):
    """Roll, parabola on the rolled, normalised y, and where the weights end, in tolerances."""

    theta: float
    alpha: tuple[float, float, float]
    limit: float

    @classmethod
    def of(cls, road: Road) -> Fit:
        """Return the road's plane as a fit."""
        c0, c1, c2 = road.plane
        return cls(road.theta, (float(c0), math.hypot(c1, c2), 0.0), _START)


@dataclass(frozen=True)
class Near:
    """The pixels near a road's plane, with what stays the same through all fits; arrays of shape (N,).

    Attributes
    ----------
    x, y, d, tolerance : ndarray
        As in `Sample`.
    place : ndarray
        Weights from 0 to 1 by place in the image and by slopes.
    ahead : ndarray
        1 for those in the lane ahead, else 0.
    stride : int
        How many near pixels of the sample each of them stands for.
    """

    x: Singles
    y: Singles
    d: Singles
    tolerance: Singles
    place: Singles
    ahead: Singles
    stride: int

    @classmethod
    def of(cls, sample: Sample, road: Road) -> Near:
        """Take them from a sample."""
        c0, c1, c2 = road.plane
        off = (c0 + c1 * sample.x + c2 * sample.y - sample.d) / sample.tolerance
        near = np.flatnonzero(np.abs(off) < _DROP)
        stride = -(-len(near) // _PIXELS) or 1
        near = near[near % stride == 0]  # by place in the sample, so that one pixel more moves no other
        kept = (sample.x, sample.y, sample.d, sample.tolerance)
        x, y, d, tolerance = (pixels[near] for pixels in kept)
        across, along = _rolled(x, y, road.theta)
        half_height = sample.grid.centre_v / sample.grid.scale
        place = np.square(road_weights(sample, road.plane, near)) * _seen(
            across, along, half_height, road.theta
        )
        ahead = (np.abs(across) * math.hypot(c1, c2) < _AHEAD * d).astype(np.float32)
        return cls(x, y, d, tolerance, place, ahead, stride)

    def within(self, edges: Edges, fit: Fit) -> Near:
        """Return those between the edges of the road of a fit."""
        kept = edges.hold(sides(self.x, self.y, fit.theta, fit.alpha))
        pixels = {name: getattr(self, name)[kept] for name in ("x", "y", "d", "tolerance", "place", "ahead")}
        return replace(self, **pixels)

    def fit(self, start: Fit, rounds: int, *, parabolic: bool, ahead: bool = False) -> Fit:
        """Fit (a0, a1, a2, theta), starting from the road's plane or from an earlier fit.

        Gauss-Newton with Tukey's biweight, whose width shrinks from two tolerances as far as the pixels' own
        spread allows; with `ahead`, the spread of those in the lane ahead.
        """
        fit = start._replace(limit=_START)
        design = np.empty((5, len(self.d)), np.float32)
        design[0], design[4] = 1, self.d
        across, off = self._lay_out(design, fit)
        for _ in range(rounds):
            weights = self._weights(off, fit.limit)
            if not parabolic:
                design[2] = 0
            design[3] = across * (design[1] * (-2 * fit.alpha[2]) - fit.alpha[1])
            products = ((design * weights) @ design.T).astype(np.float64)
            a0, a1, a2, turned = np.linalg.solve(solvable(products[:4, :4]), products[:4, 4]).tolist()
            fit = Fit(fit.theta + max(-0.2, min(0.2, turned)), (a0, a1, a2), fit.limit)
            across, off = self._lay_out(design, fit)
            fit = fit._replace(limit=min(fit.limit, self._width(off, weights, ahead=ahead)))
        return fit

    def weights(self, fit: Fit) -> Singles:
        """Return the weights that a fit leaves, 0 to 1."""
        design = np.empty((3, len(self.d)), np.float32)
        design[0] = 1
        return self._weights(self._lay_out(design, fit)[1], fit.limit)

    def _lay_out(self, design: Singles, fit: Fit) -> tuple[Singles, Singles]:
        """Set a design's rows 1 and 2, the way along the road and its square.

        Returns the way across it, and road minus disparity in tolerances.
        """
        across, design[1] = _rolled(self.x, self.y, fit.theta)
        np.square(design[1], out=design[2])
        off: Singles = np.array(fit.alpha, np.float32) @ design[:3]
        off -= self.d
        off /= self.tolerance
        return across, off

    def _weights(self, off: Singles, limit: float) -> Singles:
        """Return the weights; refuse a surface with hardly a pixel on it."""
        inside = np.maximum(0, 1 - np.square(off / limit))
        weights: Singles = inside * inside * self.place
        if np.count_nonzero(weights) < MIN_PIXELS:
            raise EstimationError("no road: hardly a pixel lies on the best plane that was found")
        return weights

    def _width(self, off: Singles, weights: Singles, *, ahead: bool) -> float:
        """Return how wide the weights should be, from the spread of the pixels that have some.

        Every step is smooth: a pixel more or less must not turn the road.
        """
        if ahead and np.count_nonzero(weights * self.ahead) >= MIN_PIXELS:
            weights = weights * self.ahead
        deviation = _OF_BIWEIGHT * math.sqrt(float(weights @ np.square(off)) / float(weights.sum()))
        uneven = max(0.0, min(1.0, (deviation - _SMOOTH) / (_UNEVEN - _SMOOTH)))
        times = _PLAIN + uneven * ((_LANE if ahead else _WIDE) - _PLAIN)
        return max(_LEAST, times * deviation)


def solvable(normal: Floats) -> Floats:
    """Return normal matrices (..., 4, 4) of a0, a1, a2 and theta that can be inverted, also without an a2."""
    return normal * _RIDGE + _TINY


def _rolled(x: Singles, y: Singles, theta: float) -> tuple[Singles, Singles]:
    """Return the coordinates across and along the road."""
    cosine, sine = math.cos(theta), math.sin(theta)
    return x * cosine + y * sine, y * cosine - x * sine


def _seen(across: Singles, along: Singles, half_height: float, theta: float) -> Singles:
    """Return 1 for what a rig sees of the road at any roll near its own, less towards sides and near corners.

    On a road that is not even across, the corner that only one of two rolls sees would turn the angle.
    """
    edge = np.square(np.square(np.square(across / _EDGE)))
    bottom = half_height / math.cos(theta) + max(0.0, abs(math.tan(theta)) - _LARGE_ROLL)
    beyond = along + _OTHER_ROLL * np.abs(across) - bottom
    seen: Singles = np.exp(-edge) / (1 + np.exp(np.minimum(beyond / _FADE, 50)))
    return seen
