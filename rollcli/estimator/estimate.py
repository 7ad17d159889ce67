"""From a disparity map to a roll angle: which pixels, a solver, how sure, what speaks against it."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import ArrayLike

from rollcli.estimator.doubts import doubts_of
from rollcli.estimator.interval import Tangent, interval_of, jackknife, touch
from rollcli.estimator.moments import Bools, CheckedMap, Grid
from rollcli.estimator.request import AREAS, DEFAULT_REQUEST, SOLVERS, Request
from rollcli.estimator.road.model import Parabola, rig_turns
from rollcli.estimator.road.pixels import PixelSet, select_pixels
from rollcli.estimator.solvers.exact import CertifiedSolution, certify


@dataclass(frozen=True)
class RollEstimate:
    """The roll of one map, and what it rests on.

    Attributes
    ----------
    theta : float
        Roll, radians, in (-pi/2, pi/2]; positive: the rig is turned counter-clockwise seen from behind.
    ci95 : float or None
        Half-width of the 95 % interval, radians, assuming the pixels used are road; None where the map is
        too small to tell.
    status : str
        "ok", or "suspect": `message` says why the angle is doubtful.
    message : str
        Reasons to doubt, and notes: of another minimum that was replaced, of how a pair without enough road
        was matched, of why there is no pose; joined by "; ". Else empty.
    method : str
    iterations : int
    converged : bool
    global_minimum : bool or None
        Whether `theta` is the proven global minimum of the energy; None for methods that do not minimise it.
    rmse : float
        Root mean squared residual of the pixels used, px; with `road` "auto" of weighted averages of five.
    alpha : tuple of float
        The road's (a0, a1, a2), px, y measured from the centre of the top-left pixel.
    valid_fraction, road_fraction : float
        The share of all pixels that is valid, and the share of the valid ones that the road's fit used.
    width, height : int
        Of the map, px.
    camber : float or None
        Curvature across the road, 1/(camera height): x camera heights to the side, the surface is higher by
        camber/2 x^2 camera heights. Negative: crowned. 0 where it may be noise; None where the map does not
        determine it. Without a calibration it is that of a level camera: 1 / cos(pitch)^2 times as large.
    tangent : Tangent
        The line that touches the road's parabola amid the pixels used.
    pitch, pitch_ci95 : float or None
        Angle of the optical axis to the road near ahead, radians, positive: looks down; and the half-width
        of its 95 % interval, given the calibration. None without one.
    height_m, height_ci95_m : float or None
        Height of the left camera over the road near ahead, metres; None without a baseline.
    road_mask : ndarray of bool, shape (H, W), or None
        The pixels that lie on the road that was found, where this was asked for.
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
    alpha: Parabola
    valid_fraction: float
    road_fraction: float
    width: int
    height: int
    camber: float | None
    tangent: Tangent
    pitch: float | None = None
    pitch_ci95: float | None = None
    height_m: float | None = None
    height_ci95_m: float | None = None
    road_mask: Bools | None = field(default=None, repr=False, compare=False)

    @property
    def roll_deg(self) -> float:
        """`theta` in degrees, as the column of a result; so are the next four."""
        return math.degrees(self.theta)

    @property
    def roll_ci95_deg(self) -> float | None:
        """`ci95` in degrees."""
        return _degrees(self.ci95)

    @property
    def pitch_deg(self) -> float | None:
        """`pitch` in degrees."""
        return _degrees(self.pitch)

    @property
    def pitch_ci95_deg(self) -> float | None:
        """`pitch_ci95` in degrees."""
        return _degrees(self.pitch_ci95)

    @property
    def image_roll_deg(self) -> float:
        """Angle that the map is turned by, degrees: another one than the rig's where fx and fy differ."""
        return math.degrees(self.tangent.theta)

    def to_dict(self) -> dict[str, Any]:
        """Return what a row of a result says of the estimate, by column: strings, numbers and None.

        Returns
        -------
        dict
            As JSON can write it; `assess_rig` takes a list of these.
        """
        alpha0, alpha1, alpha2 = self.alpha
        return {
            "status": self.status,
            "roll_deg": self.roll_deg,
            "roll_ci95_deg": self.roll_ci95_deg,
            "pitch_deg": self.pitch_deg,
            "pitch_ci95_deg": self.pitch_ci95_deg,
            "height_m": self.height_m,
            "height_ci95_m": self.height_ci95_m,
            "camber": self.camber,
            "method": self.method,
            "iterations": self.iterations,
            "converged": self.converged,
            "global_minimum": self.global_minimum,
            "rmse_px": self.rmse,
            "alpha0": alpha0,
            "alpha1": alpha1,
            "alpha2": alpha2,
            "valid_fraction": self.valid_fraction,
            "road_fraction": self.road_fraction,
            "width": self.width,
            "height": self.height,
            "message": self.message,
            "image_roll_deg": self.image_roll_deg,
        }


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def estimate_roll(
    disparity: ArrayLike,
    request: Request = DEFAULT_REQUEST,
    *,
    mask: ArrayLike | None = None,
    road_mask: bool = False,
) -> RollEstimate:
    """Estimate the roll angle of the rig that a disparity map was taken with.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Real numbers, px (a constant factor changes no angle, as long as they lie from 1e-12 to 1e12);
        <= 0, NaN and what is beyond 1e15 are no data.
    request : Request, optional
    mask : array_like, shape (H, W), optional
        Neither 0 nor NaN where a pixel may be used.
    road_mask : bool
        Whether to return which pixels were used as road.

    Returns
    -------
    RollEstimate

    Raises
    ------
    UsageError
        When these are no map, or no mask of its size.
    EstimationError
        When the pixels do not determine an angle.

    Examples
    --------
    A flat road that fills the map, seen by a rig whose right end is up by 3 degrees:

    >>> v, u = np.mgrid[:120, :160]
    >>> road = 10 + 0.3 * (v * math.cos(math.radians(3)) - u * math.sin(math.radians(3)))
    >>> estimate = estimate_roll(road)
    >>> estimate.status, round(math.degrees(estimate.theta), 3)
    ('ok', 3.0)
    """
    tuning = request.tuning
    checked = CheckedMap.of(disparity, mask, request.doffs)
    pixels = select_pixels(checked, request)
    certified = _solve(pixels, request)
    theta, surface = certified.solution.theta, pixels.surface
    knife = None if surface is None else jackknife(surface, theta, tuning.interval)
    alpha = pixels.energy.parabola(theta)
    height, width = checked.values.shape
    grid = Grid.of_shape(height, width, request.middle, request.aspect)
    tangent = touch(alpha, theta, grid, surface, knife)
    turned = math.hypot(tangent.turned_by(request.slope_error), certified.off)
    turns = rig_turns(theta, request.aspect)
    interval = None if knife is None else interval_of(knife, theta, turned, tuning.interval, turns)
    doubts, notes = list(doubts_of(checked, pixels, certified, interval, request)), []
    if certified.replaced is not None:
        replaced = math.degrees(certified.replaced)
        notes = [f"replaced the minimum that {request.method} found, {replaced:.4f} degrees"]
    return RollEstimate(
        theta=theta,
        ci95=None if interval is None else interval.half_width,
        status="suspect" if doubts else "ok",
        message="; ".join(doubts + notes),
        method=request.method,
        iterations=certified.solution.iterations,
        converged=certified.solution.status.converged,
        global_minimum=None if request.method in AREAS else certified.is_global,
        rmse=pixels.energy.rmse(certified.energy),
        alpha=(alpha[0] - request.doffs, *alpha[1:]),
        valid_fraction=checked.count / checked.values.size,
        road_fraction=pixels.share,
        width=width,
        height=height,
        camber=None if knife is None else knife.camber,
        tangent=replace(tangent, disparity=tangent.disparity - request.doffs),
        road_mask=pixels.mask(checked, tuning) if road_mask else None,
    )


def _solve(pixels: PixelSet, request: Request) -> CertifiedSolution:
    """Find the angle, unless the method that chose the pixels did, and compare it with all minima."""
    if pixels.solution is not None:
        return certify(pixels.energy, pixels.solution)
    solution = SOLVERS[request.method].load()(pixels.energy, request)
    road_theta = pixels.surface.model.theta if pixels.road and pixels.surface else None
    return certify(pixels.energy, solution, road_theta, request.tolerance)
