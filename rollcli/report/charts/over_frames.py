"""Roll, pitch or height over the frames."""

from collections.abc import Sequence, Set
from itertools import pairwise
from typing import Any

from rollcli.files.results import Row
from rollcli.report.charts.axis_range import view
from rollcli.report.charts.chart import Chart
from rollcli.report.charts.labels import label
from rollcli.report.charts.rig_traces import drive_starts, rig_traces
from rollcli.report.charts.values import Value, in_words, values_of
from rollcli.rig.assess import RigAssessment
from rollcli.rig.quantities import ROLL, Quantity

_MANY = 400  # up to so many frames each has a dot, and marks are large
_FEW = 10
_FAILED_AT = 0.035  # of the chart's height
_AXIS_UNITS = {"deg": "degrees", "m": "m"}

_VALUES = ("x", "y", "customdata")

Values = Sequence[Value]
Trace = dict[str, Any]


def chart_over_frames(
    rows: Sequence[Row], quantity: Quantity = ROLL, rig: RigAssessment | None = None
) -> Chart:
    """Return the value of each frame: a line, its interval as a band, suspect and failed frames marked.

    With `rig`, its segments, jumps and smoothed mounting value too. A line neither bridges a suspect frame
    nor leads from one drive to another.

    Parameters
    ----------
    rows : sequence of Row
    quantity : Quantity
    rig : RigAssessment, optional

    Returns
    -------
    Chart
        Its name is the quantity's.
    """
    values = values_of(rows, quantity)
    ends = view(rows, quantity)
    suspect = [each for each in values if each.row.status == "suspect" and each.value is not None]
    failed = [each for each in values if each.row.status == "error"]
    sure = [each for each in values if each.row.status == "ok" and each.value is not None]
    starts = set() if rig is None else drive_starts(rig)
    many = len(rows) > _MANY
    # what is sure lies on top: suspect marks of a long run would hide it
    data = [
        _band(sure, starts),
        _suspect(suspect, quantity, bars=not many),
        *_lines(sure, starts, quantity, dots=not many),
        _failed(failed, quantity),
    ]
    data = [trace for trace in data if trace["x"]]  # plotly's legend stumbles over what is empty
    for trace in data:
        trace["marker"] = {"size": 5 if many else 8, **trace.get("marker", {})}
    data += [] if rig is None else rig_traces(rig, quantity, ends)
    margin = max(0.5, 0.01 * len(rows))
    unit = _AXIS_UNITS[quantity.suffix]
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
        "yaxis": {
            "title": {"text": f"{quantity.name}, {unit}"},
            "range": list(ends),
            "zeroline": quantity is ROLL,
        },
        "yaxis2": {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True},
    }
    what = (
        f"{quantity.name.capitalize()} in {unit} over {len(rows)} frames; "
        f"{len(suspect)} suspect and {len(failed)} failed are marked"
    )
    return Chart(quantity.name, what, data, layout)


def _lines(values: Values, starts: Set[int], quantity: Quantity, *, dots: bool) -> list[Trace]:
    """Return the line and, where not every frame has a dot, the dots of frames that no line leads to.

    A browser takes a second for 10,000 dots, which a line of so many frames would hide anyway.
    """
    stretches = _stretches(values, starts)
    parts = [_points(stretch, quantity) for stretch in stretches]
    line = {
        "mode": "lines+markers" if dots else "lines",
        "name": quantity.name,
        "line": {"color": "@c1", "width": 1.5},
        "marker": {"color": "@c1"},
        **_points((), quantity),
        **{name: [each for part in parts for each in (*part[name], None)] for name in _VALUES},
    }
    alone = {
        "mode": "markers",
        "name": f"{quantity.name}, alone",
        "showlegend": False,
        "marker": {"color": "@c1", "size": 2.5},
        **_points([stretch[0] for stretch in stretches if len(stretch) == 1], quantity),
    }
    return [line] if dots else [line, alone]


def _suspect(values: Values, quantity: Quantity, *, bars: bool) -> Trace:
    widths = [each.half_width or 0.0 for each in values]
    bar = {"type": "data", "array": widths, "color": "@suspect", "thickness": 1, "width": 0}
    return {
        "mode": "markers",
        "name": "suspect",
        "legendrank": 1001,  # after the line
        "marker": {"color": "@suspect", "symbol": "diamond"},
        **({"error_y": bar} if bars else {}),
        **_points(values, quantity),
    }


def _failed(values: Values, quantity: Quantity) -> Trace:
    """Along the lower edge, since they have no value."""
    cross = {"color": "@error", "symbol": "x-thin", "line": {"color": "@error", "width": 2}}
    points = {**_points(values, quantity), "y": [_FAILED_AT] * len(values), "yaxis": "y2"}
    return {"mode": "markers", "name": "failed", "legendrank": 1002, "marker": cross, **points}


def _points(values: Values, quantity: Quantity) -> Trace:
    return {
        "type": "scatter",
        "x": [each.number for each in values],
        "y": [each.value for each in values],
        "customdata": [label(each.row, in_words(each, quantity)) for each in values],
        "hovertemplate": "%{customdata}<extra></extra>",
    }


def _band(values: Values, starts: Set[int]) -> Trace:
    """Return one polygon for each stretch of frames that have an interval; None parts them."""
    x: list[int | None] = []
    y: list[float | None] = []
    for stretch in _stretches([each for each in values if each.half_width is not None], starts):
        along = [each.number for each in stretch]
        ends = [(each.value or 0.0, each.half_width or 0.0) for each in stretch]
        x += [*along, *reversed(along), None]
        y += [round(value + half, 4) for value, half in ends]
        y += [*(round(value - half, 4) for value, half in reversed(ends)), None]
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


def _stretches(values: Values, starts: Set[int]) -> list[Values]:
    """Return runs of frames that follow each other, each within one drive."""
    ends = [
        place
        for place, (before, after) in enumerate(pairwise(values), 1)
        if after.number - before.number > 1 or after.number in starts
    ]
    return [values[start:end] for start, end in pairwise([0, *ends, len(values)]) if end > start]
