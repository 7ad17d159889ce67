"""From a disparity map to a roll angle: which pixels, their moments, a solver, how sure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.doubts import doubts_of_interval, doubts_of_road, doubts_of_solution
from rollcli.estimator.energy import Energy
from rollcli.estimator.interval import half_width, jackknife
from rollcli.estimator.moments import Grid
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.selection import Pixels, take_all, take_area, take_road
from rollcli.estimator.solvers.exact import Minimum, exact, minima
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.estimator.solvers.gradient_descent import LAMBDA0, TOLERANCE, gradient_descent
from rollcli.estimator.solvers.solution import Solution, apart
from rollcli.estimator.tangent import Tangent, touch
from rollcli.estimator.validity import LARGEST, require_pixels

AREA_METHODS = ("plane", "areas")
METHODS = ("gd", "gss", "exact", *AREA_METHODS)
MODELS = ("parabola", "line")
ROADS = ("auto", "all")
MAX_ROLL_LIMIT = math.radians(89)
_SAME_BASIN = math.radians(0.01)


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
    tangent : Tangent
        The line that touches the road's parabola amid the pixels used.
    pitch, pitch_ci95 : float or None
        Angle of the optical axis to the road near ahead, radians, positive: looks down; and the half-width
        of its 95 % interval, given the calibration. None without one.
    height_m, height_ci95_m : float or None
        Height of the left camera over the road near ahead, metres; None without a baseline.
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
    tangent: Tangent
    pitch: float | None = None
    pitch_ci95: float | None = None
    height_m: float | None = None
    height_ci95_m: float | None = None
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
        values, used = _cleaned(np.asarray(disparity), self._usable)
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
        Real numbers, px (any constant factor gives the same angle); <= 0, NaN and what is beyond
        1e15 are no data.
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

    Examples
    --------
    A flat road that fills the map, seen by a rig whose right end is up by 3 degrees:

    >>> v, u = np.mgrid[:120, :160]
    >>> road = 60 + 0.3 * (v * math.cos(math.radians(3)) - u * math.sin(math.radians(3)))
    >>> estimate = estimate_roll(road)
    >>> estimate.status, round(math.degrees(estimate.theta), 3)
    ('ok', 3.0)
    """
    values = _checked_map(disparity)
    _check_arguments(method, model, road, lambda0, tolerance, max_roll)
    usable = None if mask is None else _checked_mask(mask, values)
    values, valid = _cleaned(values, usable)
    count = require_pixels(valid)
    if road == "auto":
        pixels = take_road(values, usable, max_roll, seed, parabolic=model == "parabola")
    else:
        pixels = take_all(values, usable, parabolic=model == "parabola")
    notes: list[str] = []
    solution: Solution
    if method in AREA_METHODS:
        pixels, solution = take_area(values, valid, pixels, method, max_roll, chosen=usable is not None)
        basins = minima(pixels.energy)
    else:
        solution = _solve(pixels.energy, method, tolerance, lambda0)
        basins = minima(pixels.energy)
        meant = solution.theta if pixels.road is None else _meant(basins, pixels)
        if apart(solution.theta, meant) > max(10 * tolerance, _SAME_BASIN):
            notes.append(
                f"replaced the minimum that {method} found, {math.degrees(solution.theta):.4f} degrees"
            )
            solution = replace(solution, theta=meant)
    energy, surface = pixels.energy, pixels.surface
    slack = 1e-9 * (energy.rest + energy.slope_energy)
    is_global = float(energy.at(solution.theta).value) <= basins[0].energy + slack
    knife = None if surface is None else jackknife(surface, solution.theta)
    ci95 = None if knife is None else half_width(knife, solution.theta)
    alpha = energy.parabola(solution.theta)
    doubts = doubts_of_solution(solution, energy, basins, is_global=is_global)
    if pixels.road is not None and surface is not None:
        doubts += doubts_of_road(pixels.road, surface, max_roll)
    doubts += doubts_of_interval(ci95)
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
        alpha=alpha,
        valid_fraction=count / values.size,
        road_fraction=pixels.share,
        width=width,
        height=height,
        tangent=touch(alpha, solution.theta, Grid.of_shape(height, width), surface, knife),
        _usable=usable if pixels.area is None else pixels.area,
        _surface=surface if pixels.road is not None and pixels.area is None else None,
    )


def _meant(basins: list[Minimum], pixels: Pixels) -> float:
    """Return the minimum that belongs to the road: a thin strip of it can have a deeper one elsewhere."""
    if pixels.surface is None:
        return basins[0].theta
    theta = pixels.surface.theta
    return min(basins, key=lambda basin: apart(basin.theta, theta)).theta


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


def _cleaned(
    values: NDArray[Any], usable: NDArray[np.bool_] | None
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Return a map without what is too large, and where it has a disparity that may be used."""
    if values.dtype.kind == "f" and (large := values >= LARGEST).any():
        values = np.where(large, 0, values)
    valid: NDArray[np.bool_] = values > 0
    if usable is not None:
        valid &= usable
    return values, valid


def _size(array: NDArray[Any]) -> str:
    return "x".join(str(n) for n in array.shape[::-1])
