"""What the estimator says of one map."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.interval import Tangent


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
    camber : float or None
        Curvature across the road, 1/(camera height): x camera heights to the side, the surface is higher by
        camber/2 x^2 camera heights. Negative: crowned. None where the map does not determine it.
    tangent : Tangent
        The line that touches the road's parabola amid the pixels used.
    pitch, pitch_ci95 : float or None
        Angle of the optical axis to the road near ahead, radians, positive: looks down; and the half-width
        of its 95 % interval, given the calibration. None without one.
    height_m, height_ci95_m : float or None
        Height of the left camera over the road near ahead, metres; None without a baseline.
    road_mask : ndarray of bool, shape (H, W), or None
        The pixels that were used as road, where this was asked for.
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
    camber: float | None
    tangent: Tangent
    pitch: float | None = None
    pitch_ci95: float | None = None
    height_m: float | None = None
    height_ci95_m: float | None = None
    road_mask: NDArray[np.bool_] | None = field(default=None, repr=False, compare=False)
