"""ROS camera_info YAML: one file a view, as camera_calibration and camera_calibration_parsers write it.

sensor_msgs/CameraInfo: `projection_matrix` is of the rectified view, `camera_matrix` of the raw one; the
right view's fourth number is Tx = -fx baseline, in metres.
"""

import re

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, Projection, numbers, pair_of, size
from rollcli.rig.plain_yaml import parse_yaml

_KEY = re.compile(r"^\s*projection_matrix\s*:", re.MULTILINE)


def is_ros(text: str) -> bool:
    """Tell whether a text is a camera_info file."""
    return _KEY.search(text) is not None


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
        return Fields("ROS camera_info", *known, width=width, height=height, lacks=lacks)
    right, *right_size = views[1]
    where = f"{first.name} and {second.name if second else ''}"
    if left.tx != 0 and right.tx == 0:
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
    return Fields("ROS camera_info", *known, abs(baseline), doffs, width, height, notes=notes)


def _view(file: File) -> tuple[Projection, int | None, int | None]:
    values = parse_yaml(file.text, file.name)
    matrix = values.get("projection_matrix", "")
    if not matrix:
        raise InputError(f"{file.name}: has no projection_matrix, or not at its top level")
    data = matrix.get("data", []) if isinstance(matrix, dict) else matrix
    what = f"{file.name}: projection_matrix"
    view = Projection.of(numbers(data, what), what)
    if "image_width" not in values or "image_height" not in values:
        return view, None, None
    return view, *size(values["image_width"], values["image_height"], f"{file.name}: image size")
