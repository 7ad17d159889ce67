"""Which pixels an angle rests on: the road, a part of it, or every valid pixel."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import Bools, CheckedMap, map_moments, point_moments
from rollcli.estimator.request import AREAS, Request
from rollcli.estimator.road.find import Road, find_road
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import Surface, fit_surface, whole_surface
from rollcli.estimator.solvers.areas import AreaMethod
from rollcli.estimator.solvers.solution import Solution
from rollcli.estimator.tuning import Tuning


@dataclass(frozen=True)
class PixelSet:
    """What an angle rests on.

    Attributes
    ----------
    energy : Energy
        Of the pixels.
    surface : Surface or None
        A sample of them and their road; None where the map is too small for one.
    road : Road or None
        The plane of the road, where it was looked for.
    share : float
        Share of the valid pixels that is used.
    area : ndarray of bool, shape (H, W), or None
        The pixels that a method of `AREAS` chose.
    solution : Solution or None
        What such a method found.
    """

    energy: Energy
    surface: Surface | None
    road: Road | None
    share: float
    area: Bools | None = None
    solution: Solution | None = None

    def mask(self, checked: CheckedMap, tuning: Tuning) -> Bools:
        """Return these pixels of the map that they were selected from, (H, W) of bool."""
        if self.area is not None:
            return self.area
        if self.road is not None and self.surface is not None:
            return checked.valid & self.surface.covers(checked.values, tuning)
        return checked.valid


def select_pixels(checked: CheckedMap, request: Request) -> PixelSet:
    """Find the road if that is asked for, and sum the pixels that the method works on.

    Without a road these are all valid ones, as in the paper; a sample of them serves the interval.

    Raises
    ------
    EstimationError
        When there is no road, or its pixels do not determine an angle.
    """
    tuning, values, usable = request.tuning, checked.values, checked.usable
    road, surface = None, None
    if request.road == "auto":
        sample = take_sample(values, usable, tuning.sample, request.middle, request.aspect)
        road = find_road(sample, request)
        surface = fit_surface(sample, road, request)
    if request.method in AREAS:
        return _area_pixels(checked, road, surface, request)
    if surface is not None:
        moments = point_moments(surface.x, surface.y, surface.d, surface.weights, surface.grid)
        energy = Energy.of(moments, parabolic=surface.parabolic)
        return PixelSet(energy, surface, road, surface.share)
    energy = Energy.of(map_moments(values, usable), parabolic=request.parabolic)
    return PixelSet(energy, _sampled_surface(values, usable, energy, request), None, 1.0)


def _area_pixels(
    checked: CheckedMap, road: Road | None, surface: Surface | None, request: Request
) -> PixelSet:
    """Let the method choose among the road's pixels, or the valid ones; a mask is the chosen area."""
    values = checked.values
    candidates = checked.valid if surface is None else checked.valid & surface.covers(values, request.tuning)
    choose: AreaMethod = AREAS[request.method].load()
    used, energy, solution = choose(values, candidates, request, checked.usable is not None)
    sampled = _sampled_surface(values, used, energy, request)
    return PixelSet(energy, sampled, road, np.count_nonzero(used) / checked.count, used, solution)


def _sampled_surface(
    values: NDArray[Any], used: Bools | None, energy: Energy, request: Request
) -> Surface | None:
    try:
        sample = take_sample(values, used, request.tuning.sample, request.middle, request.aspect)
        return whole_surface(sample, energy, request)
    except EstimationError:  # too small a map to be sampled: an angle without an interval
        return None
