"""Charts as figures that need neither a script nor a browser: matplotlib draws them as SVG, PDF and PNG.

What the charts of this program hold is understood, and no more: `scatter` with lines, marks, bars of error
and filled bands, and `bar` on top of each other, over linear, logarithmic and named axes. matplotlib is part
of the extra `report` and takes a second to load: this module is imported once something is to be drawn.
"""

import html
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray

from rollcli.pictures.colours import LIGHT
from rollcli.pictures.figures import SLIDE, Size, drawing_style, figure_file
from rollcli.report.page import Chart

_MOST_TO_KEEP = 2000  # points of a line or band; of more, those are kept that reach furthest in each column
_COLUMNS = 1000  # of thinning: no figure shows finer ones
_LETTER, _SWATCH = 0.56, 4.0  # widths in a legend, of the font's size
_GREEK_INDEX = re.compile(r"(\w)<sub>(\w+)</sub>")
_LINES = {"dot": (0, (1.5, 1.5)), "dash": (0, (4.0, 3.0))}  # of a line's width
_MARKS = {"diamond": "D", "x-thin": "x", "circle-open": "o"}
_COLOUR = re.compile("#[0-9a-f]{6}")
_VARIABLES = {f"#{digits}": f"var(--{name})" for name, digits in reversed([*LIGHT.items()])}
# places of a chart on the page; its styles show one of them
_WIDE, _NARROW = Size(1000.0, 368.0, 13.0), Size(350.0, 352.0, 11.0)

Trace = Mapping[str, Any]


def chart_file(chart: Chart, kind: str, size: Size = SLIDE) -> bytes:
    """Return a chart as a file on white: "svg", "pdf" or "png"."""
    with drawing_style(size):
        return figure_file(_drawn(chart, size), kind, chart.label)


def with_still(chart: Chart) -> Chart:
    """Return the chart with its pictures for wide and for narrow screens.

    They stand where a page's charts will be, so that a page is whole before any script has run.
    """
    stills = (("wide-screen", _WIDE), ("narrow-screen", _NARROW))
    return replace(chart, still="".join(_still(chart, name, size) for name, size in stills))


def _still(chart: Chart, name: str, size: Size) -> str:
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


def _drawn(chart: Chart, size: Size) -> Figure:
    figure = Figure((size.width / 72, size.height / 72), dpi=72, layout="constrained")
    axes = figure.add_subplot()
    scale = size.font / 13  # of widths and marks, which charts give for letters of 13 pixels
    across, up = (_Scale(chart, name) for name in "xy")
    base, look = np.zeros(1), dict[str, Any]()
    for order, trace in enumerate(chart.data, 2):
        if trace["type"] == "bar":
            counts = np.asarray(trace["y"], float)
            look = {"color": _colour(trace["marker"]["color"]), "edgecolor": _colour("@card")}
            axes.bar(trace["x"], counts, trace["width"], base, align="edge", linewidth=scale, **look)
            base = base + counts
        else:
            _draw_scatter(axes, trace, across, up, scale, order)
    for shape, words in zip(chart.layout.get("shapes", ()), chart.layout.get("annotations", ()), strict=True):
        style = _LINES[shape["line"]["dash"]]
        axes.axvline(shape["x0"], color=_colour(shape["line"]["color"]), linewidth=scale, linestyle=style)
        place, anchor = (words["x"], words["y"]), axes.get_xaxis_transform()
        axes.annotate(
            f" {words['text']}", place, xycoords=anchor, va=words["yanchor"], color=_colour("@muted")
        )
    across.set(axes)
    up.set(axes)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.tick_params(length=0, which="both")
    if chart.layout.get("yaxis", {}).get("zeroline"):
        axes.axhline(0, color=_colour("@line"), linewidth=2 * scale, zorder=1)
    _add_legend(figure, chart, size, scale)
    return figure


