"""The calibrations of KITTI, Middlebury, ETH3D, DrivingStereo and Cityscapes."""

import re
from collections.abc import Mapping

from rollcli.errors import InputError
from rollcli.rig.formats.fields import (
    Fields,
    File,
    Projection,
    number,
    numbers,
    pair_of,
    require_one_pair,
    size,
    swapped,
)
from rollcli.rig.formats.opencv import json_values

_LINE = re.compile(r"^([A-Za-z_0-9]+):[ \t]*(.*?)[ \t]*\r?$", re.MULTILINE)
_RAW, _BENCHMARK, _DRIVING_STEREO = (
    re.compile(pattern, re.MULTILINE)
    for pattern in (r"^P_rect_0[0-3]:", r"^P[0-3]:[ \t]*[-+.0-9na]", r"^P_rect_10[13]:")
)
_GREY, _COLOUR = ("0", "1"), ("2", "3")


def is_kitti(text: str) -> bool:
    """Tell whether a text is one of KITTI's calibrations."""
    return bool(_RAW.search(text) or _BENCHMARK.search(text))


def read_kitti(file: File) -> Fields:
    """Read the grey pair (0, 1) where it is there, else the colour pair (2, 3)."""
    values = _values(file)
    raw = _RAW.search(file.text) is not None
    key = "P_rect_0{}" if raw else "P{}"
    pairs = [pair for pair in (_GREY, _COLOUR) if all(key.format(view) in values for view in pair)]
    if not pairs:
        views = ", ".join(sorted(name for name in values if re.fullmatch(r"P(_rect_0)?[0-3]", name)))
        raise InputError(
            f"{file.name}: has only {views}: the projections of both views are needed, "
            f"{key.format(0)} and {key.format(1)} or {key.format(2)} and {key.format(3)}"
        )
    fields = [_pair(file, values, *(key.format(view) for view in pair)) for pair in pairs]
    notes: tuple[str, ...] = ()
    if len(pairs) == 2:
        notes = (
            f"{file.name}: the baseline is that of the grey cameras 0 and 1, {fields[0][1]:.5f} m; "
            f"for images of the colour cameras 2 and 3 give --baseline {fields[1][1]:.5f}",
        )
    return _filled("KITTI", file, values, "S_rect_0" + pairs[0][0], *fields[0], notes)


def is_driving_stereo(text: str) -> bool:
    """Tell whether a text is a calibration of DrivingStereo."""
    return _DRIVING_STEREO.search(text) is not None


def read_driving_stereo(file: File) -> Fields:
    """Read views 101 (left) and 103 (right); Yang et al., "DrivingStereo", CVPR 2019."""
    values = _values(file)
    missing = [key for key in ("P_rect_101", "P_rect_103") if key not in values]
    if missing:
        raise InputError(f"{file.name}: has no {missing[0]}: the file is cut off")
    return _filled(
        "DrivingStereo", file, values, "S_rect_101", *_pair(file, values, "P_rect_101", "P_rect_103")
    )


def _values(file: File) -> dict[str, str]:
    values: dict[str, str] = {}
    for key, value in _LINE.findall(file.text):
        if key in values and values[key] != value and key.startswith("P"):
            raise InputError(f"{file.name}: is contradictory: it gives {key} twice")
        values[key] = value
    return values


def _pair(file: File, values: Mapping[str, str], left: str, right: str) -> tuple[Projection, float, float]:
    """Return the left view, the baseline in metres and doffs."""
    views = [
        Projection.of(numbers(values[key].split(), f"{file.name}: {key}"), f"{file.name}: {key}")
        for key in (left, right)
    ]
    baseline, doffs = pair_of(views[0], views[1], file.name)
    if baseline < 0:
        raise swapped(file.name)
    return views[0], baseline, doffs


def _filled(
    form: str,
    file: File,
    values: Mapping[str, str],
    size_key: str,
    view: Projection,
    baseline: float,
    doffs: float,
    notes: tuple[str, ...] = (),
) -> Fields:
    width = height = None
    if stated := values.get(size_key, "").split():
        if len(stated) != 2:
            raise InputError(
                f"{file.name}: {size_key} has {len(stated)} numbers: width and height are needed"
            )
        width, height = size(stated[0], stated[1], f"{file.name}: {size_key}")
    return Fields(form, view.fx, view.fy, view.cx, view.cy, baseline, doffs, width, height, notes=notes)


_ASSIGNMENT = re.compile(r"^[ \t]*(\w+)[ \t]*=[ \t]*(.*?)[ \t]*\r?$", re.MULTILINE)
_CAMERA = re.compile(r"^[ \t]*cam0[ \t]*=", re.MULTILINE)
_MM = 1e-3
_SAME_DOFFS = 0.5  # px


def is_middlebury(text: str) -> bool:
    """Tell whether a text is such a calibration."""
    return _CAMERA.search(text) is not None


def read_middlebury(file: File) -> Fields:
    """Read the left camera, the baseline and doffs."""
    values = dict(_ASSIGNMENT.findall(file.text))
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


def is_cityscapes(text: str) -> bool:
    """Tell whether a text is such a calibration."""
    return '"intrinsic"' in text and '"u0"' in text


def read_cityscapes(file: File) -> Fields:
    """Read the camera and the baseline."""
    values = json_values(file)
    tables = [values.get(key) for key in ("intrinsic", "extrinsic")]
    found = []
    for table, keys in zip(tables, (("fx", "fy", "u0", "v0"), ("baseline",)), strict=True):
        for key in keys:
            if not isinstance(table, dict) or key not in table:
                raise InputError(f"{file.name}: has no {key}")
            found.append(number(table[key], f"{file.name}: {key}"))
    fx, fy, cx, cy, baseline = found
    return Fields("Cityscapes", fx, fy, cx, cy, baseline, 0.0)
