"""Every chart of a result: what its page shows, and what is written for slides."""

import html
import math
import textwrap
from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rollcli.files.containers import is_rest
from rollcli.files.results import Row
from rollcli.messages import counted
from rollcli.pictures.overlay import round_step
from rollcli.report.page import Chart
from rollcli.report.summary import degrees, with_interval
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.quantities import ALIGNMENT, QUANTITIES, ROLL, Quantity
from rollcli.rig.words import answer, frame_name
from rollcli.stereo.misalignment import Misalignment

Trace = dict[str, Any]

_FEW = 10  # frames, each with a tick
_BAND = {"fill": "toself", "hoverinfo": "skip"}
_TEXT = "%{text}<extra></extra>"
_UNITS = (("h", 3600.0), ("min", 60.0), ("s", 1.0))  # name, seconds; each from two of it on
_DECIMALS = 7  # of hours less than a thousandth of a second
_LEAST_SHARE = 0.5  # of the time, that drives take: else the pauses between them would be all that is seen


@dataclass(frozen=True)
class FrameAxis:
    """Where each frame stands along a chart.

    Attributes
    ----------
    places : sequence of float
        Of each frame, in the unit, or its number, from 1.
    unit : str
        "s", "min" or "h" since the first frame; empty for numbers.
    """

    places: Sequence[float]
    unit: str = ""

    def layout(self) -> dict[str, Any]:
        """Return the axis as plotly takes it."""
        if self.unit:
            last = self.places[-1]  # the first stands at 0
            return _axis(f"time, {self.unit}", (-0.01 * last, last + 0.01 * last), zeroline=False)
        count = len(self.places)
        margin = max(0.5, 0.01 * count)
        few = {"dtick": 1} if count <= _FEW else {}  # there are no half frames
        return _axis("frame", (1 - margin, count + margin), zeroline=False, tickformat=",d", **few)


def _axis(title: str, ends: Sequence[float], **further: Any) -> dict[str, Any]:
    """Return an axis as plotly takes it."""
    return {"title": {"text": title}, "range": list(ends), **further}


def frame_axis(rows: Sequence[Row], rig: RigAssessment) -> FrameAxis:
    """Return the axis of rows: time where all frames have stamps that ascend, and pauses do not fill it.

    What stands for the broken end of a recording has no stamp, and stands where the frame before it does.
    """
    numbers, known = FrameAxis(range(1, len(rows) + 1)), np.isfinite(rig.seconds)
    ends = np.array([is_rest(row.file) for row in rows], bool)
    if not (len(rows) and known[0] and (known | ends).all()):
        return numbers
    seconds = rig.seconds[np.maximum.accumulate(np.where(known, np.arange(len(rows)), 0))]
    taken = sum(float(np.ptp(seconds[drive.frames])) for drive in rig.drives if len(drive.frames))
    whole = float(seconds[-1] - seconds[0])
    if (np.diff(seconds) < 0).any() or not taken > _LEAST_SHARE * whole:
        return numbers
    unit, size = next((each for each in _UNITS if whole >= 2 * each[1]), _UNITS[-1])
    return FrameAxis(np.round(seconds / size, _DECIMALS).tolist(), unit)


def drive_starts(rig: RigAssessment) -> set[int]:
    """Return the numbers, from 1, of the frames that begin a drive; no line is drawn into them."""
    drives = np.full(rig.count, -1)
    for number, drive in enumerate(rig.drives):
        drives[drive.frames] = number
    return {*(np.flatnonzero(np.diff(drives)) + 2).tolist()}


