"""The options of the calibration: files, and numbers that win over them."""

from rollcli.cli.command import option, record
from rollcli.cli.options import PATH
from rollcli.cli.types import Number, Point
from rollcli.rig.options import CalibrationOptions

calibration_options = record(
    "calibration",
    "Calibration of the rectified pair, for pitch, height, horizon and depth maps",
    CalibrationOptions,
    option(
        "--calib",
        type=PATH,
        multiple=True,
        metavar="PATH",
        help="A file, or a folder with one of the same stem each: KITTI, Middlebury, ETH3D, OpenCV, ROS "
        "(twice: left, right), Cityscapes, ORB-SLAM, DrivingStereo; recognised by content.",
    ),
    option("--focal", type=Number("PX", above=0), help="Focal length, pixels.  [default: the file's]"),
    option(
        "--principal-point",
        type=Point(),
        help="Optical axis in the left view, from the centre of the top-left pixel.  [default: the file's]",
    ),
    option(
        "--baseline",
        type=Number("M", above=0),
        help="Distance between the cameras, metres; gives the height.  [default: the file's]",
    ),
    option(
        "--doffs",
        type=Number("PX"),
        help="CX of the right view less that of the left one, pixels.  [default: the file's, else 0]",
    ),
)
