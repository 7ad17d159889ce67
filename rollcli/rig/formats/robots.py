"""Calibrations of robots: ROS, ORB-SLAM, Kalibr and ZED.

ROS camera_info YAML: one file a view, as camera_calibration and camera_calibration_parsers write it.
sensor_msgs/CameraInfo: `projection_matrix` is of the rectified view, `camera_matrix` of the raw one; the
right view's fourth number is Tx = -fx baseline, in metres. ORB-SLAM 2 and 3: settings with Camera.fx ... and
Camera.bf = fx baseline, or, in 3's new form, Stereo.b; the numbers are those of the images that the settings
are for, raw or rectified. Kalibr and ZED are of raw images, and tell of the rectified pair its baseline
alone: rectification chooses focal length and principal point anew, and neither file holds what it chose.
"""

import math

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, Projection, number, numbers, pair_of, size_of
from rollcli.rig.formats.yaml import parse_yaml

_MM = 1e-3
_RAW = "is of the raw images, and gives the baseline alone"


def read_ros(first: File, second: File | None = None) -> Fields:
    """Read the pair; which file is the right view's, its Tx says."""
    views = [_view(file) for file in (first, second) if file is not None]
    left, width, height = views[0]
    known = (left.fx, left.fy, left.cx, left.cy)
    if len(views) == 1:
        if left.tx != 0:
            raise InputError(
                f"{first.name}: is one view of a pair, the right one: give both, --calib LEFT --calib RIGHT"
            )
        lacks = "is the left view alone, without the baseline: give both, --calib LEFT --calib RIGHT"
        return Fields(*known, width=width, height=height, lacks=lacks)
    right, *right_size = views[1]
    where = f"{first.name} and {second.name if second else ''}"
    if (left.tx != 0 and right.tx == 0) or left.tx < right.tx < 0:
        raise InputError(f"{where}: are in the wrong order: give --calib LEFT --calib RIGHT")
    if [width, height] != right_size:
        raise InputError(
            f"{where}: are of images of different sizes, {width}x{height} and {right_size[0]}x{right_size[1]}"
        )
    baseline, doffs = pair_of(left, right, f"{where}:")
    notes: tuple[str, ...] = ()
    if baseline < 0:
        notes = (
            f"{where}: the right view's Tx is positive, against ROS's convention; its size is taken, "
            f"for a baseline of {-baseline:.5f} m",
        )
    return Fields(*known, abs(baseline), doffs, width, height, notes=notes)


def _view(file: File) -> tuple[Projection, int | None, int | None]:
    values = parse_yaml(file.text, file.name)
    matrix = values.get("projection_matrix", "")
    if not matrix:
        raise InputError(f"{file.name}: has no projection_matrix, or not at its top level")
    data = matrix.get("data", []) if isinstance(matrix, dict) else matrix
    width, height = (values.get(f"image_{side}") for side in ("width", "height"))
    what = f"{file.name}: projection_matrix"
    view = Projection.of(numbers(data, what), what)
    return view, *size_of(width, height, f"{file.name}: image size")


def read_orb_slam(file: File) -> Fields:
    """Read the camera and the baseline."""
    values = parse_yaml(file.text, file.name)

    def read(*keys: str) -> float:
        for key in keys:
            if key in values:
                return number(values[key], f"{file.name}: {key}")
        raise InputError(f"{file.name}: has no {keys[0]}")

    fx, fy, cx, cy = (read(f"Camera.{each}", f"Camera1.{each}") for each in ("fx", "fy", "cx", "cy"))
    if fx == 0:
        raise InputError(f"{file.name}: Camera.fx is 0: a focal length is more")
    baseline = read("Camera.bf") / fx if "Camera.bf" in values else read("Stereo.b")
    width, height = (values.get(f"Camera.{side}") for side in ("width", "height"))
    found = size_of(width, height, f"{file.name}: Camera.width")
    return Fields(fx, fy, cx, cy, baseline, 0.0, *found)


def read_kalibr(file: File) -> Fields:
    """Read the distance between cam0 and cam1, metres: the last column of T_cn_cnm1."""
    camera = parse_yaml(file.text, file.name).get("cam1")
    rows = camera.get("T_cn_cnm1") if isinstance(camera, dict) else None
    what = f"{file.name}: T_cn_cnm1 of cam1"
    matrix = [numbers(row, what) for row in rows] if isinstance(rows, list) else []
    if len(matrix) != 4 or any(len(row) != 4 for row in matrix):
        raise InputError(f"{what} is no 4x4 matrix: the file is cut off or damaged")
    x, y, z = (row[3] for row in matrix[:3])
    if abs(y) > abs(x):
        raise InputError(
            f"{file.name} is a vertical rig, one camera above the other: only horizontal ones are read"
        )
    return Fields(baseline=math.hypot(x, y, z), lacks=_RAW)


def is_zed(text: str) -> bool:
    """Tell whether a text is a ZED camera's SN*.conf."""
    return any(line.lstrip().startswith("[LEFT_CAM_") for line in text.splitlines())


def read_zed(file: File) -> Fields:
    """Read the baseline, which the file gives in millimetres."""
    section = ""
    for line in file.text.splitlines():
        if line.lstrip().startswith("["):
            section = line.strip().lower()
        key, sign, value = line.partition("=")
        if section == "[stereo]" and sign and key.strip().lower() == "baseline":
            return Fields(baseline=_MM * number(value.strip(), f"{file.name}: Baseline"), lacks=_RAW)
    raise InputError(f"{file.name}: has no Baseline below [STEREO]: the file is cut off")
