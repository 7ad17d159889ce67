"""A robust fit of the road's parabola and roll to the pixels near its plane."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Floats
from rollcli.estimator.road.edges import Edges
from rollcli.estimator.road.find import Road, road_weights
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.subsample import Sample, Singles
from rollcli.estimator.road.tuning import FitTuning

_RIDGE, _TINY = 1 + 1e-10 * np.eye(4), 1e-300 * np.eye(4)


class Fit(NamedTuple):
    """A road on normalised coordinates, and where the weights end, in tolerances."""

    model: RoadModel
    limit: float


@dataclass(frozen=True)
class NearPixels:
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
    tuning : FitTuning
    """

    x: Singles
    y: Singles
    d: Singles
    tolerance: Singles
    place: Singles
    ahead: Singles
    stride: int
    tuning: FitTuning

    @classmethod
    def of(cls, sample: Sample, road: Road) -> "NearPixels":
        """Take the pixels near a road's plane from a sample."""
        tuning, model = sample.tuning.fit, road.model
        c0, c1, c2 = road.plane
        off = (c0 + c1 * sample.x + c2 * sample.y - sample.d) / sample.tolerance
        near = np.flatnonzero(np.abs(off) < tuning.reach)
        stride = -(-len(near) // tuning.pixels) or 1
        near = near[near % stride == 0]  # by place in the sample, so that one pixel more moves no other
        kept = (sample.x, sample.y, sample.d, sample.tolerance)
        x, y, d, tolerance = (pixels[near] for pixels in kept)
        across, along = model.across(x, y), model.along(x, y)
        half_height = sample.grid.centre_v / sample.grid.scale
        place = np.square(road_weights(sample, road.plane, near))
        place *= _seen(across, along, half_height, model.theta, tuning)
        ahead = (np.abs(across) * model.alpha[1] < tuning.lane * d).astype(np.float32)
        return cls(x, y, d, tolerance, place, ahead, stride, tuning)

    def within(self, edges: Edges, model: RoadModel) -> "NearPixels":
        """Return the pixels between the edges of a road."""
        kept = edges.hold(model.side(self.x, self.y, model.disparity(self.x, self.y)))
        pixels = {name: getattr(self, name)[kept] for name in ("x", "y", "d", "tolerance", "place", "ahead")}
        return replace(self, **pixels)

    def fit(self, start: RoadModel, rounds: int, *, parabolic: bool, ahead: bool = False) -> Fit:
        """Fit (a0, a1, a2, theta), starting from the road's plane or from an earlier fit.

        Gauss-Newton with Tukey's biweight, whose width shrinks from two tolerances as far as the pixels' own
        spread allows; with `ahead`, the spread of those in the lane ahead.
        """
        model, limit, most = start, self.tuning.start_width, self.tuning.most_turn
        design = np.empty((5, len(self.d)), np.float32)
        design[0], design[4] = 1, self.d
        across, off = self._lay_out(design, model)
        for _ in range(rounds):
            weights = self._weights(off, limit)
            if not parabolic:
                design[2] = 0
            design[3] = model.turning(across, design[1])
            products = ((design * weights) @ design.T).astype(np.float64)
            a0, a1, a2, turned = np.linalg.solve(solvable(products[:4, :4]), products[:4, 4]).tolist()
            model = RoadModel(model.theta + max(-most, min(most, turned)), (a0, a1, a2))
            across, off = self._lay_out(design, model)
            limit = min(limit, self._width(off, weights, ahead=ahead))
        return Fit(model, limit)

    def weights(self, fit: Fit) -> Singles:
        """Return the weights that a fit leaves, 0 to 1."""
        design = np.empty((3, len(self.d)), np.float32)
        design[0] = 1
        return self._weights(self._lay_out(design, fit.model)[1], fit.limit)

    def _lay_out(self, design: Singles, model: RoadModel) -> tuple[Singles, Singles]:
        """Set a design's rows 1 and 2, the coordinate along the road and its square.

        Return the coordinate across it, and road minus disparity in tolerances.
        """
        across: Singles = model.across(self.x, self.y)
        design[1] = model.along(self.x, self.y)
        np.square(design[1], out=design[2])
        off: Singles = np.array(model.alpha, np.float32) @ design[:3]  # RoadModel.disparity takes longer
        off -= self.d
        off /= self.tolerance
        return across, off

    def _weights(self, off: Singles, limit: float) -> Singles:
        """Return the weights; refuse a surface with hardly a pixel on it."""
        inside = np.maximum(0, 1 - np.square(off / limit))
        weights: Singles = inside * inside * self.place
        if np.count_nonzero(weights) < self.tuning.least_pixels:
            raise EstimationError("no road: hardly a pixel lies on the best plane that was found")
        return weights

    def _width(self, off: Singles, weights: Singles, *, ahead: bool) -> float:
        """Return how wide the weights should be, from the spread of the pixels that have some.

        Every step is smooth: a pixel more or less must not turn the road.
        """
        tuning = self.tuning
        if ahead and np.count_nonzero(weights * self.ahead) >= tuning.least_pixels:
            weights = weights * self.ahead
        spread = tuning.biweight_spread * math.sqrt(float(weights @ np.square(off)) / float(weights.sum()))
        mix = (spread - tuning.even_spread) / (tuning.uneven_spread - tuning.even_spread)
        widest = tuning.lane_width if ahead else tuning.uneven_width
        times = tuning.even_width + max(0.0, min(1.0, mix)) * (widest - tuning.even_width)
        return max(tuning.least_width, times * spread)


def solvable(normal: Floats) -> Floats:
    """Return normal matrices (..., 4, 4) of a0, a1, a2 and theta that can be inverted, also without an a2."""
    return normal * _RIDGE + _TINY


def _seen(across: Singles, along: Singles, half_height: float, theta: float, tuning: FitTuning) -> Singles:
    """Return weights: 1 where a rig sees the road at any roll near its own, less at sides and lower corners.

    A corner that is seen at one roll and not at another would turn the angle of a cambered road.
    """
    edge = np.square(np.square(np.square(across / tuning.image_edge)))
    bottom = half_height / math.cos(theta) + max(0.0, abs(math.tan(theta)) - tuning.large_roll)
    beyond = along + tuning.other_roll * np.abs(across) - bottom
    seen: Singles = np.exp(-edge) / (1 + np.exp(np.minimum(beyond / tuning.corner_fade, 50)))
    return seen
