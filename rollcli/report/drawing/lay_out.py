"""Lay a chart out: where its lines, marks, axes and legend lie in a picture of some size.

What the charts of a report hold is understood, and no more: `scatter` with lines, marks, bars of error and
filled bands, `bar` on top of each other, linear axes with a given range.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rollcli.report.charts.chart import Chart
from rollcli.report.drawing.axes import Axes, axis_items, legend_items, margins
from rollcli.report.drawing.sketch import Area, Item, Line, Marks, Points, Sketch
from rollcli.report.drawing.words import colour_of, dash_of, symbol_of

_FAR = 50.0  # heights of the frame: what lies further off is drawn so far off
_FEWEST_TO_THIN = 4  # points of a line in one column of pixels; fewer are kept as they are

Trace = Mapping[str, Any]


class _Place(NamedTuple):
    """The frame's size, pixels, and the axes."""

    width: int
    height: int
    axes: Axes


def lay_out(chart: Chart, width: int, height: int, font: float = 13.0) -> Sketch:
    """Return a chart at some size.

    Parameters
    ----------
    chart : Chart
        Its axes have ranges; see the module.
    width, height : int
        Pixels.
    font : float
        Size of its text, pixels; lines and marks grow with it.

    Returns
    -------
    Sketch
    """
    axes = Axes.of(chart.layout)
    legend = list(legend_items(chart, width, font))
    left, top, right, bottom = margins(axes, height, font, rows=len(legend))
    place = _Place(width - left - right, height - top - bottom, axes)
    scale = font / 13.0
    scatters = [trace for trace in chart.data if trace["type"] == "scatter"]
    bars = [trace for trace in chart.data if trace["type"] == "bar"]
    inside = [
        *axis_items(axes, place.width, place.height, font),
        *(item for trace in scatters for item in _scatter(trace, place, scale)),
        *_bars(bars, place),
    ]
    around = [
        *(item for row in legend for item in row),
        *axes.names(left, top, place.width, place.height, font),
    ]
    frame = (left, top, place.width, place.height)
    return Sketch(chart.label, width, height, font, frame, tuple(inside), tuple(around))


def _scatter(trace: Trace, place: _Place, scale: float) -> Iterator[Item]:
    low, high = (0.0, 1.0) if trace.get("yaxis") == "y2" else place.axes.y.ends
    x, y = (np.array([np.nan if each is None else each for each in trace[name]], float) for name in "xy")
    across = (x - place.axes.x.ends[0]) / np.ptp(place.axes.x.ends) * place.width
    down = (high - y) / (high - low) * place.height
    points = np.column_stack([across, np.clip(down, -_FAR * place.height, _FAR * place.height)])
    line, marker = trace.get("line", {}), trace.get("marker", {})
    for stretch in _stretches(points) if "lines" in trace["mode"] else ():
        thinned = _thinned(stretch)
        if trace.get("fill"):
            yield Area(thinned, colour_of(trace["fillcolor"]))
        if line.get("width"):
            yield Line(thinned, colour_of(line["color"]), line["width"] * scale, dash_of(line) * scale)
    if "markers" in trace["mode"]:
        known = points[np.isfinite(points).all(axis=1)]
        if "error_y" in trace:
            yield from _error_bars(known, trace["error_y"], place.height / (high - low), scale)
        yield Marks(known, colour_of(marker["color"]), symbol_of(marker), marker["size"] * scale)


def _error_bars(points: Points, bars: Trace, per_unit: float, scale: float) -> Iterator[Item]:
    for (x, y), half in zip(points.tolist(), bars["array"], strict=True):
        ends = np.array([(x, y - half * per_unit), (x, y + half * per_unit)])
        yield Line(ends, colour_of(bars["color"]), bars["thickness"] * scale)


def _bars(traces: Sequence[Trace], place: _Place) -> Iterator[Item]:
    """Stack the bars of later traces on those of earlier ones, a gap of a pixel between neighbours."""
    (low, high), top = place.axes.x.ends, place.axes.y.ends[1]
    base = np.zeros(len(traces[0]["y"])) if traces else np.zeros(0)
    for trace in traces:
        counts, starts = np.asarray(trace["y"], float), np.asarray(trace["x"], float)
        left = (starts - low) / (high - low) * place.width + 0.5
        right = (starts + trace["width"] - low) / (high - low) * place.width - 0.5
        lower, upper = (place.height * (1 - each / top) for each in (base, base + counts))
        for x0, x1, y0, y1, count in zip(left, right, upper, lower, counts, strict=True):
            if count:
                corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
                yield Area(corners, colour_of(trace["marker"]["color"]))
        base = base + counts


def _stretches(points: Points) -> list[Points]:
    """Return the runs of points between gaps."""
    gaps = np.flatnonzero(~np.isfinite(points).all(axis=1))
    runs = np.split(points, gaps)
    return [run[np.isfinite(run).all(axis=1)] for run in runs if np.isfinite(run).all(axis=1).any()]


def _thinned(points: Points) -> Points:
    """Keep of each column of pixels where the line enters and leaves it, and its ends: it looks the same."""
    columns = np.floor(points[:, 0])
    starts = np.flatnonzero(np.diff(columns, prepend=np.nan) != 0)
    ends = np.append(starts[1:], len(points))
    kept: list[int] = []
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if end - start <= _FEWEST_TO_THIN:
            kept += range(start, end)
        else:
            heights = points[start:end, 1]
            kept += sorted({start, start + int(heights.argmin()), start + int(heights.argmax()), end - 1})
    return points[kept]
