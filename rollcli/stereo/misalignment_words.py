"""What a row says of views that were levelled, and the numbers read back from it.

Rows are all that an interrupted run keeps: the median over a run is that of what its rows say.
"""

import math
import re

from rollcli.stereo.misalignment import Misalignment

NOT_LEVELLED = "the views are not level, and could not be levelled"
"""The doubt of a pair whose correction was still changing when it was given up."""
TOO_LITTLE = "too little can be compared to tell whether the views are level"
"""The doubt of a pair whose correction could not be checked."""

_LEAD = "corrected: the right image "
_PARTS = {
    "offset": re.compile(r"lay ([\d.]+) px (lower|higher)"),
    "rotation": re.compile(r"was turned (clockwise|counter-clockwise) by ([\d.]+) degrees"),
    "scale": re.compile(r"was ([\d.]+) % (larger|smaller)"),
    "twist": re.compile(r"had rows skewed by ([-\d.]+) px"),
}


def note_of(corrected: Misalignment, height: int, width: int) -> str:
    """Return what was corrected, in words; empty if nothing was.

    Parameters
    ----------
    corrected : Misalignment
    height, width : int
        Of the view, pixels: what is said of skewed rows is the shift in the corners.
    """
    offset, scale = corrected.offset, 100 * corrected.scale
    rotation, skew = corrected.rotation_deg, corrected.shifts(height, width)[3]
    parts = []
    if abs(offset) >= 0.005:
        parts.append(f"lay {abs(offset):.2f} px {'lower' if offset > 0 else 'higher'}")
    if abs(rotation) >= 0.0005:
        way = "clockwise" if rotation > 0 else "counter-clockwise"
        parts.append(f"was turned {way} by {abs(rotation):.3f} degrees")
    if abs(scale) >= 0.0005:
        parts.append(f"was {abs(scale):.3f} % {'larger' if scale > 0 else 'smaller'}")
    if abs(skew) >= 0.005:
        parts.append(f"had rows skewed by {skew:.2f} px")
    return _LEAD + ", ".join(parts) if parts else ""


def advice_of(median: Misalignment, height: int, width: int) -> str:
    """Return what a run says of its rig, in a sentence; empty where nothing is far enough from level.

    Notes
    -----
    An image that is turned clockwise is of a camera that is rolled counter-clockwise, seen from behind.
    """
    offset, scale, rotation = median.offset, 100 * median.scale, median.rotation_deg
    skew = median.shifts(height, width)[3]
    parts = []
    if abs(rotation) >= 0.03:
        way = "counter-clockwise" if rotation > 0 else "clockwise"
        against = f"against the left, {way} seen from behind"
        parts.append(f"the right camera is rolled by {abs(rotation):.2f} degrees {against}")
    if abs(offset) >= 0.15:
        parts.append(f"the right image lies {abs(offset):.2f} px {'lower' if offset > 0 else 'higher'}")
    if abs(scale) >= 0.1:
        parts.append(f"the right image is {abs(scale):.2f} % {'larger' if scale > 0 else 'smaller'}")
    if abs(skew) >= 0.5:
        parts.append(f"its rows are skewed by {abs(skew):.1f} px in the corners")
    return ", ".join(parts) + ": recalibrate" if parts else ""


def read_note(message: str, height: int, width: int) -> Misalignment:
    """Return what the message of a row says was corrected; nothing, if it says nothing."""
    _, lead, rest = message.partition(_LEAD)
    note = rest.partition(";")[0] if lead else ""
    found = {name: pattern.search(note) for name, pattern in _PARTS.items()}
    offset, rotation, scale, twist = found.values()
    return Misalignment(
        float(offset[1]) * (1 if offset[2] == "lower" else -1) if offset else 0.0,
        math.radians(float(rotation[2])) * (1 if rotation[1] == "clockwise" else -1) if rotation else 0.0,
        float(scale[1]) / 100 * (1 if scale[2] == "larger" else -1) if scale else 0.0,
        float(twist[1]) / (height * width / 4) if twist else 0.0,
    )
