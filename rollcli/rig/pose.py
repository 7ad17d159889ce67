"""Pitch and height of the rig from the tangent of the road, with their intervals, beside its roll."""

import math
from dataclasses import dataclass, replace

from rollcli.estimator.estimate import RollEstimate
from rollcli.estimator.interval import Tangent
from rollcli.estimator.road.model import rig_turns
from rollcli.rig.calibration import LIKELY_BASELINE, Calibration

_AT_EDGE = "; its principal point lies near the edge: is it of images of this size?"


@dataclass(frozen=True)
class IntervalTuning:
    """What makes half-widths of 95 % intervals of the jackknife's changes.

    Attributes
    ----------
    factor : float
        On the root of the sum of squares: 0.95 to 0.96 of 180 rendered pairs are covered, and poses of all 9
        real streets at full and at half size agree (tests/benchmarks/bench_pose.py).
    uneven : float
        Of the road's unevenness (`Jackknife.uneven`) over the distance of the tangent in camera heights:
        radians. Of rendered roads of ISO 8608's classes A to D, without it 0.1 to 0.2 are covered
        (tests/benchmarks/bench_pose.py).
    """

    factor: float = 0.47
    uneven: float = 32.0


TUNING = IntervalTuning()


@dataclass(frozen=True)
class Pose:
    """How the rig stands over the road.

    Attributes
    ----------
    roll : float
        About the optical axis, radians; the estimator's theta, corrected where fx and fy differ.
    pitch : float
        Of the optical axis to the road, radians; positive: looks down.
    height : float or None
        Of the left camera over the road, metres; None without a baseline.
    """

    roll: float
    pitch: float
    height: float | None


def pose_of(tangent: Tangent, calibration: Calibration) -> Pose:
    """Return the pose over the plane of a tangent.

    Parameters
    ----------
    tangent : Tangent
        With a slope of more than 0: a road's disparity grows downward.
    calibration : Calibration
        Of a map of this size.

    Returns
    -------
    Pose
    """
    fx, fy, slope = calibration.fx, calibration.fy, tangent.slope
    cosine, sine = math.cos(tangent.theta), math.sin(tangent.theta)
    below = calibration.cy * cosine - calibration.cx * sine - tangent.row  # the principal point, rolled frame
    # the plane's normal over its height, in baselines
    right, down = -slope * sine, slope * cosine * fy / fx
    ahead = (tangent.disparity + slope * below + calibration.doffs) / fx
    level = math.hypot(right, down)
    return Pose(
        roll=math.atan2(-right, down),
        pitch=math.atan2(ahead, level),
        height=None if calibration.baseline is None else calibration.baseline / math.hypot(level, ahead),
    )


def with_pose(estimate: RollEstimate, calibration: Calibration) -> RollEstimate:
    """Return an estimate with pitch and height, and with the roll of the rig where fx and fy differ.

    Parameters
    ----------
    estimate : RollEstimate
    calibration : Calibration
        Of the map or of the same view at another size.

    Returns
    -------
    RollEstimate
        Without pitch and height where the road's disparity does not grow downward.

    Raises
    ------
    UsageError
        The calibration is of another view: see `Calibration.for_size`.
    """
    calibration = calibration.for_size(estimate.width, estimate.height)
    tangent = estimate.tangent
    if tangent.slope <= 0:
        why = "no pose: the disparity does not grow down"
        return replace(estimate, message="; ".join(filter(None, [estimate.message, why])))
    pose = pose_of(tangent, calibration)
    pitch_ci95, height_ci95 = _half_widths(tangent, calibration, pose)
    turns = rig_turns(tangent.theta, calibration.aspect)
    # a place beside the lane is nearer by the pitch, and where the estimate knew of no other fy than fx
    nearer = math.cos(pose.pitch) * turns / rig_turns(tangent.theta, tangent.grid.aspect)
    return replace(
        estimate,
        theta=pose.roll,
        ci95=None if estimate.ci95 is None else min(estimate.ci95 * turns, math.pi / 2),
        camber=None if estimate.camber is None else estimate.camber * nearer**2,
        pitch=pose.pitch,
        pitch_ci95=pitch_ci95,
        height_m=pose.height,
        height_ci95_m=height_ci95,
    )


def horizon_row(tangent: Tangent, calibration: Calibration) -> float | None:
    """Return the y of the road's horizon, px: where the tangent's points are infinitely far away.

    None where the disparity does not grow downward: such a plane is no road.
    """
    if tangent.slope <= 0:
        return None
    return tangent.row - (tangent.disparity + calibration.doffs) / tangent.slope


def taken_as_exact(calibration: Calibration, pitch: float, height: float | None, scale: float = 1.0) -> str:
    """Say in one line what the intervals cannot know: errors of the calibration, and what they would do.

    Parameters
    ----------
    calibration : Calibration
    pitch : float
        Radians.
    height : float or None
        Metres; None without a baseline.
    scale : float
        Width of the maps, as a share of that of the images of the calibration.
    """
    turn = math.degrees(math.cos(pitch) ** 2)
    said = f"the calibration as exact: {turn / calibration.fy:.3f} degrees of pitch per px of cy"
    if calibration.baseline is not None and height is not None:
        down = scale * calibration.fx * calibration.baseline * math.cos(pitch) / height  # fx times the slope
        said += f", {0.1 * turn / down:.3f} per 0.1 px of disparity (vergence)"
        said += ", 1 % of height per 1 % of baseline"
        least, most = LIKELY_BASELINE
        if not least <= calibration.baseline <= most:
            said += f"; its baseline is {calibration.baseline:g} m: is it in metres?"
    edge = _AT_EDGE if calibration.at_edge else ""
    return f"{'pitch and height take' if calibration.baseline is not None else 'pitch takes'} {said}{edge}"


def _half_widths(tangent: Tangent, calibration: Calibration, pose: Pose) -> tuple[float | None, float | None]:
    """Return those of pitch and height: the tangents that the jackknife leaves, and what uneven ground adds.

    Of the height None where nothing is known of the ground.

    Notes
    -----
    Uneven ground turns the tangent from what fits the lane ahead: by a height over the distance at which it
    touches. On rendered roads that it touches 2 to 11 m ahead, the two cross at about twice the root of that
    distance times the camera's height; that far times the turn, the height is off.
    """
    changes, knife = tangent.changes, tangent.jackknife
    if changes is None or knife is None:
        return None, None
    theta, row, disparity, slope = tangent.theta, tangent.row, tangent.disparity, tangent.slope
    moved = [
        pose_of(Tangent(theta + turned, row, disparity + nearer, slope + steeper), calibration)
        for nearer, steeper, turned in changes.tolist()
    ]
    noise = TUNING.factor * math.hypot(*(each.pitch - pose.pitch for each in moved))
    near = abs((disparity + calibration.doffs) * math.cos(pose.pitch) / (calibration.fy * slope))
    pitch = min(math.hypot(noise, TUNING.uneven * knife.uneven * near), math.pi / 2)
    if pose.height is None or not math.isfinite(knife.uneven):
        return pitch, None
    noise = TUNING.factor * math.hypot(*(each.height - pose.height for each in moved if each.height))
    return pitch, math.hypot(noise, 2 * TUNING.uneven * knife.uneven * math.sqrt(near) * pose.height)
