"""Charts as pictures that need neither a script nor a browser."""

import html
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.pictures.round_step import round_step
from rollcli.report.chart import Chart
from rollcli.report.colours import LIGHT, rgb
from rollcli.report.options import ReportOptions

Points = NDArray[np.floating[Any]]  # shape (N, 2): x to the right, y down, pixels
Symbol = Literal["circle", "diamond", "cross"]
Anchor = Literal["start", "middle", "end"]


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points; `dash` is how long a dash and a gap are, pixels, 0 for none."""

    points: Points
    colour: str
    width: float
    dash: float = 0.0


@dataclass(frozen=True, eq=False)
class Area:
    """A filled polygon."""

    points: Points
    colour: str


@dataclass(frozen=True, eq=False)
class Marks:
    """The same symbol at each of the points; `size` is its diameter, pixels."""

    points: Points
    colour: str
    symbol: Symbol
    size: float


@dataclass(frozen=True)
class Words:
    """A line of text; `x` and `y` are of its baseline. One that is `upright` reads from below to above."""

    x: float
    y: float
    text: str
    colour: str
    anchor: Anchor = "start"
    upright: bool = False


Item = Line | Area | Marks | Words


@dataclass(frozen=True, eq=False)
class Sketch:
    """A chart, laid out.

    Attributes
    ----------
    label : str
        What it shows, for those who cannot see it.
    width, height : int
        Pixels.
    font : float
        Size of its text, pixels.
    frame : (int, int, int, int)
        Left, top, width and height of the part where the values are.
    inside : tuple of Item
        In this order, cut off at the frame; their places count from its corner.
    around : tuple of Item
        Axes and legend.
    """

    label: str
    width: int
    height: int
    font: float
    frame: tuple[int, int, int, int]
    inside: tuple[Item, ...]
    around: tuple[Item, ...]


_DASHES = {"dot": 3.0, "dash": 8.0}  # pixels
_SYMBOLS: Mapping[str, Symbol] = {"diamond": "diamond", "x-thin": "cross"}


def colour_of(name: str) -> str:
    """Return one of the page's colours: "@c1" is "c1"."""
    return name.removeprefix("@")


def dash_of(line: Mapping[str, Any]) -> float:
    """Return how long a dash is, pixels; 0 for a whole line."""
    return _DASHES.get(line.get("dash", ""), 0.0)


def symbol_of(marker: Mapping[str, Any]) -> Symbol:
    """Return the shape of a mark."""
    return _SYMBOLS.get(marker.get("symbol", ""), "circle")


_FINER = 2  # drawn so many times larger, then averaged: smooth edges, and lines of any width
_SHIFT = 4  # bits of a coordinate after the point
_CORNERS = 24  # of what stands for a circle
_LETTERS = cv2.FONT_HERSHEY_SIMPLEX
_CAPITAL = 21.0  # height of a capital of the font at scale 1, pixels
_CAPITAL_SHARE = 0.72  # of a font's size, in the fonts of browsers

Canvas = NDArray[np.uint8]


