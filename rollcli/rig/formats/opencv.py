"""OpenCV's FileStorage (YAML, XML, JSON): what stereoRectify gives, R1 R2 P1 P2 Q in one file.

https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html: P1 and P2 are the rectified projections,
Q = [1 0 0 -cx; 0 1 0 -cy; 0 0 0 f; 0 0 -1/Tx (cx - cx')/Tx]. Their length is in squares of the chessboard as
the user measured them, which the file does not say. The files are read here instead of by cv2.FileStorage,
whose parser is not made for files of strangers and prints what it dislikes.
"""

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from rollcli.errors import InputError
from rollcli.rig.calibration import LIKELY_BASELINE
from rollcli.rig.formats.fields import Fields, File, Projection, json_values, numbers, pair_of, swapped
from rollcli.rig.formats.yaml import Value, parse_yaml

_KEYS = re.compile(r"""(?:^|[\s<{,"])(?:P1|P2|Q|M1)(?:"?\s*:|[\s>])""")
_MARKS = ("%YAML:1.0", "%YAML 1.0", "<opencv_storage>", "opencv-matrix")
_SAME = 1e-3  # relative: P2 and Q are of one rig


def is_opencv(text: str) -> bool:
    """Tell whether a text is a FileStorage with the matrices of a stereo rig."""
    return any(mark in text for mark in _MARKS) and _KEYS.search(text) is not None


def read_opencv(file: File) -> Fields:
    """Read P1 and P2, or Q."""
    matrices = _matrices(file)
    if "P1" in matrices and "P2" in matrices:
        left, right = (Projection.of(matrices[key], f"{file.name}: {key}") for key in ("P1", "P2"))
        found = (left.fx, left.fy, left.cx, left.cy, *pair_of(left, right, file.name))
    elif "Q" in matrices:
        found = _of_q(file, matrices["Q"])
    else:
        raise InputError(
            f"{file.name}: has no P1 and P2, and no Q: give the file with stereoRectify's results "
            "(often extrinsics.yml); camera matrices alone are those of the raw images"
        )
    if found[4] < 0:
        raise swapped(file.name)
    if "P1" in matrices and "Q" in matrices:
        both = [(fx, cx, cy, length) for fx, _, cx, cy, length, _ in (found, _of_q(file, matrices["Q"]))]
        if any(abs(one - two) > _SAME * abs(one) for one, two in zip(*both, strict=True)):
            one, two = (", ".join(f"{value:g}" for value in values) for values in both)
            raise InputError(
                f"{file.name}: is contradictory: fx, cx, cy and the baseline are {one} in P1 and P2, "
                f"and {two} in Q"
            )
    return _with_unit(file, found)


def _with_unit(file: File, found: tuple[float, float, float, float, float, float]) -> Fields:
    """Take the length for metres where it can be metres."""
    fx, fy, cx, cy, length, doffs = found
    low, high = LIKELY_BASELINE
    if not low <= length <= high:
        lacks = (
            f"has a baseline of {length:g} in the unit of its chessboard's squares, which cannot be metres"
        )
        return Fields(fx, fy, cx, cy, None, doffs, lacks=lacks)
    note = f"{file.name}: its baseline, {length:g}, is taken for metres; OpenCV's files do not say the unit"
    return Fields(fx, fy, cx, cy, length, doffs, notes=(note,))


def _of_q(file: File, q: Sequence[float]) -> tuple[float, float, float, float, float, float]:
    if len(q) != 16 or q[14] == 0:
        raise InputError(f"{file.name}: its Q is no matrix of a horizontal rig")
    return q[11], q[11], -q[3], -q[7], 1 / q[14], q[15] / q[14]


def _matrices(file: File) -> dict[str, list[float]]:
    start = file.text.lstrip()[:1]
    if start == "<":
        values = _xml_values(file)
    elif start == "{":
        values = json_values(file)
    else:
        values = parse_yaml(file.text, file.name)
    found = {}
    for key in ("P1", "P2", "Q"):
        value = values.get(key)
        if isinstance(value, dict) and "data" in value:
            found[key] = numbers(value["data"], f"{file.name}: {key}")
    return found


def _xml_values(file: File) -> dict[str, Value]:
    if "<!DOCTYPE" in file.text or "<!ENTITY" in file.text:
        raise InputError(f"{file.name}: declares XML entities, which calibration files have no use for")
    try:
        root = ElementTree.fromstring(file.text)
    except ElementTree.ParseError as error:
        raise InputError(f"{file.name}: is not whole XML: {error}") from error
    return {each.tag: {"data": list((each.findtext("data") or "").split())} for each in root}
