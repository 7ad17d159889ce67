"""The frames of a bag for Python: `rollcli.open_recording`."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from rollcli.errors import UsageError
from rollcli.extras import require_extra
from rollcli.files.containers import bag_files
from rollcli.files.encodings import to_disparity
from rollcli.files.formats import read_image, read_stored
from rollcli.files.recordings.frames import maps_of_bag, pairs_of_bag
from rollcli.rig.calibration import Calibration


@dataclass(frozen=True)
class RecordedFrame:
    """A frame of a recording.

    Attributes
    ----------
    name : str
        As rows name it.
    stamp : int
        The time of its header, ns; of a pair that of the left view.
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
) -> Iterator[RecordedFrame]:
    """Iterate the frames of a bag, one in memory at a time.

    Parameters
    ----------
    path : str or path
        A ROS 1 `.bag`, a `.db3`, an `.mcap` or a rosbag2 folder.
    topic : str, optional
        The disparity or depth maps; the only topic that fits by default.
    left_topic, right_topic : str, optional
        The views, instead of maps.
    sync_tolerance : float
        How far apart the header stamps of a pair may be, seconds.
    encoding, scale
        As in `read_disparity`.

    Raises
    ------
    UsageError
        This is no bag, a topic is missing or not clear, or the extra is not installed.
    InputError
        A frame cannot be read; of a broken bag behind its last whole frame.

    Examples
    --------
    >>> for frame in open_recording("rolls.csv"):
    ...     print(frame.stamp, frame.disparity.shape)
    Traceback (most recent call last):
    ...
    rollcli.errors.UsageError: rolls.csv: is no .bag, .db3, .mcap or rosbag2 folder
    """
    name = os.fspath(path)
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
    camera = found.calibration
    for one, other in found.frames:
        if other is None:
            stored = read_stored(one.location, one.name)
            read = to_disparity(stored, encoding=encoding, scale=scale, calibration=camera)
            yield RecordedFrame(one.name, one.stamp, read.disparity, None, None, camera)
        else:
            left, right = (read_image(each.location, each.name) for each in (one, other))
            yield RecordedFrame(one.name, one.stamp, None, left, right, camera)
