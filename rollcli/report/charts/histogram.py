"""How often each roll occurs."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.files.results import Row
from rollcli.report.charts.axis_range import view
from rollcli.report.charts.chart import Chart
from rollcli.report.charts.names import HISTOGRAM
from rollcli.report.summary import degrees
from rollcli.round_step import round_step

_MOST_BINS = 40
_NARROWEST = 0.01  # degrees
_FEW = 6


def histogram(rows: Sequence[Row]) -> Chart:
    """Return how many frames have which roll, suspect ones on top of the others."""
    low, high = view(rows)
    shown = [row.roll_deg for row in rows if row.roll_deg is not None and low <= row.roll_deg <= high]
    low, high = min(shown, default=low), max(shown, default=high)
    step = round_step(max((high - low) / _bins(len(shown)), _NARROWEST))
    edges = np.arange(math.floor(low / step), math.floor(high / step) + 2) * step
    spans = [f"{degrees(start, 3)} to {degrees(end, 3)}" for start, end in pairwise(edges.tolist())]
    data = []
    for status, colour in (("ok", "@c1"), ("suspect", "@suspect")):
        rolls = [row.roll_deg for row in rows if row.roll_deg is not None and row.status == status]
        bars = {
            "type": "bar",
            "name": status,
            "x": np.round(edges[:-1], 6).tolist(),
            "offset": 0,
            "y": np.histogram(rolls, edges)[0].tolist(),
            "width": step,
            "marker": {"color": colour, "line": {"color": "@card", "width": 1}},
            "customdata": spans,
            "hovertemplate": "%{customdata}<br>%{y} frames<extra></extra>",
        }
        data += [bars] if rolls else []
    layout = {
        "barmode": "stack",
        "showlegend": [trace["name"] for trace in data] != ["ok"],
        "xaxis": {"title": {"text": "roll, degrees"}, "range": _padded(edges, step), "zeroline": False},
        "yaxis": {"title": {"text": "frames"}, **_counted(int(np.histogram(shown, edges)[0].max()))},
    }
    return Chart(HISTOGRAM, "How many frames have which roll", data, layout)


def _bins(count: int) -> int:
    """Return fewer bins for fewer frames, so that bars are higher than one."""
    return min(_MOST_BINS, max(5, math.ceil(2 * math.sqrt(count))))


def _counted(highest: int) -> dict[str, Any]:
    """Let the axis begin at nothing, with ticks at whole frames where bars are low."""
    return {"range": [0, 1.05 * max(highest, 1)], **({"dtick": 1} if highest <= _FEW else {})}


def _padded(edges: NDArray[Any], step: float) -> list[float]:
    """Widen the axis around a single bar, which would fill the chart."""
    width = float(np.ptp(edges))
    margin = max(0.02 * width, (_FEW * step - width) / 2)
    return [float(edges[0]) - margin, float(edges[-1]) + margin]
