"""The roll over the frames."""

from collections.abc import Sequence, Set
from itertools import pairwise
from typing import Any

from rollcli.files.results import Row
from rollcli.report.axis_range import view
from rollcli.report.labels import label
from rollcli.report.page import Chart
from rollcli.report.rig_traces import drive_starts, rig_traces
from rollcli.report.summary import with_interval
from rollcli.rig.assess import RigAssessment

_MANY = 400  # up to so many frames each has a dot, and marks are large
_FEW = 10
_FAILED_AT = 0.035  # of the chart's height

_VALUES = ("x", "y", "customdata")

Numbered = Sequence[tuple[int, Row]]


def roll_chart(rows: Sequence[Row], rig: RigAssessment | None = None) -> Chart:
    """Return the roll of each frame: a line, its interval as a band, suspect and failed frames marked.

    With `rig`, its segments, jumps and smoothed mounting roll too. A line neither bridges a suspect frame nor
    leads from one drive to another.
    """
    numbered = list(enumerate(rows, 1))
    ends = view(rows)
    suspect = [each for each in numbered if each[1].status == "suspect"]
    failed = [each for each in numbered if each[1].status == "error"]
    sure = [each for each in numbered if each[1].status == "ok" and each[1].roll_deg is not None]
    starts = set() if rig is None else drive_starts(rig)
    many = len(rows) > _MANY
    # what is sure lies on top: suspect marks of a long run would hide it
    data = [_band(sure, starts), _suspect(suspect, bars=not many), _line(sure, starts), _failed(failed)]
    data = [trace for trace in data if trace["x"]]  # plotly's legend stumbles over what is empty
    for trace in data:
        trace["marker"] = {"size": 5 if many else 8, **trace.get("marker", {})}
    data += [] if rig is None else rig_traces(rig, ends)
    margin = max(0.5, 0.01 * len(rows))
    layout = {
        "hovermode": "closest",
        "hoverdistance": -1,
        "showlegend": True,
        "xaxis": {
            "title": {"text": "frame"},
            "range": [1 - margin, len(rows) + margin],
            "zeroline": False,
            "tickformat": ",d",
            **({"dtick": 1} if len(rows) <= _FEW else {}),  # there are no half frames
        },
        "yaxis": {"title": {"text": "roll, degrees"}, "range": list(ends), "zeroline": True},
        "yaxis2": {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True},
    }
    what = (
        f"Roll in degrees over {len(rows)} frames; {len(suspect)} suspect and {len(failed)} failed are marked"
    )
    return Chart("roll", what, data, layout)


def _line(numbered: Numbered, starts: Set[int]) -> dict[str, Any]:
    parts = [_points(stretch) for stretch in _stretches(numbered, starts)]
    joined = {name: [each for part in parts for each in (*part[name], None)] for name in _VALUES}
    return {
        "mode": "lines+markers",  # a frame between two suspect ones is a dot
        "name": "roll",
        "line": {"color": "@c1", "width": 1.5},
        "marker": {"color": "@c1", "size": 5 if len(numbered) <= _MANY else 1.5},
        **_points(()),
        **joined,
    }


def _suspect(numbered: Numbered, *, bars: bool) -> dict[str, Any]:
    widths = [row.roll_ci95_deg or 0.0 for _, row in numbered]
    bar = {"type": "data", "array": widths, "color": "@suspect", "thickness": 1, "width": 0}
    return {
        "mode": "markers",
        "name": "suspect",
        "legendrank": 1001,  # after the line
        "marker": {"color": "@suspect", "symbol": "diamond"},
        **({"error_y": bar} if bars else {}),
        **_points(numbered),
    }


def _failed(numbered: Numbered) -> dict[str, Any]:
    """Along the lower edge, since they have no angle."""
    cross = {"color": "@error", "symbol": "x-thin", "line": {"color": "@error", "width": 2}}
    points = {**_points(numbered), "y": [_FAILED_AT] * len(numbered), "yaxis": "y2"}
    return {"mode": "markers", "name": "failed", "legendrank": 1002, "marker": cross, **points}


def _points(numbered: Numbered) -> dict[str, Any]:
    return {
        "type": "scatter",
        "x": [number for number, _ in numbered],
        "y": [row.roll_deg for _, row in numbered],
        "customdata": [
            label(row, "" if row.roll_deg is None else with_interval(row.roll_deg, row.roll_ci95_deg))
            for _, row in numbered
        ],
        "hovertemplate": "%{customdata}<extra></extra>",
    }


def _band(numbered: Numbered, starts: Set[int]) -> dict[str, Any]:
    """Return one polygon for each stretch of frames that have an interval; None parts them."""
    x: list[int | None] = []
    y: list[float | None] = []
    for stretch in _stretches([each for each in numbered if each[1].roll_ci95_deg is not None], starts):
        along = [number for number, _ in stretch]
        ends = [((row.roll_deg or 0.0), (row.roll_ci95_deg or 0.0)) for _, row in stretch]
        x += [*along, *reversed(along), None]
        y += [round(roll + half, 4) for roll, half in ends]
        y += [*(round(roll - half, 4) for roll, half in reversed(ends)), None]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "95 % interval",
        "x": x,
        "y": y,
        "fill": "toself",
        "fillcolor": "@band",
        "line": {"color": "@band", "width": 1},  # a frame alone is seen too
        "hoverinfo": "skip",
    }


def _stretches(numbered: Numbered, starts: Set[int]) -> list[Numbered]:
    """Return runs of frames that follow each other, each within one drive."""
    ends = [
        place
        for place, ((before, _), (after, _)) in enumerate(pairwise(numbered), 1)
        if after - before > 1 or after in starts
    ]
    return [numbered[start:end] for start, end in pairwise([0, *ends, len(numbered)]) if end > start]
