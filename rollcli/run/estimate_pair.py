"""The roll of a stereo pair in one call, as `rollcli estimate --left --right` finds it."""

import math
import os
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.estimator.request import (
    DEFAULT_SOLVER,
    MAX_INTERVAL_DEG,
    MAX_ROLL_DEG,
    MAX_ROLL_LIMIT_DEG,
    LearningRate,
)
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import with_pose
from rollcli.run.calibration import given_calibration
from rollcli.run.options import FrameOptions, MethodOptions
from rollcli.run.read import matched_source
from rollcli.stereo.match import StereoOptions


def estimate_pair(
    left: NDArray[Any],
    right: NDArray[Any],
    *,
    calibration: Calibration | str | os.PathLike[str] | None = None,
    mask: ArrayLike | None = None,
    stereo: StereoOptions | None = None,
    method: str = "gd",
    model: str = "parabola",
    road: str = "auto",
    lambda0: LearningRate = DEFAULT_SOLVER.lambda0,
    tolerance: float = DEFAULT_SOLVER.tolerance,
    max_roll: float = math.radians(MAX_ROLL_DEG),
    max_interval: float = math.radians(MAX_INTERVAL_DEG),
    seed: int = 0,
    road_mask: bool = False,
) -> RollEstimate:
    """Level and match a rectified pair, and estimate its rig's roll angle; its pose, given a calibration.

    Parameters
    ----------
    left, right : ndarray, shape (H, W) or (H, W, 3)
        uint8 or uint16, grey or BGR, of equal size.
    calibration : Calibration or path, optional
        Of the rectified left image; see `read_calibration`.
    mask : array_like, optional
        Non-zero where a pixel may be used; of the shape that is matched at: (H, W) over `stereo.downscale`.
    stereo : StereoOptions, optional
        How the pair is matched; by default as the command does.
    method, model, road, lambda0, tolerance, max_roll, max_interval, seed, road_mask
        See `rollcli.estimator.estimate.estimate_roll`.

    Returns
    -------
    RollEstimate
        The interval knows what levelling left; `message` says why the map may be wrong.

    Raises
    ------
    InputError
        The images differ in size, are too small to match, are swapped, or do not show the same scene.
    UsageError
        An argument is out of range, or the calibration is of another view.
    EstimationError
        The pixels do not determine an angle.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> right = rng.integers(0, 256, (120, 320), dtype=np.uint8)
    >>> rows = [np.roll(row, 10 + v // 8) for v, row in enumerate(right)]
    >>> abs(math.degrees(estimate_pair(np.stack(rows), right, road="all").theta)) < 1
    True
    """
    if not 0 < max_roll <= math.radians(MAX_ROLL_LIMIT_DEG) * (1 + 1e-12):
        raise UsageError(f"a largest roll of {math.degrees(max_roll):g} degrees: give more than 0")
    asked = MethodOptions(road=road, max_roll_deg=math.degrees(max_roll), seed=seed)
    options = FrameOptions(stereo=stereo or StereoOptions(), method=asked)
    rig = given_calibration(calibration)
    allowed = None if mask is None else np.asarray(mask) != 0
    if allowed is not None and not (allowed.ndim == 2 and allowed.any()):
        raise UsageError("the mask leaves no pixel of the map: give an array that is not all zero")
    source = matched_source(left, right, allowed, options)
    height, width = left.shape[:2]
    estimate = estimate_roll(
        source.disparity,
        mask=allowed,
        slope_error=source.slope_error,
        method=method,
        model=model,
        road=road,
        lambda0=lambda0,
        tolerance=tolerance,
        max_roll=max_roll,
        max_interval=max_interval,
        seed=seed,
        road_mask=road_mask,
    )
    if source.doubt:
        message = "; ".join(filter(None, [estimate.message, source.doubt]))
        estimate = replace(estimate, status="suspect", message=message)
    return estimate if rig is None else with_pose(estimate, rig.for_size(width, height))