def rig_traces(
    rig: RigAssessment, quantity: Quantity, ends: tuple[float, float], axis: FrameAxis
) -> list[Trace]:
    """Return the traces of all drives.

    Parameters
    ----------
    rig : RigAssessment
    quantity : Quantity
    ends : (float, float)
        The lower and upper end of the chart, degrees or metres, from which to which a jump is marked.
    axis : FrameAxis

    Returns
    -------
    list of dict
        As plotly takes them; empty ones are left out.
    """
    name = quantity.name.replace("_", " ")
    band = _trace("mounting, 95 %", "lines", [], [], **_BAND, fillcolor="@mounting", line={"width": 0})
    means = _trace(
        "mounting", "lines", [], [], text=[], hovertemplate=_TEXT, line={"color": "@c3", "width": 2}
    )
    dashes = {"color": "@error", "width": 1.5, "dash": "dash"}
    jumps = _trace("jump", "lines", [], [], text=[], hovertemplate=_TEXT, line=dashes)
    for drive in rig.drives:
        found = drive.quantities.get(quantity.name)
        for segment in found.segments if found is not None else ():
            if segment.mean.value is None or segment.first == segment.last:  # a frame alone is its own mean
                continue
            first, last = (axis.places[drive.frames[place]] for place in (segment.first, segment.last))
            said = f"mounting {name} {answer(segment.end, quantity)}, of {segment.used:,} frames"
            level = [each.value or 0.0 for each in (segment.begin, segment.end)]
            _add(means, [first, last], level, said)
            if segment.begin.ci95 is not None and segment.end.ci95 is not None:
                _add_band(band, [first, last], level, [segment.begin.ci95, segment.end.ci95])
        for jump in found.jumps if found is not None else ():
            frame = int(drive.frames[jump.frame])
            change, at = answer(jump.change, quantity, change=True), frame_name(rig, drive, jump.frame)
            _add(jumps, [sum(axis.places[frame - 1 : frame + 1]) / 2] * 2, ends, f"jump by {change} at {at}")
    return [trace for trace in (band, means, jumps) if trace["x"]]


def _trace(name: str, mode: str, x: Sequence[Any], y: Sequence[Any], **look: Any) -> Trace:
    return {"type": "scatter", "mode": mode, "name": name, "x": x, "y": y, **look}


def _add(trace: Trace, x: Sequence[float], y: Sequence[float], text: str = "") -> None:
    """Add a stretch; None parts it from the next."""
    trace["x"] += [*x, None]
    trace["y"] += [*(round(each, 4) for each in y), None]
    if text:
        trace["text"] += [*([html.escape(text)] * len(x)), None]


def _add_band(trace: Trace, x: Sequence[float], values: Sequence[float], halves: Sequence[float]) -> None:
    """Add a polygon."""
    low, high = ([v + side * h for v, h in zip(values, halves, strict=True)] for side in (-1, 1))
    _add(trace, [*x, *x[::-1]], [*high, *low[::-1]])


_LONGEST = 44  # characters in a line, so that a label fits a narrow screen
_LINES = 5  # of a reason; the table and the gallery show all of it
_BEYOND = 0.35  # a suspect value may widen the view by this share of the others' range, and by half a degree
_WIDEST = 1.0  # degrees: a wider interval is seen to leave the view


def label(row: Row, value: str) -> str:
    """Return the name of a frame, its value, and why it is suspect or has failed.

    plotly takes tags and entities in a label for its own, so names and reasons are escaped.
    """
    name = row.file if len(row.file) <= _LONGEST else f"…{row.file[1 - _LONGEST :]}"
    lines = [name, *([value] if value else [])]
    if row.status != "ok":
        lines.append("failed" if row.status == "error" else "suspect")
        lines += textwrap.wrap(row.message, _LONGEST, max_lines=_LINES, placeholder=" …")
    return "<br>".join(map(html.escape, lines))


