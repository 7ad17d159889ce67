"""For Python: the roll of a map, and of a pair, as `rollcli estimate` finds it; the frames of a recording."""

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError, as_usage
from rollcli.estimator.estimate import RollEstimate
from rollcli.estimator.moments import map_of, usable_of
from rollcli.estimator.request import DEFAULT_REQUEST, LearningRate, Request
from rollcli.extras import require_extra
from rollcli.files.codecs.pictures import views_of
from rollcli.files.containers import bag_files, is_video
from rollcli.files.encodings import Encoding, to_disparity
from rollcli.files.formats import Stored, read_image, read_stored
from rollcli.files.naming import Input
from rollcli.rig.calibration import Calibration, request_with
from rollcli.rig.pose import with_pose
from rollcli.run.diagnosis import REMEDIES, estimate_or_liken, looks_like, not_pixels
from rollcli.run.find import given_calibration
from rollcli.run.options import FramesOptions, MethodOptions
from rollcli.run.read import Source, matched_source, road_finder
from rollcli.stereo.options import StereoOptions


@np.errstate(all="ignore")  # whatever its caller wants of numbers: weights underflow in most maps
def estimate_roll(
    disparity: ArrayLike,
    *,
    calibration: Calibration | str | os.PathLike[str] | None = None,
    mask: ArrayLike | None = None,
    method: str = "gd",
    model: str = "parabola",
    road: str = "auto",
    lambda0: LearningRate = DEFAULT_REQUEST.lambda0,
    tolerance: float = DEFAULT_REQUEST.tolerance,
    max_roll: float = DEFAULT_REQUEST.max_roll,
    max_interval: float = DEFAULT_REQUEST.max_interval,
    slope_error: float = 0.0,
    seed: int = 0,
    road_mask: bool = False,
) -> RollEstimate:
    """Estimate the roll angle of the rig that a disparity map was taken with; its pose, given a calibration.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Real numbers, px; <= 0, NaN, what is beyond 1e15 and what a masked array hides are no data.
    calibration : Calibration or path, optional
        Of the rectified left view, at the map's size or at another one; see `read_calibration`.
    mask : array_like, shape (H, W), optional
        Neither 0 nor NaN where a pixel may be used.
    method : {"gd", "gss", "exact", "plane", "areas"}
        The solver: gradient descent, golden section search, the global minimum; or one plane, many areas.
    model : {"parabola", "line"}
        Of the road.
    road : {"auto", "all"}
        Find the road first, or use every valid pixel as the paper does.
    lambda0 : float or "auto"
        First learning rate of "gd".
    tolerance : float
        delta_theta of the paper, radians.
    max_roll : float
        The largest abs(roll) that road finding considers, radians.
    max_interval : float
        Half-width of the 95 % interval above which an angle is doubted, radians.
    slope_error : float
        Standard deviation of a slope along the rows that all disparities may have beside the road's, px per
        px: what levelling left of it in the map of a pair.
    seed : int
        Of road finding.
    road_mask : bool
        Whether to return which pixels were used as road.

    Returns
    -------
    RollEstimate
        Angles in radians, the height in metres. The message of a doubtful one says what the map looks like
        instead: a depth map, a photograph, a map that is upside down.

    Raises
    ------
    UsageError
        When an argument is out of range, these are no map or no mask of its size, or the calibration is of
        another view.
    InputError
        When the calibration's file cannot be read.
    EstimationError
        When the pixels do not determine an angle.

    Notes
    -----
    The functions keep no state: threads may call them at the same time. NumPy and OpenCV release the
    interpreter in part only; for many maps, processes (or the command) are faster.

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
    request = Request(method, model, road, lambda0, tolerance, max_roll, max_interval, slope_error, seed)
    rig = given_calibration(calibration)
    values = map_of(disparity)
    if values.ndim == 3 and values.shape[2] in (3, 4):
        remedy = REMEDIES["photograph"][True]
        raise UsageError(f"an array of shape {values.shape} is no disparity map: {remedy}")
    if rig is not None and values.ndim == 2:
        request = request_with(rig.for_size(*values.shape[::-1]), request)

    def like() -> str:
        if values.dtype.kind not in "fiu" or not values.size:
            return ""
        return looks_like(*_in_pixels(values), FramesOptions(method=MethodOptions(seed=seed)), python=True)

    estimate, likeness = estimate_or_liken(values, request, like, mask=mask, road_mask=road_mask)
    beyond = ""
    # most maps need not be read again for this
    if rig is not None and ((values > values.shape[1]).any() or not (values >= 1).any()):
        # the roll is the same at any scale, pitch and height are not
        beyond = not_pixels(*_in_pixels(values), "px", python=True)
    estimate = Source(values, doubts={"beyond": beyond}).doubted(estimate, likeness)
    return estimate if rig is None else with_pose(estimate, rig)


def _in_pixels(values: NDArray[Any]) -> tuple[NDArray[Any], Stored]:
    """Return an array as a file of it would be read, pixels with 0 for no data, and as it is."""
    stored = Stored(values, "npy")
    return to_disparity(stored, encoding="px").disparity, stored


@np.errstate(all="ignore")
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
    lambda0: LearningRate = DEFAULT_REQUEST.lambda0,
    tolerance: float = DEFAULT_REQUEST.tolerance,
    max_roll: float = DEFAULT_REQUEST.max_roll,
    max_interval: float = DEFAULT_REQUEST.max_interval,
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
        Neither 0 nor NaN where a pixel may be used; of the shape that is matched at: (H, W) over
        `stereo.downscale`.
    stereo : StereoOptions, optional
        How the pair is matched; by default as the command does.
    method, model, road, lambda0, tolerance, max_roll, max_interval, seed, road_mask
        See `rollcli.estimate_roll`.

    Returns
    -------
    RollEstimate
        The interval knows what levelling left; `message` says why the map may be wrong.

    Raises
    ------
    InputError
        The images are of another type, differ in size, are too small to match, are swapped, or do not show
        the same scene.
    UsageError
        An argument is out of range, or the calibration is of another view.
    EstimationError
        The pixels do not determine an angle.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> right = rng.integers(0, 256, (120, 320), dtype=np.uint8)
    >>> rows = [np.roll(row, 10 + v // 8) for v, row in enumerate(right)]
    >>> abs(estimate_pair(np.stack(rows), right, road="all").roll_deg) < 1
    True
    """
    request = Request(method, model, road, lambda0, tolerance, max_roll, max_interval, seed=seed)
    rig = given_calibration(calibration)
    allowed = None if mask is None else usable_of(mask)
    if allowed is not None and not allowed.any():
        raise UsageError("the mask leaves no pixel of the map: give an array that is not all zero")
    source = matched_source((left, right), stereo or StereoOptions(), road_finder(allowed, request), rig)
    rig = source.calibrated(rig)
    request = request_with(rig, replace(request, slope_error=source.slope_error))
    like = partial(looks_like, source.disparity, None, FramesOptions(method=MethodOptions(seed=seed)))
    with source.doubting():
        estimate, likeness = estimate_or_liken(
            source.disparity, request, like, mask=allowed, road_mask=road_mask
        )
    estimate = source.doubted(estimate, likeness)
    return estimate if rig is None else with_pose(estimate, rig)


