"""Middlebury 2014 and 2021, and ETH3D's two-view sets: calib.txt with cam0=[...] and a baseline in mm.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014. The
right view's principal point may lie elsewhere than the left one's: `doffs` is the difference.
"""

import re

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, number, numbers, require_one_pair, size

_LINE = re.compile(r"^[ \t]*(\w+)[ \t]*=[ \t]*(.*?)[ \t]*\r?$", re.MULTILINE)
_CAMERA = re.compile(r"^[ \t]*cam0[ \t]*=", re.MULTILINE)
_MM = 1e-3
_SAME_DOFFS = 0.5  # px


def is_middlebury(text: str) -> bool:
    """Tell whether a text is such a calibration."""
    return _CAMERA.search(text) is not None


def read_middlebury(file: File) -> Fields:
    """Read the left camera, the baseline and doffs."""
    values = dict(_LINE.findall(file.text))
    fx, fy, cx, cy = _camera(values["cam0"], f"{file.name}: cam0")
    right = _camera(values["cam1"], f"{file.name}: cam1") if "cam1" in values else None
    doffs = number(values["doffs"], f"{file.name}: doffs") if "doffs" in values else None
    if right is not None:
        require_one_pair((fx, fy, cy), (right[0], right[1], right[3]), file.name)
        between = right[2] - cx
        if doffs is not None and abs(doffs - between) > _SAME_DOFFS:
            raise InputError(
                f"{file.name}: is contradictory: doffs is {doffs:g} px, its cameras differ by {between:g} px"
            )
        doffs = between if doffs is None else doffs
    if "baseline" not in values:
        return Fields("Middlebury", fx, fy, cx, cy, None, doffs, lacks="has no baseline: the file is cut off")
    baseline = _MM * number(values["baseline"], f"{file.name}: baseline")
    width = height = None
    if "width" in values and "height" in values:
        width, height = size(values["width"], values["height"], f"{file.name}: width and height")
    return Fields("Middlebury", fx, fy, cx, cy, baseline, doffs or 0.0, width, height)


def _camera(text: str, what: str) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy of [fx 0 cx; 0 fy cy; 0 0 1]."""
    found = numbers(text.strip("[]").replace(";", " ").split(), what)
    if len(found) != 9 or not text.endswith("]") or found[6:] != [0, 0, 1]:
        raise InputError(f"{what} is no 3x3 camera matrix: the file is cut off or damaged")
    return found[0], found[4], found[2], found[5]