def view(rows: Sequence[Row], quantity: Quantity = ROLL) -> tuple[float, float]:
    """Return the ends of the axis: all values that are ok, and suspect ones that are not far off.

    Parameters
    ----------
    rows : sequence of Row
    quantity : Quantity

    Returns
    -------
    tuple of float
        Degrees or metres, the lower end first.
    """
    unit = quantity.scale
    there = [row for row in rows if getattr(row, quantity.column) is not None]
    if not there:
        return -unit, unit
    columns = (quantity.column, quantity.ci_column)
    values, halves = (np.array([getattr(row, name) or 0.0 for row in there]) for name in columns)
    halves = np.minimum(halves, _WIDEST * unit)
    sure = np.array([row.status == "ok" for row in there])
    sure |= not sure.any()
    low, high = float((values - halves)[sure].min()), float((values + halves)[sure].max())
    beyond = _BEYOND * (high - low) + 0.5 * unit
    # without their intervals, which are wide
    near = values[(low - beyond <= values) & (values <= high + beyond)].tolist()
    low, high = min(low, *near), max(high, *near)
    margin = 0.06 * (high - low) + 0.05 * unit
    return round(low - margin, 3), round(high + margin, 3)


def outside(rows: Sequence[Row]) -> int:
    """Return how many angles lie outside of the view."""
    low, high = view(rows)
    return sum(row.roll_deg is not None and not low <= row.roll_deg <= high for row in rows)


_MANY = 400  # up to so many frames each has a dot, and marks are large
_MOST_BINS = 40
_NARROWEST = 0.01  # degrees
_FEW_BINS = 6
_FAILED_AT = 0.035  # of the chart's height
_SAID = "%{customdata}<extra></extra>"
_AXIS_UNITS = {"deg": "degrees", "m": "m"}

# as a legend calls the parts of the alignment, and their colours
_PARTS = (("lower", "@c1"), ("turned", "@c2"), ("larger", "@c3"), ("twisted", "@c4"))


def all_charts(rows: Sequence[Row], rig: RigAssessment) -> dict[str, Chart]:
    """Return the charts by their names, `roll` first.

    Pitch and height have charts where a calibration has given them, the histogram where more than one frame
    has an angle, and how the right view lies where more than one pair was measured.
    """
    known = [each for each in QUANTITIES if any(getattr(row, each.column) is not None for row in rows)]
    charts = [chart_over_frames(rows, each, rig) for each in dict.fromkeys([ROLL, *known])]
    if sum(row.roll_deg is not None for row in rows) > 1:
        charts.append(histogram(rows))
    if sum(row.right_lower_px is not None for row in rows) > 1:
        charts.append(alignment(rows, rig))
    return {chart.name: chart for chart in charts}


def alignment(rows: Sequence[Row], rig: RigAssessment) -> Chart:
    """Return how the right view lies over the frames: the shift of rows by each part at its largest, px.

    One unit for all parts tells at a glance which of them matters. Dots are pairs; lines are what the drive
    says, with its drifts and jumps.

    Parameters
    ----------
    rows : sequence of Row
    rig : RigAssessment

    Returns
    -------
    Chart
    """
    data: list[Trace] = []
    axis = frame_axis(rows, rig)
    for place, (quantity, (words, colour)) in enumerate(zip(ALIGNMENT, _PARTS, strict=True)):
        known = [
            (at, row, float(value), _shifts_of_units(row.height, row.width)[place])
            for at, row in zip(axis.places, rows, strict=True)
            if (value := getattr(row, quantity.column)) is not None and row.height and row.width
        ]
        x, y = [at for at, *_ in known], [round(value * each, 3) for _, _, value, each in known]
        said = [
            label(row, f"{value:+.3f}{quantity.unit}: {value * each:+.2f} px")
            for _, row, value, each in known
        ]
        dots = {"color": colour, "size": 5 if len(rows) <= _MANY else 2.5}
        data.append(_trace(words, "markers", x, y, customdata=said, hovertemplate=_SAID, marker=dots))
        if known:
            factor, line = float(np.median([each for *_, each in known])), {"color": colour, "width": 2}
            look = {"name": f"{words}, over the drive", "showlegend": False, "line": line}
            data += [
                {**trace, **look, "y": [each if each is None else factor * each for each in trace["y"]]}
                for trace in rig_traces(rig, quantity, (0.0, 0.0), axis)
                if trace["name"] == "mounting"
            ]
    end = 1.1 * max([0.5, *(abs(each) for trace in data for each in trace["y"] if each is not None)])
    layout = {
        "hovermode": "closest",
        "showlegend": True,
        "xaxis": axis.layout(),
        "yaxis": _axis("shift of rows, px", (-end, end), zeroline=True),
    }
    return Chart("alignment", f"How the right view lies over {counted(len(rows), 'frame')}, px", data, layout)


