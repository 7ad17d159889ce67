"""Which pixels an angle rests on: the road, a part of it, or every valid pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.areas.iterative import areas
from rollcli.estimator.areas.lower_centre import AreaSolution, plane_fit
from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import map_moments, point_moments
from rollcli.estimator.road.find import Road, find_road
from rollcli.estimator.road.subsample import take_sample
from rollcli.estimator.road.surface import Surface, fit_surface, whole_surface


@dataclass(frozen=True)
class Pixels:
    """What an angle rests on.

    `road` is None where it was not looked for, `area` where the method does not choose the pixels itself;
    `share` is that of the valid pixels which were used.
    """

    energy: Energy
    surface: Surface | None
    road: Road | None
    share: float
    area: NDArray[np.bool_] | None = None


def take_road(
    values: NDArray[Any], usable: NDArray[np.bool_] | None, max_roll: float, seed: int, *, parabolic: bool
) -> Pixels:
    """Find the road, and sum its pixels by their weights."""
    sample = take_sample(values, usable)
    found = find_road(sample, max_roll, seed)
    surface = fit_surface(sample, found, parabolic=parabolic)
    _, slope, _ = surface.alpha
    plane = (surface.alpha[0], -slope * math.sin(surface.theta), slope * math.cos(surface.theta))
    moments = point_moments(surface.x, surface.y, surface.d, surface.weights, sample.grid, plane)
    return Pixels(
        Energy.of(moments, float(surface.d.max()), parabolic=parabolic), surface, found, surface.share
    )


def take_all(values: NDArray[Any], usable: NDArray[np.bool_] | None, *, parabolic: bool) -> Pixels:
    """Sum every valid pixel, as the paper does; a sample of them tells how sure that is."""
    used = values if usable is None else np.where(usable, values, 0)
    peak = float(used.max())
    if not math.isfinite(peak):
        peak = float(used[np.isfinite(used)].max())
    energy = Energy.of(map_moments(used), peak, parabolic=parabolic)
    return Pixels(energy, _sampled_surface(values, usable, energy), None, 1.0)


def _sampled_surface(values: NDArray[Any], used: NDArray[np.bool_] | None, energy: Energy) -> Surface | None:
    try:
        return whole_surface(take_sample(values, used), energy)
    except EstimationError:  # too small a map to be sampled: an angle without an interval
        return None


def take_area(
    values: NDArray[Any],
    valid: NDArray[np.bool_],
    pixels: Pixels,
    method: str,
    max_roll: float,
    *,
    chosen: bool,
) -> tuple[Pixels, AreaSolution]:
    """Fit planes to a part of the pixels; `chosen` says that the user's mask is the area of "plane"."""
    road = valid
    if pixels.road is not None and pixels.surface is not None:
        road = valid & pixels.surface.covers(values)
    if method == "areas":
        solution = areas(values, road, max_roll)
    else:
        solution = plane_fit(values, road, (slice(None), slice(None)) if chosen else None)
    surface = _sampled_surface(values, solution.used, solution.energy)
    share = np.count_nonzero(solution.used) / np.count_nonzero(valid)
    return Pixels(solution.energy, surface, pixels.road, share, solution.used), solution
