"""From a disparity map to a roll angle: which pixels, their moments, a solver, how sure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import EstimationError, UsageError
from rollcli.estimator import verdict
from rollcli.estimator.areas import areas
from rollcli.estimator.energy import Energy
from rollcli.estimator.exact import exact, minima
from rollcli.estimator.golden_section import golden_section
from rollcli.estimator.gradient_descent import LAMBDA0, TOLERANCE, gradient_descent
from rollcli.estimator.interval import half_width
from rollcli.estimator.moments import map_moments, point_moments
from rollcli.estimator.pixels import require_pixels
from rollcli.estimator.plane_fit import AreaSolution, plane_fit
from rollcli.estimator.road import Road, find_road
from rollcli.estimator.sample import take_sample
from rollcli.estimator.solution import Solution
from rollcli.estimator.surface import Surface, fit_surface, whole_surface

AREA_METHODS = ("plane", "areas")
METHODS = ("gd", "gss", "exact", *AREA_METHODS)
MODELS = ("parabola", "line")
ROADS = ("auto", "all")
MAX_ROLL_LIMIT = math.radians(89)


@dataclass(frozen=True)
class RollEstimate:
    """The roll of one map, and what it rests on.

    Attributes
    ----------
    theta : float
        Roll, radians, in (-pi/2, pi/2]; positive: the rig is turned counter-clockwise seen from behind.
    ci95 : float or None
        Half-width of the 95 % interval, radians, given that the pixels used are road.
    status : str
        "ok", or "suspect": `message` says why the angle is doubtful.
    message : str
        Reasons, joined by "; "; empty when ok.
    method : str
    iterations : int
    converged : bool
    global_minimum : bool or None
        Whether `theta` is the proven global minimum of the energy; None for methods that do not minimise it.
    rmse : float
        Root mean squared residual of the pixels used, px.
    alpha : tuple of float
        The road's (a0, a1, a2), px, y measured from the centre of the top-left pixel.
    valid_fraction, road_fraction : float
        The share of all pixels that is valid, and the share of the valid ones that was used as road.
    width, height : int
        Of the map, px.
    """

    theta: float
    ci95: float | None
    status: str
    message: str
    method: str
    iterations: int
    converged: bool
    global_minimum: bool | None
    rmse: float
    alpha: tuple[float, float, float]
    valid_fraction: float
    road_fraction: float
    width: int
    height: int
    _usable: NDArray[np.bool_] | None = field(default=None, repr=False, compare=False)
    _surface: Surface | None = field(default=None, repr=False, compare=False)

    def road_mask(self, disparity: ArrayLike) -> NDArray[np.bool_]:
        """Return the pixels of the map (H, W) that were used as road.

        Parameters
        ----------
        disparity : array_like, shape (H, W)
            The map that was estimated.

        Returns
        -------
        ndarray of bool, shape (H, W)
        """
        values = np.asarray(disparity)
        used = _valid(values, self._usable)
        return used if self._surface is None else used & self._surface.covers(values)


def estimate_roll(
    disparity: ArrayLike,
    *,
    mask: ArrayLike | None = None,
    method: str = "gd",
    model: str = "parabola",
    road: str = "auto",
    lambda0: float | Literal["auto"] = LAMBDA0,
    tolerance: float = TOLERANCE,
    max_roll: float = math.radians(45),
    seed: int = 0,
) -> RollEstimate:
    """Estimate the roll angle of the rig that a disparity map was taken with.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Real numbers, px (any constant factor gives the same angle); <= 0, NaN and inf are no data.
    mask : array_like, shape (H, W), optional
        Non-zero where a pixel may be used.
    method : {"gd", "gss", "exact", "plane", "areas"}
    model : {"parabola", "line"}
    road : {"auto", "all"}
        Find the road first, or use every valid pixel as the paper does.
    lambda0 : float or "auto"
        First learning rate of "gd".
    tolerance : float
        delta_theta of the paper, radians.
    max_roll : float
        The largest abs(roll) that road finding considers, radians.
    seed : int
        Of road finding.

    Returns
    -------
    RollEstimate

    Raises
    ------
    UsageError
        When an argument is out of range.
    EstimationError
        When the pixels do not determine an angle.
    """
    values = _checked_map(disparity)
    _check_arguments(method, model, road, lambda0, tolerance, max_roll)
    usable = None if mask is None else _checked_mask(mask, values)
    valid = _valid(values, usable)
    count = require_pixels(valid)
    if road == "auto":
        pixels = _find(values, usable, max_roll, seed, parabolic=model == "parabola")
    else:
        pixels = _take_all(values, valid, parabolic=model == "parabola")
    solution: Solution
    if method in AREA_METHODS:
        pixels, solution = _solve_area(values, valid, pixels, method, max_roll, chosen=usable is not None)
    else:
        solution = _solve(pixels.energy, method, tolerance, lambda0)
    energy, surface = pixels.energy, pixels.surface
    lowest, *others = minima(energy)
    slack = 1e-9 * (energy.rest + energy.slope_energy)
    is_global = float(energy.at(solution.theta).value) <= lowest.energy + slack
    notes = []
    if not is_global and pixels.road is not None:
        notes.append(f"replaced a local minimum of the energy at {math.degrees(solution.theta):.4f} degrees")
        solution, is_global = replace(solution, theta=lowest.theta), True
    ci95 = None if surface is None else half_width(surface, solution.theta)
    doubts = verdict.of_solution(solution, energy, lowest, others, is_global=is_global)
    if pixels.road is not None and surface is not None:
        doubts += verdict.of_road(pixels.road, surface, max_roll)
    doubts += verdict.of_interval(ci95)
    height, width = values.shape
    return RollEstimate(
        theta=solution.theta,
        ci95=ci95,
        status="suspect" if doubts else "ok",
        message="; ".join(doubts + notes),
        method=method,
        iterations=solution.iterations,
        converged=solution.outcome.converged,
        global_minimum=None if method in AREA_METHODS else is_global,
        rmse=energy.rmse(solution.theta),
        alpha=energy.parabola(solution.theta),
        valid_fraction=count / values.size,
        road_fraction=pixels.share,
        width=width,
        height=height,
        _usable=usable if pixels.area is None else pixels.area,
        _surface=None if pixels.road is None or pixels.area is not None else surface,
    )


@dataclass(frozen=True)
class _Pixels:
    """What an angle rests on.

    `road` is None where it was not looked for, `area` where the method does not choose the pixels itself;
    `share` is that of the valid pixels which were used.
    """

    energy: Energy
    surface: Surface | None
    road: Road | None
    share: float
    area: NDArray[np.bool_] | None = None


def _find(
    values: NDArray[Any], usable: NDArray[np.bool_] | None, max_roll: float, seed: int, *, parabolic: bool
) -> _Pixels:
    """Find the road, and sum its pixels by their weights."""
    sample = take_sample(values, usable)
    found = find_road(sample, max_roll, seed)
    surface = fit_surface(sample, found, parabolic=parabolic)
    _, slope, _ = surface.alpha
    plane = (surface.alpha[0], -slope * math.sin(surface.theta), slope * math.cos(surface.theta))
    moments = point_moments(surface.x, surface.y, surface.d, surface.weights, sample.grid, plane)
    return _Pixels(
        Energy.of(moments, float(surface.d.max()), parabolic=parabolic), surface, found, surface.share
    )


def _take_all(values: NDArray[Any], valid: NDArray[np.bool_], *, parabolic: bool) -> _Pixels:
    """Sum every valid pixel, as the paper does; a sample of them tells how sure that is."""
    energy = Energy.of(map_moments(values, valid), float(values[valid].max()), parabolic=parabolic)
    return _Pixels(energy, _sampled_surface(values, valid, energy), None, 1.0)


def _sampled_surface(values: NDArray[Any], used: NDArray[np.bool_], energy: Energy) -> Surface | None:
    try:
        return whole_surface(take_sample(values, used), energy)
    except EstimationError:  # too small a map to be sampled: an angle without an interval
        return None


def _solve_area(
    values: NDArray[Any],
    valid: NDArray[np.bool_],
    pixels: _Pixels,
    method: str,
    max_roll: float,
    *,
    chosen: bool,
) -> tuple[_Pixels, AreaSolution]:
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
    return _Pixels(solution.energy, surface, pixels.road, share, solution.used), solution


def _solve(energy: Energy, method: str, tolerance: float, lambda0: float | Literal["auto"]) -> Solution:
    if method == "gd":
        return gradient_descent(energy, tolerance, lambda0)
    if method == "gss":
        return golden_section(energy, tolerance)
    return exact(energy)


def _check_arguments(
    method: str, model: str, road: str, lambda0: float | Literal["auto"], tolerance: float, max_roll: float
) -> None:
    for name, value, choices in (
        ("method", method, METHODS),
        ("model", model, MODELS),
        ("road", road, ROADS),
    ):
        if value not in choices:
            raise UsageError(f"{name} {value!r}: choose one of {', '.join(choices)}")
    if lambda0 != "auto" and not 0 < lambda0 < math.inf:
        raise UsageError(f"lambda0 {lambda0}: give a positive number, or auto")
    if not tolerance > 0:
        raise UsageError(f"a tolerance of {math.degrees(tolerance):g} degrees: give a positive angle")
    if not 0 < max_roll <= MAX_ROLL_LIMIT * (1 + 1e-12):
        raise UsageError(
            f"a largest roll of {math.degrees(max_roll):g} degrees: give more than 0, at most 89"
        )


def _checked_map(disparity: ArrayLike) -> NDArray[Any]:
    values = np.asarray(disparity)
    if values.ndim != 2 or values.dtype.kind not in "fiub":
        raise UsageError(
            f"a disparity map is a 2-D array of real numbers, not {values.ndim}-D {values.dtype}"
        )
    return values


def _checked_mask(mask: ArrayLike, values: NDArray[Any]) -> NDArray[np.bool_]:
    usable: NDArray[np.bool_] = np.asarray(mask) != 0
    if usable.shape != values.shape:
        raise UsageError(
            f"the mask is {_size(usable)}, the map {_size(values)}: give a mask of the map's size"
        )
    return usable


def _valid(values: NDArray[Any], usable: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    valid: NDArray[np.bool_] = values > 0
    if values.dtype.kind == "f":
        valid &= values < np.inf
    if usable is not None:
        valid &= usable
    return valid


def _size(array: NDArray[Any]) -> str:
    return "x".join(str(n) for n in array.shape[::-1])
