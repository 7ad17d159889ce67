"""OpenCV's FileStorage (YAML, XML, JSON): what stereoRectify gives, R1 R2 P1 P2 Q in one file.

https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html: P1 and P2 are the rectified projections,
Q = [1 0 0 -cx; 0 1 0 -cy; 0 0 0 f; 0 0 -1/Tx (cx - cx')/Tx]. Their length is in squares of the chessboard as
the user measured them, which the file does not say. The files are read here instead of by cv2.FileStorage,
whose parser is not made for files of strangers and prints what it dislikes.
"""

import re
from dataclasses import replace
from xml.etree import ElementTree

from rollcli.rig.calibration import LIKELY_BASELINE
from rollcli.rig.formats.fields import SAME_DOFFS, Fields, File, Value, parse_yaml

_KEYS = re.compile(r"""(?:^|[\s<{,"])(?:P1|P2|Q|M1)(?:"?\s*:|[\s>])""")
_MARKS = ("%YAML:1.0", "%YAML 1.0", "<opencv_storage>", "opencv-matrix")
_SAME = 1e-3  # relative: P2 and Q are of one rig


def is_opencv(file: File) -> bool:
    """Tell whether a file is a FileStorage with the matrices of a stereo rig."""
    return any(mark in file.text for mark in _MARKS) and _KEYS.search(file.text) is not None


def read_opencv(file: File) -> Fields:
    """Read P1 and P2, or Q; the length is taken for metres where it can be metres."""
    matrices, said = _matrices(file), list[Fields]()
    if "P1" in matrices and "P2" in matrices:
        said.append(file.pair(*(file.projection(matrices[key], key) for key in ("P1", "P2"))))
    if "Q" in matrices:
        said.append(_of_q(file, matrices["Q"]))
    if not said:
        raise file.error(
            "has no P1 and P2, and no Q: give the file with stereoRectify's results "
            "(often extrinsics.yml); camera matrices alone are those of the raw images"
        )
    length, (low, high) = said[0].baseline or 0.0, LIKELY_BASELINE
    if length < 0:
        raise file.swapped()
    if len(said) == 2:
        both = [[vars(each)[name] for name in ("fx", "cx", "cy", "baseline", "doffs")] for each in said]
        within = [_SAME * abs(each) for each in both[0][:4]] + [SAME_DOFFS]
        if any(abs(one - two) > most for one, two, most in zip(*both, within, strict=True)):
            one, two = (", ".join(f"{value:g}" for value in values) for values in both)
            raise file.error(
                f"is contradictory: fx, cx, cy, the baseline and doffs are {one} in P1 and P2, and {two} in Q"
            )
    if not low <= length <= high:
        unit = "in the unit of its chessboard's squares, which cannot be metres"
        return replace(said[0], baseline=None, lacks=f"has a baseline of {length:g} {unit}")
    note = f"{file.name}: its baseline, {length:g}, is taken for metres; OpenCV's files do not say the unit"
    return replace(said[0], notes=(note,))


def _of_q(file: File, values: Value) -> Fields:
    q = file.numbers(values, "Q")
    if len(q) != 16 or q[14] == 0:
        raise file.error("its Q is no matrix of a horizontal rig")
    return Fields(q[11], q[11], -q[3], -q[7], 1 / q[14], q[15] / q[14])


def _matrices(file: File) -> dict[str, Value]:
    start = file.text.lstrip()[:1]
    if start == "<":
        values = _xml_values(file)
    elif start == "{":
        values = file.json()
    else:
        values = parse_yaml(file)
    named = ((key, values.get(key)) for key in ("P1", "P2", "Q"))
    return {key: value["data"] for key, value in named if isinstance(value, dict) and "data" in value}


def _xml_values(file: File) -> dict[str, Value]:
    if "<!DOCTYPE" in file.text or "<!ENTITY" in file.text:
        raise file.error("declares XML entities, which calibration files have no use for")
    try:
        root = ElementTree.fromstring(file.text)
    except ElementTree.ParseError as error:
        raise file.error(f"is not whole XML: {error}") from error
    return {each.tag: {"data": list((each.findtext("data") or "").split())} for each in root}
