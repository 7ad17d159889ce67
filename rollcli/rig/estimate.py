"""The estimator with a calibration: roll, pitch and height of one map."""

from typing import Any

from numpy.typing import ArrayLike

from rollcli.estimator import estimate as estimator
from rollcli.estimator.result import RollEstimate
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import with_pose


def estimate_roll(
    disparity: ArrayLike, *, calibration: Calibration | None = None, **settings: Any
) -> RollEstimate:
    """Estimate the roll angle of the rig that a disparity map was taken with; its pose, given a calibration.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Real numbers, px; <= 0, NaN and what is beyond 1e15 are no data.
    calibration : Calibration, optional
        Of the rectified left view, at the map's size or at another one; see `read_calibration`.
    **settings
        mask, method, model, road, lambda0, tolerance, max_roll, max_interval, seed and road_mask: see
        `rollcli.estimator.estimate.estimate_roll`.

    Returns
    -------
    RollEstimate
        Angles in radians, the height in metres.

    Raises
    ------
    UsageError
        When an argument is out of range, or the calibration is of another view.
    EstimationError
        When the pixels do not determine an angle.

    Examples
    --------
    A level road 1.5 m below a rig that looks down by 0.2 radians:

    >>> import numpy as np
    >>> from rollcli.rig.calibration import Calibration
    >>> rig = Calibration(fx=200, fy=200, cx=79.5, cy=59.5, baseline=0.5)
    >>> v = np.mgrid[:120, :160][0]
    >>> road = 200 * 0.5 / 1.5 * ((v - 59.5) / 200 * np.cos(0.2) + np.sin(0.2))
    >>> found = estimate_roll(road, calibration=rig)
    >>> round(found.pitch, 4), round(found.height_m, 4)
    (0.2, 1.5)
    """
    estimate = estimator.estimate_roll(disparity, **settings)
    return estimate if calibration is None else with_pose(estimate, calibration)
