"""Charts as figures that need neither a script nor a browser: matplotlib draws them as SVG, PDF and PNG.

What the charts of a report hold is understood, and no more: `scatter` with lines, marks, bars of error and
filled bands, and `bar` on top of each other. matplotlib is part of the extra `report` and takes a second to
load: this module is imported once something is to be drawn.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator
from numpy.typing import NDArray

from rollcli.pictures.colours import LIGHT
from rollcli.pictures.figures import SLIDE, Size, drawing_style, figure_file
from rollcli.report.page import Chart

_MOST_TO_KEEP = 2000  # points of a line or band; of more, those are kept that reach furthest in each column
_COLUMNS = 1000  # of thinning: no figure shows finer ones
_LETTER, _SWATCH = 0.56, 4.0  # widths in a legend, of the font's size
_LINES = {"dash": (0, (4.0, 3.0))}  # of a line's width
_MARKS = {"diamond": "D", "x-thin": "x"}
_COLOUR = re.compile("#[0-9a-f]{6}")
_VARIABLES = {f"#{digits}": f"var(--{name})" for name, digits in reversed([*LIGHT.items()])}
# places of a chart on the page; its styles show one of them
_WIDE, _NARROW = Size(1000.0, 368.0, 13.0), Size(350.0, 352.0, 11.0)

Trace = Mapping[str, Any]


@dataclass(frozen=True)
class Drawing:
    """A chart that matplotlib alone draws.

    Attributes
    ----------
    name : str
        No other chart of the page has it.
    label : str
        What it shows, for those who cannot see it.
    draw : callable
        Draws it into axes; takes the scale of widths and marks, too, which is 1 for letters of 13 pixels.
    """

    name: str
    label: str
    draw: Callable[[Axes, float], None]


def chart_file(chart: Chart | Drawing, kind: str, size: Size = SLIDE) -> bytes:
    """Return a chart as a file on white: "svg", "pdf" or "png"."""
    with drawing_style(size):
        return figure_file(_drawn(chart, size), kind, chart.label)


def stills(chart: Chart | Drawing) -> str:
    """Return the pictures of a chart for wide and for narrow screens, HTML.

    They stand where a page's charts will be, so that a page is whole before any script has run.
    """
    sizes = (("wide-screen", _WIDE), ("narrow-screen", _NARROW))
    return "".join(_still(chart, name, size) for name, size in sizes)


def _still(chart: Chart | Drawing, name: str, size: Size) -> str:
    """Return an element of a page, in the page's colours and font."""
    with drawing_style(size, f"{chart.name} {name}"):  # the salt keeps what it refers to apart from others'
        svg = figure_file(_drawn(chart, size), "svg", "").decode()
    inner = svg[svg.index("</defs>", svg.index("<style")) + len("</defs>") :]
    inner = re.sub(r' id="[\w.]+_\d+"|\n *', "", inner)
    inner = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", inner)  # as older versions have it
    inner = re.sub(r"font-family: [^;\"]*;? ?", "", inner)
    inner = _COLOUR.sub(lambda found: _VARIABLES[found[0]], inner)
    # as attributes, whatever the page's policy says of styles
    inner = re.sub(
        r'style="([^"]*)"', lambda found: re.sub(r"([\w-]+): ([^;]*);? ?", r'\1="\2" ', found[1]), inner
    )
    box = f'viewBox="0 0 {size.width:g} {size.height:g}" stroke-linejoin="round" aria-hidden="true"'
    return f'<svg class="still {name}" {box}>{inner}'


def _drawn(chart: Chart | Drawing, size: Size) -> Figure:
    figure = Figure((size.width / 72, size.height / 72), dpi=72, layout="constrained")
    axes = figure.add_subplot()
    scale = size.font / 13  # of widths and marks, which charts give for letters of 13 pixels
    if isinstance(chart, Drawing):
        chart.draw(axes, scale)
    else:
        _draw_traces(axes, chart, scale)
    samples, names = axes.get_legend_handles_labels()
    for side in axes.spines.values():
        side.set_visible(False)
    axes.tick_params(length=0, which="both")
    if names:
        needed = [(_SWATCH + _LETTER * len(name)) * size.font for name in names]
        columns = len(names) if sum(needed) <= size.width else max(1, int(size.width / max(needed)))
        figure.legend(samples, names, loc="outside upper left", ncols=columns, handlelength=2, borderpad=0)
    return figure


