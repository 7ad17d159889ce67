"""From a disparity map to a roll angle: which pixels, their moments, a solver, how sure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.energy import Energy
from rollcli.estimator.exact import exact, minima
from rollcli.estimator.golden_section import golden_section
from rollcli.estimator.gradient_descent import LAMBDA0, TOLERANCE, gradient_descent
from rollcli.estimator.moments import map_moments
from rollcli.estimator.pixels import require_pixels
from rollcli.estimator.solution import Solution

METHODS = ("gd", "gss", "exact", "plane", "areas")
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
    _mask: NDArray[np.bool_] | None = field(default=None, repr=False, compare=False)

    def road_mask(self, disparity: ArrayLike) -> NDArray[np.bool_]:
        """Return the pixels of `disparity` (H, W) that were used as road."""
        used = np.asarray(disparity) > 0
        return used if self._mask is None else used & self._mask


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
    valid = (values > 0) & (values < np.inf)
    if mask is not None:
        usable = np.asarray(mask) != 0
        if usable.shape != values.shape:
            raise UsageError(
                f"the mask is {_size(usable)}, the map {_size(values)}: give a mask of the map's size"
            )
        valid &= usable
    count = require_pixels(valid)
    peak = float(values.max(where=valid, initial=0))
    energy = Energy.of(map_moments(values, valid), peak, parabolic=model == "parabola")
    solution = _solve(energy, method, tolerance, lambda0)
    reasons = []
    if not solution.outcome.converged:
        reasons.append(solution.outcome.value)
    lowest = minima(energy)[0]
    slack = 1e-9 * (energy.rest + energy.slope_energy)
    is_global = float(energy.at(solution.theta).value) <= lowest.energy + slack
    if not is_global:
        reasons.append(f"a lower minimum of the energy lies at {math.degrees(lowest.theta):.4f} degrees")
    _, c1, c2 = energy.plane
    if c2 * math.cos(solution.theta) - c1 * math.sin(solution.theta) < 0:
        reasons.append("disparity grows upward, as it does in a depth map")
    height, width = values.shape
    return RollEstimate(
        theta=solution.theta,
        ci95=None,
        status="suspect" if reasons else "ok",
        message="; ".join(reasons),
        method=method,
        iterations=solution.iterations,
        converged=solution.outcome.converged,
        global_minimum=is_global,
        rmse=energy.rmse(solution.theta),
        alpha=energy.parabola(solution.theta),
        valid_fraction=count / values.size,
        road_fraction=1.0,
        width=width,
        height=height,
        _mask=None if mask is None else usable,
    )


def _solve(energy: Energy, method: str, tolerance: float, lambda0: float | Literal["auto"]) -> Solution:
    if method == "gd":
        return gradient_descent(energy, tolerance, lambda0)
    if method == "gss":
        return golden_section(energy, tolerance)
    if method == "exact":
        return exact(energy)
    raise UsageError(f"method {method!r} is not one of {', '.join(METHODS)}")


def _checked_map(disparity: ArrayLike) -> NDArray[Any]:
    values = np.asarray(disparity)
    if values.ndim != 2 or values.dtype.kind not in "fiub":
        raise UsageError(
            f"a disparity map is a 2-D array of real numbers, not {values.ndim}-D {values.dtype}"
        )
    return values


def _size(array: NDArray[Any]) -> str:
    return "x".join(str(n) for n in array.shape[::-1])
