"""What the roll chart shows of the rig: segments with intervals, jumps, and the smoothed mounting roll."""

import html
from collections.abc import Sequence
from typing import Any

from rollcli.rig.assess import DriveAssessment, RigAssessment
from rollcli.rig.quantities import ROLL
from rollcli.rig.sequence.smoothing import smooth
from rollcli.rig.words import answer

_FEWEST_TO_SMOOTH = 24  # frames: fewer are seen as they are

Trace = dict[str, Any]


def drive_starts(rig: RigAssessment) -> set[int]:
    """Return the numbers, from 1, of the frames that begin a drive; no line is drawn into them."""
    drives = [-1] * rig.count
    for number, drive in enumerate(rig.drives):
        for place in drive.frames.tolist():
            drives[place] = number
    return {place + 1 for place in range(1, rig.count) if drives[place] != drives[place - 1]}


def rig_traces(rig: RigAssessment, ends: tuple[float, float]) -> list[Trace]:
    """Return the traces of all drives.

    Parameters
    ----------
    rig : RigAssessment
    ends : (float, float)
        The lower and upper end of the chart, degrees, from which to which a jump is marked.

    Returns
    -------
    list of dict
        As plotly takes them; empty ones are left out.
    """
    band, means, smoothed, jumps = (
        _trace("mounting, 95 %"),
        _trace("mounting"),
        _trace("smoothed"),
        _trace("jump"),
    )
    band |= {"fill": "toself", "fillcolor": "@band", "line": {"width": 0}, "hoverinfo": "skip"}
    means["line"] = {"color": "@c3", "width": 2}
    smoothed["line"] = {"color": "@c4", "width": 1.5, "dash": "dot"}
    jumps["line"] = {"color": "@error", "width": 1.5, "dash": "dash"}
    for drive in rig.drives:
        _add_segments(drive, band, means)
        _add_smoothed(drive, smoothed)
        _add_jumps(rig, drive, jumps, ends)
    return [trace for trace in (band, means, smoothed, jumps) if trace["x"]]


def _trace(name: str) -> Trace:
    labels = {"text": [], "hovertemplate": "%{text}<extra></extra>"}
    return {"type": "scatter", "mode": "lines", "name": name, "x": [], "y": [], **labels}


def _add(trace: Trace, x: Sequence[float], y: Sequence[float], text: str) -> None:
    """Add a stretch; None parts it from the next."""
    trace["x"] += [*x, None]
    trace["y"] += [*(round(each, 4) for each in y), None]
    trace["text"] += [*([html.escape(text)] * len(x)), None]


def _add_segments(drive: DriveAssessment, band: Trace, means: Trace) -> None:
    for segment in drive.quantities[ROLL.name].segments:
        value, half = segment.mean.value, segment.mean.ci95
        if value is None:
            continue
        first, last = (int(drive.frames[place]) + 1 for place in (segment.first, segment.last))
        count = f"{segment.used:,} frames"
        _add(means, [first, last], [value, value], f"mounting roll {answer(segment.mean)}, of {count}")
        if half is not None:
            low, high = value - half, value + half
            _add(band, [first, last, last, first], [high, high, low, low], "")


def _add_smoothed(drive: DriveAssessment, smoothed: Trace) -> None:
    found = drive.quantities[ROLL.name]
    for segment in found.segments:
        if found.noise is None or segment.used < _FEWEST_TO_SMOOTH:
            continue
        part = slice(segment.first, segment.last + 1)
        curve = smooth(found.values[part], found.weights[part], found.noise)
        places = (curve.frames + segment.first).astype(int)
        numbers = [int(each) + 1 for each in drive.frames[places]]
        _add(smoothed, numbers, curve.level.tolist(), "mounting roll, smoothed")


def _add_jumps(rig: RigAssessment, drive: DriveAssessment, jumps: Trace, ends: tuple[float, float]) -> None:
    for jump in drive.quantities[ROLL.name].jumps:
        frame = int(drive.frames[jump.frame])
        said = f"jump by {answer(jump.change, change=True)} at {rig.frames.files[frame]}"
        _add(jumps, [frame + 0.5, frame + 0.5], ends, said)