def _draw_traces(axes: Axes, chart: Chart, scale: float) -> None:
    """Draw a chart as plotly has it."""
    base, look = np.zeros(1), dict[str, Any]()
    # in the legend by plotly's ranks, on top of each other as they come
    for order, trace in sorted(enumerate(chart.data, 2), key=lambda each: each[1].get("legendrank", 1000)):
        name = trace["name"] if chart.layout["showlegend"] and trace.get("showlegend", True) else None
        if trace["type"] == "bar":
            counts = np.asarray(trace["y"], float)
            look = {"color": colour(trace["marker"]["color"]), "edgecolor": colour("card"), "label": name}
            axes.bar(trace["x"], counts, trace["width"], base, align="edge", linewidth=scale, **look)
            base = base + counts
        else:
            _draw_scatter(axes, trace, scale, order, name)
    for name in "xy":
        _set_axis(axes, name, chart.layout[f"{name}axis"])
    if chart.layout["yaxis"].get("zeroline"):
        axes.axhline(0, color=colour("line"), linewidth=2 * scale, zorder=1)


def _set_axis(axes: Axes, name: str, layout: Mapping[str, Any]) -> None:
    """Set ends, labels and name of an axis from plotly's words for it."""
    axis = axes.xaxis if name == "x" else axes.yaxis
    if "dtick" in layout:
        axis.set_major_locator(MultipleLocator(layout["dtick"]))
    else:
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10], integer="tickformat" in layout))
    if "tickformat" in layout:
        axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
    axes.set(**{f"{name}label": layout["title"]["text"], f"{name}lim": layout["range"]})


def _draw_scatter(axes: Axes, trace: Trace, scale: float, order: int, name: str | None) -> None:
    x, y = (np.array(trace[name], float) for name in "xy")  # NaN where there is no value
    if trace.get("fill"):
        width = trace["line"].get("width", 0) * scale
        look = {"color": colour(trace["fillcolor"]), "linewidth": width, "zorder": order}
        areas = [axes.fill(*run.T, **look)[0] for run in _runs(x, y)]
        for each in areas[:1]:
            each.set_label(name)
        return
    if "error_y" in trace:
        bars = trace["error_y"]
        pen = {"ecolor": colour(bars["color"]), "elinewidth": bars["thickness"] * scale}
        axes.errorbar(x, y, bars["array"], fmt="none", zorder=order, **pen)
    if trace["mode"] == "lines":
        gap = [[np.nan, np.nan]]
        x, y = np.vstack([part for run in _runs(x, y) for part in (run, gap)]).T
    where: dict[str, Any] = {"transform": axes.get_xaxis_transform()} if trace.get("yaxis") == "y2" else {}
    axes.plot(x, y, zorder=order, label=name, **_look(trace, scale), **where)


def _runs(x: NDArray[Any], y: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """Yield the points between gaps, shape (N, 2); of many, those that make the same picture."""
    points = np.column_stack([x, y])
    known = np.isfinite(points).all(axis=1)
    columns = np.floor(x * (_COLUMNS / max(float(np.ptp(x[known])), 1e-9)))
    for run in np.split(np.arange(len(x)), np.flatnonzero(~known)):
        shown = run[known[run]]
        if len(x) > _MOST_TO_KEEP and len(shown):
            parts = np.split(shown, np.flatnonzero(np.diff(columns[shown])) + 1)
            # where a line enters and leaves a column of pixels, and how far it reaches in between
            kept = [(part[0], part[y[part].argmin()], part[y[part].argmax()], part[-1]) for part in parts]
            shown = np.unique(kept)
        if len(shown):
            yield points[shown]


def _look(trace: Trace, scale: float) -> dict[str, Any]:
    """Return what a trace looks like, in the words of matplotlib's lines."""
    line, marker = trace.get("line", {}), trace.get("marker", {})
    paint = colour(line.get("color") or marker["color"])
    lines, marks = "lines" in trace["mode"], "markers" in trace["mode"]
    symbol = marker.get("symbol", "circle")
    is_open = symbol == "x-thin"
    # plotly's size is that of a circle; a square on its tip is larger by the root of two
    size = marker.get("size", 6) * scale * (0.7 if symbol == "diamond" else 1.0)
    return {
        "color": paint,
        "linestyle": _LINES.get(line.get("dash", ""), "-") if lines else "none",
        "linewidth": line["width"] * scale if lines else 0,
        "marker": _MARKS.get(symbol, "o") if marks else "",
        "markersize": size,
        "markerfacecolor": "none" if is_open else paint,
        "markeredgewidth": marker["line"]["width"] * scale if is_open else 0,
    }


def colour(name: str) -> str:
    """Return one of the page's colours, in light mode, by its name or as a chart has it: "c1" or "@c1"."""
    return f"#{LIGHT[name.removeprefix('@')]}"
