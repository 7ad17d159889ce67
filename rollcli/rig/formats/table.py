"""The formats of calibration files. A new one is a module beside this and a line in `FORMATS`."""

from collections.abc import Callable
from typing import NamedTuple

from rollcli.rig.formats import cityscapes, kitti, middlebury, opencv, orb_slam, raw_rigs, ros
from rollcli.rig.formats.fields import Fields


class Format(NamedTuple):
    """How a format is recognised by its text, and how one file of it is read.

    `files` is how many files make a calibration at most: `read` takes so many.
    """

    name: str
    recognise: Callable[[str], bool]
    read: Callable[..., Fields]
    files: int = 1


# the first that recognises a file reads it: ORB-SLAM's settings can hold OpenCV's matrices
FORMATS = (
    Format("KITTI", kitti.is_kitti, kitti.read_kitti),
    Format("DrivingStereo", kitti.is_driving_stereo, kitti.read_driving_stereo),
    Format("Middlebury or ETH3D", middlebury.is_middlebury, middlebury.read_middlebury),
    Format("ORB-SLAM", orb_slam.is_orb_slam, orb_slam.read_orb_slam),
    Format("ROS camera_info", ros.is_ros, ros.read_ros, files=2),
    Format("OpenCV stereoRectify", opencv.is_opencv, opencv.read_opencv),
    Format("Cityscapes", cityscapes.is_cityscapes, cityscapes.read_cityscapes),
    Format("Kalibr", raw_rigs.is_kalibr, raw_rigs.read_kalibr),
    Format("ZED", raw_rigs.is_zed, raw_rigs.read_zed),
)
