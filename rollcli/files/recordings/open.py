"""The frames of a recording for Python: `rollcli.open_recording`."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from rollcli.errors import UsageError
from rollcli.extras import require_extra
from rollcli.files.codecs.pictures import views_of
from rollcli.files.containers import bag_files, is_video
from rollcli.files.encodings import to_disparity
from rollcli.files.formats import read_image, read_stored
from rollcli.files.naming import Input
from rollcli.files.recordings.frames import maps_of_bag, pairs_of_bag
from rollcli.files.recordings.video import frames_of
from rollcli.rig.calibration import Calibration


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
        A ROS 1 `.bag`, a `.db3`, an `.mcap` or a rosbag2 folder; or an `.mp4`, `.avi`, `.mkv` or `.mov`.
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

    Raises
    ------
    UsageError
        This is no recording, a topic is missing or not clear, the views of a video are not told, or the extra
        is not installed.
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
    name = os.fspath(path)
    layout = side_by_side if is_video(name) else None
    if is_video(name):
        frames, camera = _of_videos(name, None if right is None else os.fspath(right), layout), None
    else:
        files = bag_files(name)
        if not files:
            raise UsageError(f"{name}: is no .bag, .db3, .mcap or rosbag2 folder")
        require_extra("bags", name)
        if left_topic is not None and right_topic is not None:
            found = pairs_of_bag(files, name, left_topic, right_topic, round(sync_tolerance * 1e9))
        elif left_topic is not None or right_topic is not None:
            raise UsageError("left_topic and right_topic are given together")
        else:
            found = maps_of_bag(files, name, topic)
        frames, camera = found.frames, found.calibration
    for one, other in frames:
        if other is None:
            stored = read_stored(one.location, one.name)
            read = to_disparity(stored, encoding=encoding, scale=scale, calibration=camera)
            yield RecordedFrame(one.name, one.stamp, read.disparity, None, None, camera)
        else:
            left = read_image(one.location, one.name)
            views = (
                views_of(left, layout, one.name) if layout else (left, read_image(other.location, other.name))
            )
            yield RecordedFrame(one.name, one.stamp, None, *views, camera)


def _of_videos(name: str, right: str | None, layout: str | None) -> Sequence[tuple[Input, Input | None]]:
    if (right is None) == (layout is None) or layout not in (None, "left-right", "top-bottom"):
        raise UsageError(
            f'{name}: is a video: give side_by_side="left-right" or "top-bottom" where its frames hold both '
            "views, or right, the video of the other one"
        )
    left, other = (Input(each, each, each) for each in (name, right or name))
    return frames_of(left, other, layout)