def _shifts_of_units(height: int, width: int) -> tuple[float, ...]:
    """Return by how many pixels a unit of each part of the alignment shifts rows where it does most."""
    return Misalignment.of_values((1.0,) * len(ALIGNMENT), height, width).shifts(height, width)


def chart_over_frames(rows: Sequence[Row], quantity: Quantity, rig: RigAssessment) -> Chart:
    """Return the value of each frame: a line, its interval as a band, suspect and failed frames marked.

    So are segments, drifts and jumps. A line neither bridges a suspect frame nor leads to another drive.

    Parameters
    ----------
    rows : sequence of Row
    quantity : Quantity
    rig : RigAssessment

    Returns
    -------
    Chart
        Its name is the quantity's.
    """
    axis, ends, starts = frame_axis(rows, rig), view(rows, quantity), drive_starts(rig)
    values, halves = ([getattr(row, each) for row in rows] for each in (quantity.column, quantity.ci_column))
    sure, suspect = (
        [at for at, row in enumerate(rows) if row.status == status and values[at] is not None]
        for status in ("ok", "suspect")
    )
    failed = [at for at, row in enumerate(rows) if row.status == "error"]
    many = len(rows) > _MANY

    def marks(name: str, places: Sequence[int | None], mode: str = "markers", **look: Any) -> Trace:
        """Return the frames at some places among the rows; None parts a line."""
        x = [None if at is None else axis.places[at] for at in places]
        y = [None if at is None else values[at] for at in places]
        said = [
            None if at is None else label(rows[at], with_interval(values[at], halves[at], quantity))
            for at in places
        ]
        return _trace(name, mode, x, y, customdata=said, hovertemplate=_SAID, **look)

    bars: Trace = {"type": "data", "array": [halves[at] or 0.0 for at in suspect], "color": "@suspect"}
    bars |= {"thickness": 1, "width": 0}
    cross = {"color": "@error", "symbol": "x-thin", "line": {"color": "@error", "width": 2}}
    edge = {"y": [_FAILED_AT] * len(failed), "yaxis": "y2"}  # they have no value
    reasons = [label(rows[at], "") for at in failed]
    stretches = _stretches(sure, starts)
    edges = {"color": "@band", "width": 1}  # a frame alone is seen too
    band = _trace("95 % interval", "lines", [], [], **_BAND, fillcolor="@band", line=edges)
    for stretch in _stretches([at for at in sure if halves[at] is not None], starts):
        _add_band(band, *([each[at] for at in stretch] for each in (axis.places, values, halves)))
    line = {"line": {"color": "@c1", "width": 1.5}, "marker": {"color": "@c1"}}
    # a browser takes a second for 10,000 dots, which a line of so many frames would hide anyway
    alone = [stretch[0] for stretch in stretches if many and len(stretch) == 1]
    # what is sure lies on top: suspect marks of a long run would hide it; after it in the legend
    data = [
        band,
        marks("suspect", suspect, legendrank=1001, marker={"color": "@suspect", "symbol": "diamond"})
        | ({} if many else {"error_y": bars}),
        marks(
            quantity.name,
            [at for stretch in stretches for at in (*stretch, None)],
            "lines" if many else "lines+markers",
            **line,
        ),
        marks(f"{quantity.name}, alone", alone, showlegend=False, marker={"color": "@c1", "size": 2.5}),
        marks("failed", failed, legendrank=1002, marker=cross) | edge | {"customdata": reasons},
    ]
    data = [trace for trace in data if trace["x"]]  # plotly's legend stumbles over what is empty
    for trace in data:
        trace["marker"] = {"size": 5 if many else 8, **trace.get("marker", {})}
    data += rig_traces(rig, quantity, ends, axis)
    unit = _AXIS_UNITS[quantity.suffix]
    layout = {
        "hovermode": "closest",
        "hoverdistance": -1,
        "showlegend": True,
        "xaxis": axis.layout(),
        "yaxis": _axis(f"{quantity.name}, {unit}", ends, zeroline=quantity is ROLL),
        "yaxis2": {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True},
    }
    what = (
        f"{quantity.name.capitalize()} in {unit} over {counted(len(rows), 'frame')}; "
        f"{len(suspect)} suspect and {len(failed)} failed are marked"
    )
    return Chart(quantity.name, what, data, layout)


