"""Pitch and height over the frames, where a calibration has given them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from rollcli.files.results import Row
from rollcli.report.labels import label
from rollcli.report.page import Chart
from rollcli.rig.words import decimals

_DOTS = 400  # up to so many frames each has a dot


class _Value(NamedTuple):
    """What is drawn of a frame: its number, the value and half of its interval, and its row."""

    number: int
    value: float
    half_width: float | None
    row: Row


def pose_charts(rows: Sequence[Row]) -> list[Chart]:
    """Return the charts of pitch and of height; none where no frame has them."""
    numbered = list(enumerate(rows, 1))
    pitches = [
        _Value(number, row.pitch_deg, row.pitch_ci95_deg, row)
        for number, row in numbered
        if row.pitch_deg is not None
    ]
    heights = [
        _Value(number, row.height_m, row.height_ci95_m, row)
        for number, row in numbered
        if row.height_m is not None
    ]
    found = (("pitch", "degrees", pitches), ("height", "m", heights))
    return [_chart(name, unit, values, len(rows)) for name, unit, values in found if values]


def _chart(name: str, unit: str, values: Sequence[_Value], frames: int) -> Chart:
    sure = [each for each in values if each.row.status == "ok"]
    suspect = [each for each in values if each.row.status != "ok"]
    mark = {
        "mode": "markers",
        "name": "suspect",
        "marker": {"color": "@suspect", "symbol": "diamond", "size": 5 if frames > _DOTS else 8},
        **_points(suspect, unit),
    }
    line = {
        "mode": "lines+markers" if len(sure) <= _DOTS else "lines",
        "name": name,
        "line": {"color": "@c1", "width": 1.5},
        "marker": {"color": "@c1", "size": 5 if frames > _DOTS else 8},
        **_points(_broken(sure), unit),
    }
    data = [trace for trace in (_band(sure), mark, line) if trace["x"]]
    margin = max(0.5, 0.01 * frames)
    layout = {
        "hovermode": "closest",
        "showlegend": True,
        "xaxis": {
            "title": {"text": "frame"},
            "range": [1 - margin, frames + margin],
            "zeroline": False,
            "tickformat": ",d",
        },
        "yaxis": {"title": {"text": f"{name}, {unit}"}, "zeroline": False},
    }
    return Chart(name, f"{name.capitalize()} in {unit} over {frames} frames", data, layout)


def _broken(values: Sequence[_Value]) -> list[_Value | None]:
    """Put None where frames are left out, so that no line runs over them."""
    parts: list[_Value | None] = []
    for each in values:
        if parts and (before := parts[-1]) is not None and each.number > before.number + 1:
            parts.append(None)
        parts.append(each)
    return parts


def _points(values: Sequence[_Value | None], unit: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "x": [None if each is None else each.number for each in values],
        "y": [None if each is None else each.value for each in values],
        "customdata": [None if each is None else _described(each, unit) for each in values],
        "hovertemplate": "%{customdata}<extra></extra>",
    }


def _band(values: Sequence[_Value]) -> dict[str, Any]:
    """Return one polygon for each run of frames that have an interval; None parts them."""
    x: list[int | None] = []
    y: list[float | None] = []
    run: list[_Value] = []
    for each in (*_broken([value for value in values if value.half_width is not None]), None):
        if each is not None:
            run.append(each)
            continue
        x += [*(value.number for value in run), *(value.number for value in reversed(run)), None]
        y += [round(value.value + (value.half_width or 0.0), 5) for value in run]
        y += [*(round(value.value - (value.half_width or 0.0), 5) for value in reversed(run)), None]
        run = []
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "95 % interval",
        "x": x if any(each is not None for each in x) else [],
        "y": y,
        "fill": "toself",
        "fillcolor": "@band",
        "line": {"color": "@band", "width": 1},
        "hoverinfo": "skip",
    }


def _described(each: _Value, unit: str) -> str:
    digits = decimals(each.half_width)
    interval = "" if each.half_width is None else f" ± {each.half_width:.{digits}f}"
    return label(each.row, f"{each.value:.{digits}f}{interval} {unit}")