def png_file(sketch: Sketch, scale: float = 1.5) -> bytes:
    """Return a chart on white.

    Parameters
    ----------
    sketch : Sketch
    scale : float
        Pixels of the picture for each of the sketch.

    Returns
    -------
    bytes
        A PNG, 8 bit, RGB.
    """
    finer = scale * _FINER
    size = (math.ceil(sketch.height * finer), math.ceil(sketch.width * finer), 3)
    canvas = np.full(size, rgb("card"), np.uint8)
    left, top, width, height = (round(each * finer) for each in sketch.frame)
    inside = canvas[top : top + height, left : left + width].copy()  # cuts off what lies outside of it
    for item in sketch.inside:
        _draw(inside, item, sketch.font, finer)
    canvas[top : top + height, left : left + width] = inside
    for item in sketch.around:
        _draw(canvas, item, sketch.font, finer)
    target = (round(sketch.width * scale), round(sketch.height * scale))
    picture = cv2.resize(canvas, target, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return data.tobytes()


def _draw(canvas: Canvas, item: Item, font: float, scale: float) -> None:
    if isinstance(item, Words):
        _draw_words(canvas, item, font, scale)
        return
    points, pen = item.points * scale, 0
    if isinstance(item, Line):
        pen = max(1, round(item.width * scale))
        parts = _dashes(points, item.dash * scale) if item.dash else [points]
    elif isinstance(item, Marks):
        pen = round(item.size * scale / 4) if item.symbol == "cross" else 0
        parts = [stroke + point for point in points for stroke in _shape(item, scale)]
    else:
        parts = [points]
    opacity, colour = LIGHT[item.colour][1], rgb(item.colour)
    if not parts:
        return
    if opacity == 1:
        _paint(canvas, parts, colour, pen)
        return
    part, corner = _around(canvas, points, pen)
    painted = part.copy()
    _paint(painted, [each - corner for each in parts], colour, pen)
    part[:] = cv2.addWeighted(painted, opacity, part, 1 - opacity, 0)


def _paint(canvas: Canvas, parts: Sequence[Points], colour: tuple[int, int, int], pen: int) -> None:
    """Draw lines of this width, or fill shapes where it is 0."""
    fixed = [np.rint(part * 2**_SHIFT).astype(np.int32) for part in parts]
    if pen:
        cv2.polylines(canvas, fixed, False, colour, pen, cv2.LINE_AA, _SHIFT)
    else:
        for each in fixed:  # one by one: where two overlap, fillPoly would leave a hole
            cv2.fillPoly(canvas, [each], colour, cv2.LINE_AA, _SHIFT)


def _around(canvas: Canvas, points: Points, pen: int) -> tuple[Canvas, Points]:
    """Return the part of a canvas that holds these points, and its corner."""
    size = np.array(canvas.shape[1::-1])
    low = np.clip(np.floor(points.min(axis=0)) - pen - 2, 0, size - 1).astype(int)
    high = np.clip(np.ceil(points.max(axis=0)) + pen + 2, low + 1, size).astype(int)
    return canvas[low[1] : high[1], low[0] : high[0]], low.astype(float)


def _shape(marks: Marks, scale: float) -> list[Points]:
    """Return the strokes or the outline of a mark around the origin."""
    half = marks.size * scale / 2
    if marks.symbol == "cross":
        return [half * np.array([(-1.0, -1.0), (1.0, 1.0)]), half * np.array([(-1.0, 1.0), (1.0, -1.0)])]
    if marks.symbol == "diamond":
        return [half * np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])]
    turns = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
    return [half * np.column_stack([np.cos(turns), np.sin(turns)])]