class _Scale:
    """One axis: what plotly's words for it mean, and places for names in place of numbers."""

    def __init__(self, chart: Chart, name: str) -> None:
        self._name, self._layout = name, chart.layout.get(f"{name}axis", {})
        values = [trace[name] for trace in chart.data]
        self._names: dict[str, None] = {}
        if values and isinstance(values[0][0], str | list):
            self._names = dict.fromkeys(each for some in values for each in _flat(some))

    def places(self, values: Sequence[Any]) -> NDArray[Any]:
        """Return numbers; NaN where there is no value."""
        if self._names:
            order = list(self._names)
            return np.array([order.index(each) for each in _flat(values)], float)
        return np.array([np.nan if each is None else each for each in values], float)

    def set(self, axes: Axes) -> None:
        """Set ends, labels and name."""
        layout, axis = self._layout, axes.xaxis if self._name == "x" else axes.yaxis
        get_ends, set_ends, set_scale = (
            getattr(axes, each.format(self._name)) for each in ("get_{}lim", "set_{}lim", "set_{}scale")
        )
        if layout.get("type") == "log":
            set_scale("log")
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}{layout.get('ticksuffix', '')}"))
        elif "dtick" in layout:
            axis.set_major_locator(MultipleLocator(layout["dtick"]))
        elif not self._names:
            axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10], integer="tickformat" in layout))
        if "tickformat" in layout:
            axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
        named = (range(len(self._names)), [_words(each.rpartition("\t")[2]) for each in self._names])
        places, names = (layout["tickvals"], layout["ticktext"]) if "tickvals" in layout else named
        if names:
            axis.set_ticks(places, names)
        groups = [each.rpartition("\t")[0] for each in self._names]
        if any(groups):
            axes.tick_params(axis="x", rotation=45)
            for each in dict.fromkeys(groups):
                middle = np.mean([at for at, name in enumerate(groups) if name == each])
                where: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "ha": "center"}
                axes.text(float(middle), 1.02, each, va="bottom", **where)
        axis.set_label_text(_words(layout.get("title", {}).get("text", "")))
        low, high = get_ends()
        set_ends(layout.get("range", (0 if layout.get("rangemode") == "tozero" else low, high)))
        axis.set_inverted(layout.get("autorange") == "reversed")


def _flat(values: Sequence[Any]) -> list[str]:
    """Return names; those of two levels as the outer one, a tab, and the inner one."""
    if values and isinstance(values[0], list):
        return [f"{outer}\t{inner}" for outer, inner in zip(*values, strict=True)]
    return list(values)


def _draw_scatter(axes: Axes, trace: Trace, across: _Scale, up: _Scale, scale: float, order: int) -> None:
    x, y = across.places(trace["x"]), up.places(trace["y"])
    if trace.get("fill"):
        width = trace["line"].get("width", 0) * scale
        for run in _runs(x, y):
            axes.fill(*run.T, color=_colour(trace["fillcolor"]), linewidth=width, zorder=order)
        return
    if "error_y" in trace:
        bars = trace["error_y"]
        pen = {"ecolor": _colour(bars["color"]), "elinewidth": bars["thickness"] * scale}
        axes.errorbar(x, y, bars["array"], fmt="none", zorder=order, **pen)
    if trace["mode"] == "lines":
        gap = [[np.nan, np.nan]]
        x, y = np.vstack([part for run in _runs(x, y) for part in (run, gap)]).T
    where: dict[str, Any] = {"transform": axes.get_xaxis_transform()} if trace.get("yaxis") == "y2" else {}
    axes.plot(x, y, zorder=order, **_look(trace, scale), **where)


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
    colour = _colour(line.get("color") or marker["color"])
    lines, marks = "lines" in trace["mode"], "markers" in trace["mode"]
    symbol = marker.get("symbol", "circle")
    is_open = symbol in ("circle-open", "x-thin")
    # plotly's size is that of a circle; a square on its tip is larger by the root of two
    size = marker.get("size", 6) * scale * (0.7 if symbol == "diamond" else 1.0)
    return {
        "color": colour,
        "linestyle": _LINES.get(line.get("dash", ""), "-") if lines else "none",
        "linewidth": line.get("width", 2) * scale if lines else 0,
        "marker": _MARKS.get(symbol, "o") if marks else "",
        "markersize": size,
        "markerfacecolor": "none" if is_open else colour,
        "markeredgewidth": marker.get("line", {}).get("width", 2) * scale if is_open else 0,
    }


def _add_legend(figure: Figure, chart: Chart, size: Size, scale: float) -> None:
    """Add the legend above the axes, in as many columns as fit."""
    named = [trace for trace in chart.data if trace.get("showlegend", True)]
    if not chart.layout.get("showlegend", True) or not named:
        return
    named.sort(key=lambda each: each.get("legendrank", 1000))  # plotly's rank of a trace that names none
    names = [_words(trace["name"]) for trace in named]
    letters = max(len(re.sub("<[^>]+>", "", trace["name"])) for trace in named)
    needed = (_SWATCH + _LETTER * letters) * size.font
    columns = min(len(names), max(1, int(size.width / needed)))
    samples = [_sample(trace, scale) for trace in named]
    figure.legend(samples, names, loc="outside upper left", ncols=columns, handlelength=2, borderpad=0)


def _sample(trace: Trace, scale: float) -> Any:
    if trace["type"] == "bar" or trace.get("fill"):
        return Patch(facecolor=_colour(trace.get("fillcolor") or trace["marker"]["color"]))
    return Line2D([], [], **_look(trace, scale))


def _colour(name: str) -> str:
    """Return one of the page's colours: "@c1" is that of "c1"."""
    return f"#{LIGHT[name.removeprefix('@')]}"


def _words(text: str) -> str:
    """Return a name with its indices as matplotlib writes them."""
    return _GREEK_INDEX.sub(r"$\\mathregular{\1_{\2}}$", html.unescape(text))