@dataclass(frozen=True)
class RecordedFrame:
    """A frame of a recording.

    Attributes
    ----------
    name : str
        As rows name it.
    stamp : int
        The time of its header, ns; of a pair that of the left view; of a video 0.
    disparity : ndarray, shape (H, W), or None
        Pixels, 0 is no data; None for a pair.
    left, right : ndarray or None
        Rectified views, grey (H, W) or BGR (H, W, 3); None for a map.
    calibration : Calibration or None
        Of the rectified pair.
    """

    name: str
    stamp: int
    disparity: NDArray[Any] | None
    left: NDArray[Any] | None
    right: NDArray[Any] | None
    calibration: Calibration | None


def open_recording(
    path: str | os.PathLike[str],
    *,
    topic: str | None = None,
    left_topic: str | None = None,
    right_topic: str | None = None,
    sync_tolerance: float = 0.001,
    encoding: str = "auto",
    scale: float | None = None,
    side_by_side: str | None = None,
    right: str | os.PathLike[str] | None = None,
) -> Iterator[RecordedFrame]:
    """Iterate the frames of a bag or a video, one in memory at a time.

    Parameters
    ----------
    path : str or path
        A ROS 1 `.bag`, a `.db3`, an `.mcap` or a rosbag2 folder; or a video: `.mp4`, `.m4v`, `.mov`, `.avi`,
        `.mkv`, `.webm`.
    topic : str, optional
        The disparity or depth maps; the only topic that fits by default.
    left_topic, right_topic : str, optional
        The views, instead of maps.
    sync_tolerance : float
        How far apart the header stamps of a pair may be, seconds.
    encoding, scale
        As in `read_disparity`.
    side_by_side : {"left-right", "top-bottom"}, optional
        How each frame of a video holds both views.
    right : str or path, optional
        The video of the right view, where `path` is that of the left one.

    Yields
    ------
    RecordedFrame
        With `name`, as rows have it; `stamp`, the time of its header (a pair's left one), ns, of a video 0; a
        map as `disparity` (H, W), px, 0 is no data, or `left` and `right`, rectified, grey (H, W) or BGR
        (H, W, 3); `calibration` of the rectified pair. What it lacks is None.

    Raises
    ------
    UsageError
        This is no recording, a topic is missing or not clear, the views of a video are not told, an argument
        is of no use here, or the extra is not installed.
    InputError
        A frame cannot be read; of a broken recording behind its last whole frame.

    Examples
    --------
    >>> for frame in open_recording("rolls.csv"):
    ...     print(frame.stamp, frame.disparity.shape)
    Traceback (most recent call last):
    ...
    rollcli.errors.UsageError: rolls.csv: is no .bag, .db3, .mcap or rosbag2 folder
    """
    from rollcli.files.recordings import bags, video
    from rollcli.files.recordings.frames import frames_of_bag, readable_bags

    name = os.fspath(path)
    if (encoding != "auto" or scale is not None) and (left_topic or is_video(name)):
        raise UsageError(f"{name}: encoding and scale are of maps, and these are views")
    if is_video(name):
        if topic or left_topic or right_topic:
            raise UsageError(f"{name}: is a video, and has no topics: give side_by_side or right")
        frames, camera = _of_videos(name, None if right is None else os.fspath(right), side_by_side), None
    else:
        files = bag_files(name)
        if not files:
            raise UsageError(f"{name}: is no .bag, .db3, .mcap or rosbag2 folder")
        require_extra("bags", name)
        if side_by_side or right or (topic and left_topic):
            raise UsageError(f"{name}: is a bag: give topic, or left_topic and right_topic, and nothing else")
        if not 0 <= sync_tolerance < math.inf:
            raise UsageError(f"a sync_tolerance of {sync_tolerance} s: give 0 or more")
        if (left_topic is None) is not (right_topic is None):
            raise UsageError("left_topic and right_topic are given together")
        ((_, files),), rests = readable_bags([(name, files)])
        found = frames_of_bag(files, name, topic, left_topic, right_topic, 1000 * sync_tolerance)
        frames, camera = [*found.frames, *((rest, None) for rest in rests)], found.calibration
    try:
        for one, other in frames:
            if other is None:
                stored = read_stored(one.location, one.name, rgb=encoding == Encoding.FOUNDATIONSTEREO)
                read = to_disparity(stored, encoding=encoding, scale=scale, calibration=camera)
                yield RecordedFrame(one.name, one.stamp, read.disparity, None, None, camera)
            else:
                left = read_image(one.location, one.name)
                if side_by_side:
                    views = views_of(left, side_by_side, one.name)
                else:
                    views = left, read_image(other.location, other.name)
                yield RecordedFrame(one.name, one.stamp, None, *views, camera)
    finally:  # other threads open theirs again
        (video if is_video(name) else bags).close_all()


def _of_videos(name: str, right: str | None, layout: str | None) -> Sequence[tuple[Input, Input | None]]:
    if (right is None) == (layout is None) or layout not in (None, "left-right", "top-bottom"):
        raise UsageError(
            f'{name}: is a video: give side_by_side="left-right" or "top-bottom" where its frames hold both '
            "views, or right, the video of the other one"
        )
    from rollcli.files.recordings.video import frames_of

    left, other = (Input(each, each) for each in (name, right or name))
    with as_usage():
        return frames_of(left, other, layout)
