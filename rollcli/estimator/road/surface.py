"""The surface of a road: its parabola, its edges and its pixels."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Floats, Grid, powers
from rollcli.estimator.road.find import Road
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.profile import Profile
from rollcli.estimator.road.robust_fit import Fit, NearPixels
from rollcli.estimator.road.subsample import Sample, reach_of
from rollcli.estimator.road.tuning import RoadTuning

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
