"""Calibrations of raw images, which tell of the rectified pair its baseline alone: Kalibr and ZED.

Rectification chooses focal length and principal point anew, and neither file holds what it chose.
"""

import math
import re

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, number, numbers
from rollcli.rig.plain_yaml import parse_yaml

_CHAIN = re.compile(r"^[ \t]*T_cn_cnm1[ \t]*:", re.MULTILINE)
_ZED = re.compile(r"^[ \t]*\[LEFT_CAM_\w+\]", re.MULTILINE)
_STEREO = re.compile(
    r"^[ \t]*\[STEREO\][^\[]*?^[ \t]*baseline[ \t]*=[ \t]*(\S+)", re.MULTILINE | re.IGNORECASE
)
_MM = 1e-3
_RAW = "is of the raw images, and gives the baseline alone"


def is_kalibr(text: str) -> bool:
    """Tell whether a text is a camchain of Kalibr."""
    return _CHAIN.search(text) is not None


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
    return Fields("Kalibr", baseline=math.hypot(x, y, z), lacks=_RAW)


def is_zed(text: str) -> bool:
    """Tell whether a text is a ZED camera's SN*.conf."""
    return _ZED.search(text) is not None


def read_zed(file: File) -> Fields:
    """Read the baseline, which the file gives in millimetres."""
    found = _STEREO.search(file.text)
    if found is None:
        raise InputError(f"{file.name}: has no Baseline below [STEREO]: the file is cut off")
    return Fields("ZED", baseline=_MM * number(found[1], f"{file.name}: Baseline"), lacks=_RAW)
