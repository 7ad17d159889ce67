"""Calibrations of robots: ROS, ORB-SLAM, Kalibr and ZED.

ROS camera_info YAML: one file a view, as camera_calibration and camera_calibration_parsers write it.
sensor_msgs/CameraInfo: `projection_matrix` is of the rectified view, `camera_matrix` of the raw one; the
right view's fourth number is Tx = -fx baseline, in metres. ORB-SLAM 2 and 3: settings with Camera.fx ... and
Camera.bf = fx baseline, or, in 3's new form, Stereo.b. Kalibr and ZED are of raw images, and tell of the
rectified pair its baseline alone: rectification chooses focal length and principal point anew, and neither
file holds what it chose. So do ORB-SLAM's settings with distortion, or with Stereo.T_c1_c2, of views that it
undistorts or rectifies itself: fisheye rigs and most of 3's examples.
"""

import math
import re
from dataclasses import replace

from rollcli.rig.formats.fields import INSTEAD, Fields, File, Projection, Value, parse_yaml

_MM = 1e-3
_RAW = "is of the raw images, and gives the baseline alone"
_DISTORTION = re.compile(r"Camera1?\.[kp]\d")


def read_ros(first: File, second: File | None = None) -> Fields:
    """Read the pair; which file is the right view's, its Tx says."""
    left, size = _view(first)
    if second is None:
        if left.tx != 0:
            raise first.error("is one view of a pair, the right one: give both, --calib LEFT --calib RIGHT")
        lacks = "is the left view alone, without the baseline: give both, --calib LEFT --calib RIGHT"
        return Fields(left.fx, left.fy, left.cx, left.cy, width=size[0], height=size[1], lacks=lacks)
    right, right_size = _view(second)
    both = File(f"{first.name} and {second.name}", "")
    if (left.tx != 0 and right.tx == 0) or left.tx < right.tx < 0:
        raise both.error("are in the wrong order: give --calib LEFT --calib RIGHT")
    size, right_size = (one if one[0] else other for one, other in ((size, right_size), (right_size, size)))
    if size != right_size:
        one, other = ("x".join(map(str, each)) for each in (size, right_size))
        raise both.error(f"are of images of different sizes, {one} and {other}")
    found = replace(both.pair(left, right), width=size[0], height=size[1])
    if found.baseline is None or found.baseline > 0:
        return found
    note = (
        f"{both.name}: the right view's Tx is positive, against ROS's convention; its size is taken, "
        f"for a baseline of {-found.baseline:.5f} m"
    )
    return replace(found, baseline=-found.baseline, notes=(note,))


def _view(file: File) -> tuple[Projection, tuple[int | None, int | None]]:
    values = parse_yaml(file)
    matrix = values.get("projection_matrix", "")
    if not matrix:
        raise file.error("has no projection_matrix, or not at its top level")
    data = matrix.get("data", []) if isinstance(matrix, dict) else matrix
    size = file.size(values.get("image_width"), values.get("image_height"), "image size")
    return file.projection(data, "projection_matrix"), size


def read_orb_slam(file: File) -> Fields:
    """Read the camera and the baseline; of a camera with distortion, whose images are raw, the baseline."""
    values = parse_yaml(file)
    between = values.get("Stereo.T_c1_c2")
    if isinstance(between, dict) and not {"Camera.bf", "Stereo.b"} & values.keys():
        return _baseline_alone(file, between.get("data", ""), "Stereo.T_c1_c2")

    def read(*keys: str) -> float:
        for key in keys:
            if key in values:
                return file.number(values[key], key)
        raise file.error(f"has no {keys[0]}")

    fx, fy, cx, cy = (read(f"Camera.{each}", f"Camera1.{each}") for each in ("fx", "fy", "cx", "cy"))
    # a focal length of 0 is no calibration's
    baseline = read("Camera.bf") / (fx or 1.0) if "Camera.bf" in values else read("Stereo.b")
    if any(file.number(value, key) for key, value in values.items() if _DISTORTION.fullmatch(key)):
        return Fields(baseline=baseline, lacks=_RAW)
    size = file.size(values.get("Camera.width"), values.get("Camera.height"), "Camera.width")
    return Fields(fx, fy, cx, cy, baseline, 0.0, *size)


def read_kalibr(file: File) -> Fields:
    """Read the distance between cam0 and cam1, metres: the last column of T_cn_cnm1."""
    camera = parse_yaml(file).get("cam1")
    if not isinstance(camera, dict) or "T_cn_cnm1" not in camera:
        raise file.error(f"has no cam1 with T_cn_cnm1 at its top level, as Kalibr's have; {INSTEAD}")
    return _baseline_alone(file, camera["T_cn_cnm1"], "T_cn_cnm1 of cam1")


def _baseline_alone(file: File, between: Value, what: str) -> Fields:
    """Return the distance that a 4x4 matrix from one raw camera to the other has, in rows or in one list."""
    rows = between if isinstance(between, list) else []
    cells: list[Value] = [cell for row in rows for cell in (row if isinstance(row, list) else [row])]
    matrix = file.numbers(cells, what)
    if len(matrix) != 16:
        raise file.error(f"{what} is no 4x4 matrix: the file is cut off or damaged")
    x, y, z = matrix[3:12:4]
    if abs(y) > abs(x):
        raise file.vertical()
    return Fields(baseline=math.hypot(x, y, z), lacks=_RAW)


def read_zed(file: File) -> Fields:
    """Read the baseline, which the file gives in millimetres."""
    section = ""
    for line in file.text.splitlines():
        if line.lstrip().startswith("["):
            section = line.strip().lower()
        key, sign, value = line.partition("=")
        if section == "[stereo]" and sign and key.strip().lower() == "baseline":
            return Fields(baseline=_MM * file.number(value.strip(), "Baseline"), lacks=_RAW)
    raise file.error("has no Baseline below [STEREO]: the file is cut off")