def _stretches(places: Sequence[int], starts: Set[int]) -> list[Sequence[int]]:
    """Return runs of places that follow each other, each within one drive."""
    ends = [
        at
        for at, (before, after) in enumerate(pairwise(places), 1)
        if after - before > 1 or after + 1 in starts
    ]
    return [places[start:end] for start, end in pairwise([0, *ends, len(places)]) if end > start]


def histogram(rows: Sequence[Row]) -> Chart:
    """Return how many frames have which roll, suspect ones on top of the others.

    Angles outside of `view` would squeeze the others into a bar: the axis says how many are left out.
    """
    low, high = view(rows)
    known = [row.roll_deg for row in rows if row.roll_deg is not None]
    shown = [roll for roll in known if low <= roll <= high]
    low, high = min(shown, default=low), max(shown, default=high)
    bins = min(_MOST_BINS, max(5, math.ceil(2 * math.sqrt(len(shown)))))  # fewer of fewer, higher than one
    step = round_step(max((high - low) / bins, _NARROWEST))
    # rounded as the angles are: 41 * 0.01 is more than 0.41, the bar of which it would leave out
    edges = np.round(np.arange(math.floor(low / step), math.floor(high / step) + 2) * step, 6)
    spans = [f"{degrees(start, 3)} to {degrees(end, 3)}" for start, end in pairwise(edges.tolist())]
    data = []
    for status, colour in (("ok", "@c1"), ("suspect", "@suspect")):
        rolls = [row.roll_deg for row in rows if row.roll_deg is not None and row.status == status]
        bars = {
            "type": "bar",
            "name": status,
            "x": edges[:-1].tolist(),
            "offset": 0,
            "y": np.histogram(rolls, edges)[0].tolist(),
            "width": step,
            "marker": {"color": colour, "line": {"color": "@card", "width": 1}},
            "customdata": spans,
            "hovertemplate": "%{customdata}<br>%{y} frames<extra></extra>",
        }
        data += [bars] if rolls else []
    counts = np.histogram(known, edges)[0]
    width, highest, left_out = float(np.ptp(edges)), int(counts.max()), len(known) - int(counts.sum())
    margin = max(0.02 * width, (_FEW_BINS * step - width) / 2)  # a single bar would fill the chart
    whole = {"dtick": 1} if highest <= _FEW_BINS else {}  # there are no half frames
    ends = float(edges[0]) - margin, float(edges[-1]) + margin
    title = "roll, degrees" + (f" ({left_out} suspect left out)" if left_out else "")
    layout = {
        "barmode": "stack",
        "showlegend": [trace["name"] for trace in data] != ["ok"],
        "xaxis": _axis(title, ends, zeroline=False),
        "yaxis": _axis("frames", (0, 1.05 * max(highest, 1)), **whole),
    }
    return Chart("histogram", "How many frames have which roll", data, layout)
