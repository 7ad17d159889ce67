"""Calibrations of datasets: KITTI, DrivingStereo, Middlebury with ETH3D, and Cityscapes.

KITTI (Geiger et al., "Are we ready for autonomous driving?", CVPR 2012): calib_cam_to_cam.txt of the raw data
(P_rect_00 ...) and calib.txt of the benchmarks (P0 ...). DrivingStereo (Yang et al., CVPR 2019) names its
views 101 and 103 in files of the same kind. Middlebury 2014 and 2021 (Scharstein et al., GCPR 2014), and
ETH3D's two-view sets: calib.txt with cam0=[...], a baseline in mm, and `doffs` where the right view's
principal point lies elsewhere than the left one's. Cityscapes (Cordts et al., CVPR 2016, and its
calibration.pdf): *_camera.json with intrinsic {fx, fy, u0, v0} and extrinsic {baseline}, metres.
"""

from collections.abc import Mapping
from dataclasses import replace

from rollcli.rig.formats.fields import SAME_DOFFS, Fields, File

_RAW = {f"P_rect_0{view}" for view in range(4)}
_BENCHMARK = {f"P{view}" for view in range(4)}
DRIVING_STEREO = ("P_rect_101", "P_rect_103")
_GREY, _COLOUR = ("0", "1"), ("2", "3")
_MM = 1e-3


def is_kitti(file: File) -> bool:
    """Tell whether a file is one of KITTI's calibrations."""
    return any(
        # ROS and OpenCV name a matrix P1 as well; its value is no plain number
        key in _RAW or (key in _BENCHMARK and value[:1] in tuple("-+.0123456789na"))
        for key, value in file.lines(":")
    )


def read_kitti(file: File) -> Fields:
    """Read the grey pair (0, 1) where it is there, else the colour pair (2, 3)."""
    values = _kitti_values(file)
    key = "P_rect_0{}" if _RAW & values.keys() else "P{}"
    pairs = [pair for pair in (_GREY, _COLOUR) if all(key.format(view) in values for view in pair)]
    if not pairs:
        views = ", ".join(sorted((_RAW | _BENCHMARK) & values.keys()))
        raise file.error(
            f"has only {views}: the projections of both views are needed, "
            f"{key.format(0)} and {key.format(1)} or {key.format(2)} and {key.format(3)}"
        )
    # other makers' files of two cameras have the other pair filled in, with one view twice
    apart = [pair for pair in pairs if len({values[key.format(view)] for view in pair}) == 2]
    first, *other = (_kitti_fields(file, values, *map(key.format, pair)) for pair in apart or pairs[:1])
    grey, *colour = (f"{each.baseline:.5f}" for each in (first, *other))
    if colour not in ([], [grey]):
        note = (
            f"{file.name}: the baseline is that of the grey cameras 0 and 1, {grey} m; "
            f"for images of the colour cameras 2 and 3 give --baseline {colour[0]}"
        )
        first = replace(first, notes=(note,))
    return first


def read_driving_stereo(file: File) -> Fields:
    """Read views 101 (left) and 103 (right)."""
    values = _kitti_values(file)
    missing = [key for key in DRIVING_STEREO if key not in values]
    if missing:
        raise file.error(f"has no {missing[0]}: the file is cut off")
    return _kitti_fields(file, values, *DRIVING_STEREO)


def _kitti_values(file: File) -> dict[str, str]:
    values: dict[str, str] = {}
    for key, value in file.lines(":"):
        if key in values and values[key] != value and key.startswith("P"):
            raise file.error(f"is contradictory: it gives {key} twice")
        values[key] = value
    return values


def _kitti_fields(file: File, values: Mapping[str, str], left: str, right: str) -> Fields:
    """Return the left view, the baseline in metres, doffs, and the size where it is stated."""
    found = file.pair(*(file.projection(values[key].split(), key) for key in (left, right)))
    if found.baseline is not None and found.baseline < 0:
        raise file.swapped()
    size_key = f"S_rect_{left.removeprefix('P_rect_').removeprefix('P').zfill(2)}"
    stated = values.get(size_key, "").split()
    if len(stated) not in (0, 2):
        raise file.error(f"{size_key} has {len(stated)} numbers: width and height are needed")
    width, height = file.size(stated[0], stated[1], size_key) if stated else (None, None)
    return replace(found, width=width, height=height)


def read_middlebury(file: File) -> Fields:
    """Read the left camera, the baseline and doffs."""
    values = dict(file.lines("="))
    fx, fy, cx, cy = _camera(file, values, "cam0")
    doffs = file.number(values["doffs"], "doffs") if "doffs" in values else None
    if "cam1" in values:
        right = _camera(file, values, "cam1")
        file.require_one_pair((fx, fy, cy), (right[0], right[1], right[3]))
        between = right[2] - cx
        if doffs is not None and abs(doffs - between) > SAME_DOFFS:
            raise file.error(f"is contradictory: doffs is {doffs:g} px, its cameras differ by {between:g} px")
        doffs = between if doffs is None else doffs
    baseline = _MM * file.number(values["baseline"], "baseline") if "baseline" in values else None
    size = file.size(values.get("width"), values.get("height"), "width and height")
    return Fields(fx, fy, cx, cy, baseline, doffs, *size, lacks="has no baseline: the file is cut off")


def _camera(file: File, values: Mapping[str, str], key: str) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy of [fx 0 cx; 0 fy cy; 0 0 1]."""
    text = values[key]
    found = file.numbers(text.strip("[]").replace(";", " ").split(), key)
    if len(found) != 9 or not text.endswith("]") or found[6:] != [0, 0, 1]:
        raise file.error(f"{key} is no 3x3 camera matrix: the file is cut off or damaged")
    return found[0], found[4], found[2], found[5]


def read_cityscapes(file: File) -> Fields:
    """Read the camera and the baseline."""
    values = file.json()
    found = []
    for name, keys in (("intrinsic", ("fx", "fy", "u0", "v0")), ("extrinsic", ("baseline",))):
        table = values.get(name)
        for key in keys:
            if not isinstance(table, dict) or key not in table:
                raise file.error(f"has no {key}")
            found.append(file.number(table[key], key))
    fx, fy, cx, cy, baseline = found
    return Fields(fx, fy, cx, cy, baseline, 0.0)
