"""What a chart over the frames shows of the rig: segments with intervals, jumps, the smoothed value."""

import html
from collections.abc import Sequence
from typing import Any

import numpy as np

from rollcli.rig.assess import DriveAssessment, RigAssessment
from rollcli.rig.quantities import Quantity
from rollcli.rig.sequence.assess import SequenceAssessment
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


def rig_traces(rig: RigAssessment, quantity: Quantity, ends: tuple[float, float]) -> list[Trace]:
    """Return the traces of all drives.

    Parameters
    ----------
    rig : RigAssessment
    quantity : Quantity
    ends : (float, float)
        The lower and upper end of the chart, degrees or metres, from which to which a jump is marked.

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
        found = drive.quantities.get(quantity.name)
        if found is not None:
            _add_segments(drive, quantity, found, band, means)
            _add_smoothed(drive, quantity, found, smoothed)
            _add_jumps(rig, drive, quantity, found, jumps, ends)
    return [trace for trace in (band, means, smoothed, jumps) if trace["x"]]


def _trace(name: str) -> Trace:
    labels = {"text": [], "hovertemplate": "%{text}<extra></extra>"}
    return {"type": "scatter", "mode": "lines", "name": name, "x": [], "y": [], **labels}


def _add(trace: Trace, x: Sequence[float], y: Sequence[float], text: str) -> None:
    """Add a stretch; None parts it from the next."""
    trace["x"] += [*x, None]
    trace["y"] += [*(round(each, 4) for each in y), None]
    trace["text"] += [*([html.escape(text)] * len(x)), None]


def _add_segments(
    drive: DriveAssessment, quantity: Quantity, found: SequenceAssessment, band: Trace, means: Trace
) -> None:
    for segment in found.segments:
        value, half = segment.mean.value, segment.mean.ci95
        if value is None or segment.first == segment.last:  # a frame alone is its own mean
            continue
        first, last = (int(drive.frames[place]) + 1 for place in (segment.first, segment.last))
        said = f"mounting {quantity.name} {answer(segment.mean, quantity)}, of {segment.used:,} frames"
        _add(means, [first, last], [value, value], said)
        if half is not None:
            low, high = value - half, value + half
            _add(band, [first, last, last, first], [high, high, low, low], "")


def _add_smoothed(
    drive: DriveAssessment, quantity: Quantity, found: SequenceAssessment, smoothed: Trace
) -> None:
    for segment in found.segments:
        if found.noise is None or segment.used < _FEWEST_TO_SMOOTH:
            continue
        part = slice(segment.first, segment.last + 1)
        curve = smooth(found.values[part], found.weights[part], found.noise)
        numbers = drive.frames[(curve.frames + segment.first).astype(int)] + 1
        # neither across cells whose frames are all suspect, nor across frames of another drive
        ends = np.flatnonzero(np.diff(numbers) > 1.5 * curve.cell) + 1
        said = f"mounting {quantity.name}, smoothed"
        for along, level in zip(np.split(numbers, ends), np.split(curve.level, ends), strict=True):
            _add(smoothed, along.tolist(), level.tolist(), said)


def _add_jumps(
    rig: RigAssessment,
    drive: DriveAssessment,
    quantity: Quantity,
    found: SequenceAssessment,
    jumps: Trace,
    ends: tuple[float, float],
) -> None:
    for jump in found.jumps:
        frame = int(drive.frames[jump.frame])
        said = f"jump by {answer(jump.change, quantity, change=True)} at {rig.frames.files[frame]}"
        _add(jumps, [frame + 0.5, frame + 0.5], ends, said)
