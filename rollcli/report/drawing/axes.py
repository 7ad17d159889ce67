"""The axes and the legend of a picture of a chart."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from rollcli.report.charts.chart import Chart
from rollcli.report.drawing.sketch import Area, Item, Line, Marks, Words
from rollcli.report.drawing.words import colour_of, dash_of, symbol_of
from rollcli.round_step import round_step

_LETTER = 0.56  # width of a letter, of the font's size: digits of the usual fonts have this width
_SWATCH, _APART = 2.3, 1.1  # of the legend, of the font's size
_ROW = 1.55
_FAR_APART = 9.0  # labels along the frames, of the font's size; half of it along the values
_RANKS = 1000  # of a trace that names none, as plotly has it


class Axis(NamedTuple):
    """One axis: its ends, its name, the step that its labels must have (0: any), and if zero is marked."""

    ends: tuple[float, float]
    name: str
    step: float = 0.0
    zero: bool = False

    @classmethod
    def of(cls, layout: Mapping[str, Any]) -> "Axis":
        """Take what is needed of plotly's words."""
        low, high = layout["range"]
        step = float(layout.get("dtick", 0.0))
        return cls((float(low), float(high)), layout["title"]["text"], step, layout.get("zeroline", False))

    def ticks(self, length: int, apart: float) -> list[tuple[float, str]]:
        """Return where labels stand, pixels from the lower end, and what they say."""
        low, high = self.ends
        step = max(round_step(apart * (high - low) / length), self.step)
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        numbers = [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
        return [((each - low) / (high - low) * length, _number(each, digits)) for each in numbers]


class Axes(NamedTuple):
    """Both axes."""

    x: Axis
    y: Axis

    @classmethod
    def of(cls, layout: Mapping[str, Any]) -> "Axes":
        """Take what is needed of plotly's words."""
        return cls(Axis.of(layout["xaxis"]), Axis.of(layout["yaxis"]))

    def names(self, left: int, top: int, width: int, height: int, font: float) -> Iterator[Item]:
        """Yield the labels and names beside a frame."""
        for along, text in self.x.ticks(width, _FAR_APART * font):
            yield Words(left + along, top + height + 1.4 * font, text, "text", "middle")
        for up, text in self.y.ticks(height, _FAR_APART * font / 2):
            yield Words(left - 0.5 * font, top + height - up + 0.35 * font, text, "text", "end")
        yield Words(left + width / 2, top + height + 3.0 * font, self.x.name, "text", "middle")
        yield Words(1.1 * font, top + height / 2, self.y.name, "text", "middle", upright=True)


def margins(axes: Axes, height: int, font: float, rows: int) -> tuple[int, int, int, int]:
    """Return the space left of a frame, above, right and below it, pixels; the legend has some rows."""
    widest = max(len(text) for _, text in axes.y.ticks(height, _FAR_APART * font / 2))
    left = round(font * (2.2 + _LETTER * widest))
    return left, round(font * (0.7 + rows * _ROW)), round(0.9 * font), round(3.7 * font)


def axis_items(axes: Axes, width: int, height: int, font: float) -> Iterator[Item]:
    """Yield the lines behind the values."""
    for along, _ in axes.x.ticks(width, _FAR_APART * font):
        yield Line(np.array([(along, 0.0), (along, float(height))]), "grid", font / 13)
    for up, text in axes.y.ticks(height, _FAR_APART * font / 2):
        zero = axes.y.zero and float(text.replace("−", "-").replace(",", "")) == 0
        ends = np.array([(0.0, height - up), (float(width), height - up)])
        yield Line(ends, "line" if zero else "grid", font / (6.5 if zero else 13))


def legend_items(chart: Chart, width: int, font: float) -> Iterator[list[Item]]:
    """Yield the rows of the legend, none where the chart has none."""
    if not chart.layout.get("showlegend", True):
        return
    named = [trace for trace in chart.data if trace.get("showlegend", True)]
    row: list[Item] = []
    x, y = 0.5 * font, 0.9 * font
    for trace in sorted(named, key=lambda each: each.get("legendrank", _RANKS)):
        needed = font * (_SWATCH + 0.5 + _LETTER * len(trace["name"]))
        if row and x + needed > width:
            yield row
            row, x, y = [], 0.5 * font, y + _ROW * font
        name = Words(x + (_SWATCH + 0.5) * font, y + 0.35 * font, trace["name"], "text")
        row += [*_swatch(trace, x, y, font), name]
        x += needed + _APART * font
    yield row


def _swatch(trace: Mapping[str, Any], x: float, y: float, font: float) -> Iterator[Item]:
    """Yield the sample of a trace: a box, a line or a mark."""
    width, half = _SWATCH * font, 0.35 * font
    box = np.array([(x, y - half), (x + width, y - half), (x + width, y + half), (x, y + half)])
    line, marker = trace.get("line", {}), trace.get("marker", {})
    if trace["type"] == "bar":
        yield Area(box, colour_of(marker["color"]))
    elif trace.get("fill"):
        yield Area(box, colour_of(trace["fillcolor"]))
    elif "lines" in trace["mode"]:
        ends = np.array([(x, y), (x + width, y)])
        yield Line(ends, colour_of(line["color"]), line["width"] * font / 13, dash_of(line) * font / 13)
    else:
        yield Marks(np.array([(x + width / 2, y)]), colour_of(marker["color"]), symbol_of(marker), 0.6 * font)


def _number(value: float, digits: int) -> str:
    text = f"{value:,.{digits}f}"
    return text.replace("-", "−") if float(text.replace(",", "")) else text.lstrip("-")