def _dashes(points: Points, dash: float) -> list[Points]:
    """Cut a line into dashes with gaps of the same length between them."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    parts = []
    for start in np.arange(0, along[-1], 2 * dash):
        ends = np.array([start, min(start + dash, along[-1])])
        places = np.unique(np.concatenate([ends, along[(along > ends[0]) & (along < ends[1])]]))
        parts.append(np.column_stack([np.interp(places, along, points[:, axis]) for axis in (0, 1)]))
    return parts


def _draw_words(canvas: Canvas, words: Words, font: float, scale: float) -> None:
    """Write a line; what the font does not have is written with what it has."""
    text = words.text.replace("−", "-")
    pixels = font * scale
    size, pen = pixels * _CAPITAL_SHARE / _CAPITAL, max(1, round(pixels / 13))
    (width, height), below = cv2.getTextSize(text, _LETTERS, size, pen)
    patch = np.full((height + below + 2 * pen, width + 2 * pen, 3), rgb("card"), np.uint8)
    cv2.putText(patch, text, (pen, height + pen), _LETTERS, size, rgb(words.colour), pen, cv2.LINE_AA)
    before = {"start": 0.0, "middle": width / 2, "end": float(width)}[words.anchor]
    x, y = words.x * scale, words.y * scale
    if words.upright:
        patch = np.rot90(patch)
        left, top = x - height - pen, y - width + before - pen
    else:
        left, top = x - before - pen, y - height - pen
    _put(canvas, patch, round(left), round(top))


def _put(canvas: Canvas, patch: Canvas, left: int, top: int) -> None:
    """Lay dark words on the canvas where both overlap."""
    x0, y0 = max(left, 0), max(top, 0)
    part = canvas[y0 : max(top + patch.shape[0], 0), x0 : max(left + patch.shape[1], 0)]
    cut = patch[y0 - top : y0 - top + part.shape[0], x0 - left : x0 - left + part.shape[1]]
    np.minimum(part, cut, out=part)


_NAMESPACE = 'xmlns="http://www.w3.org/2000/svg"'
_FONTS = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"

Paint = Callable[[str, str], str]  # from an attribute and the name of a colour to attributes


def svg_for_page(sketch: Sketch, kind: str) -> str:
    """Return an element of a page, in the page's colours and font.

    Parameters
    ----------
    sketch : Sketch
    kind : str
        Its class.
    """
    box = f'viewBox="0 0 {sketch.width} {sketch.height}" font-size="{sketch.font:g}"'
    return f'<svg class="{kind}" {box} aria-hidden="true">{_items(sketch, _page_paint)}</svg>'


def svg_file(sketch: Sketch) -> bytes:
    """Return a file of its own: light colours on white, as slides have it."""
    size = f'width="{sketch.width}" height="{sketch.height}" viewBox="0 0 {sketch.width} {sketch.height}"'
    text = (
        f'<svg {_NAMESPACE} {size} role="img" font-family="{_FONTS}" font-size="{sketch.font:g}">\n'
        f"<title>{html.escape(sketch.label)}</title>\n"
        f'<rect width="100%" height="100%" {_file_paint("fill", "card")}/>\n'
        f"{_items(sketch, _file_paint)}</svg>\n"
    )
    return text.encode("utf-8", "replace")


def _page_paint(attribute: str, colour: str) -> str:
    return f'{attribute}="var(--{colour})"'


def _file_paint(attribute: str, colour: str) -> str:
    digits, opacity = LIGHT[colour]
    return f'{attribute}="#{digits}"' + (f' {attribute}-opacity="{opacity:g}"' if opacity < 1 else "")


def _items(sketch: Sketch, paint: Paint) -> str:
    """Return the items; an inner `svg` cuts off what lies outside of the frame."""
    left, top, width, height = sketch.frame
    inside = "".join(f"{_item(each, paint)}\n" for each in sketch.inside)
    around = "".join(f"{_item(each, paint)}\n" for each in sketch.around)
    place = f'x="{left}" y="{top}" width="{width}" height="{height}" overflow="hidden"'
    return f"<svg {place}>\n{inside}</svg>\n{around}"


def _item(item: Item, paint: Paint) -> str:
    if isinstance(item, Line):
        dash = f' stroke-dasharray="{item.dash:g}"' if item.dash else ""
        pen = f'fill="none" {paint("stroke", item.colour)} stroke-width="{item.width:.4g}"{dash}'
        return f'<path d="{_path(item.points)}" {pen}/>'
    if isinstance(item, Area):
        return f'<path d="{_path(item.points)}Z" {paint("fill", item.colour)}/>'
    if isinstance(item, Marks):
        return _marks(item, paint)
    return _words(item, paint)


def _path(points: Points) -> str:
    """Return a path to tenths of a pixel; each point is told by how far it is from the one before."""
    tenths = (points * 10).round().astype(int)
    steps = tenths[1:] - tenths[:-1]
    start = f"M{tenths[0, 0] / 10:g} {tenths[0, 1] / 10:g}"
    return start + "".join(f"l{x / 10:g} {y / 10:g}" for x, y in steps.tolist())


def _marks(marks: Marks, paint: Paint) -> str:
    half = marks.size / 2
    r, d = f"{half:.3g}", f"{2 * half:.3g}"
    shapes = {
        "circle": f"m-{r} 0a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0",
        "diamond": f"m0 -{r}l{r} {r}l-{r} {r}l-{r} -{r}Z",
        "cross": f"m-{r} -{r}l{d} {d}m0 -{d}l-{d} {d}",
    }
    path = "".join(f"M{x:.1f} {y:.1f}{shapes[marks.symbol]}" for x, y in marks.points.tolist())
    if marks.symbol == "cross":
        return f'<path d="{path}" fill="none" {paint("stroke", marks.colour)} stroke-width="{half / 2:.3g}"/>'
    return f'<path d="{path}" {paint("fill", marks.colour)}/>'


def _words(words: Words, paint: Paint) -> str:
    place = f'x="{words.x:.4g}" y="{words.y:.4g}" text-anchor="{words.anchor}"'
    if words.upright:
        place += f' transform="rotate(-90 {words.x:.4g} {words.y:.4g})"'
    return f"<text {place} {paint('fill', words.colour)}>{html.escape(words.text)}</text>"


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


_WIDTH, _HEIGHT, _FONT = 1280, 560, 18.0  # pixels: a slide leaves so much below its title
_WRITERS = {"svg": svg_file, "png": png_file}


def chart_files(charts: Mapping[str, Chart], options: ReportOptions) -> dict[str, bytes]:
    """Return the content of each file that is asked for."""
    files: dict[str, bytes] = {}
    for name, chart in charts.items():
        for kind, path in options.chart_paths(name).items():
            files[path] = _WRITERS[kind](lay_out(chart, _WIDTH, _HEIGHT, _FONT))
    return files


# width, height and font of the chart's place on the page, pixels; the page's styles show one of them
_WIDE, _NARROW = (1000, 368, 13.0), (350, 352, 11.0)


def with_still(chart: Chart) -> Chart:
    """Return the chart with its pictures for wide and for narrow screens."""
    wide = svg_for_page(lay_out(chart, *_WIDE), "still wide-screen")
    narrow = svg_for_page(lay_out(chart, *_NARROW), "still narrow-screen")
    return replace(chart, still=wide + narrow)
