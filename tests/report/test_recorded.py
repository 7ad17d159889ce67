"""What charts of hand-made results hold, how they are drawn, and what pages say; see `tests.recorded`."""

import html
import json
import math
import os
import re
import tempfile
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
import pytest

from rollcli import __version__
from rollcli.files.results import Result
from rollcli.pictures.figures import SLIDE, Size
from rollcli.report import pictures, sources
from rollcli.report.charts import all_charts, frame_axis, histogram, outside, view
from rollcli.report.options import ReportOptions
from rollcli.report.pictures import Picture, Pictures
from rollcli.report.sources import choose, subjects
from rollcli.report.summary import common_run, degrees, option_lines, with_interval
from rollcli.rig.drive.assess import assess_rig
from rollcli.rig.quantities import ALIGNMENT, HEIGHT, ROLL, SIZE
from tests.recorded import made, recorded_test
from tests.report.results import row
from tests.run.rigs import known, rig, sequence, short
from tests.run_cli import folder_of, road_map

INPUTS = json.loads(Path(__file__).with_name("inputs.json").read_text("utf-8"))
RUN, RUNS = INPUTS["run"], INPUTS["runs"]
_MANY = 40  # values of a list, of which some are recorded


def _posed(each, pitch, height, half=0.1):
    return replace(each, pitch_deg=pitch, pitch_ci95_deg=half, height_m=height, height_ci95_m=half / 10)


def _assessed(rows, *drives, **options):
    """Rows, and what is said of the rig that they are of; drives are the quantities of so many frames."""
    found = rig(*((f"{'ab'[place]}", each) for place, each in enumerate(drives)), **options)
    states = [np.array([each.status == status for each in rows]) for status in ("ok", "suspect")]
    numbers = {name: np.array([getattr(each, name) or np.nan for each in rows], float) for name in SIZE}
    frames = replace(found.frames, ok=states[0], suspect=states[1], numbers=numbers)
    return rows, replace(found, frames=frames)


def _one():
    return _assessed([row("a/0", 3.0, 0.1)], {"roll": sequence(1, known(3.0, 0.1))})


def _level():
    """A rig that lies level; of the first frame the pitch is known, of none the height."""
    rows = [row(f"a/{place}.png", 0.0, 0.0) for place in range(3)]
    rows[0] = replace(rows[0], pitch_deg=0.0)
    return _assessed(rows, {"roll": sequence(3, known(0.0, 0.0)), "pitch": sequence(3, short(0.0))})


def _failed():
    rows = [row("a/0", None), row("a/1", None, message="<b>no</b> pixel & no road " * 9)]
    return _assessed(rows, {"roll": sequence(2)})


def _mixed():
    """Frames of every kind, few enough that each has a tick."""
    rows = [
        row("maps/a.png", 1.0, 0.1),
        row("maps/b.png", 2.0, 0.2),
        row("other/c.png", 1.5, 0.9, "suspect", "the interval is wide; " * 15),
        row("other/d.png", None),
        row(f"{'e' * 40}.png", -1.0004123456, 0.0042),
        row("e\udcff.png", 0.5, None),
        row("folder/" * 9 + "<b>g</b>&amp;.png", 0.0, 0.3),
        row("off.png", -80.0, 20.0, "suspect", "one line"),
    ]
    return _assessed(rows, {"roll": sequence(8, short(0.625), outliers=1)})


def _drives():
    """Two drives: the first jumps twice, the second drifts, differs, and has pitch and height."""
    first = {
        "roll": sequence(
            12,
            *(known(each, 0.125) for each in (1.0, 1.5, 0.75)),
            jumps=[(4, known(0.5, 0.05)), (8, known(-0.75, 0.25))],
        )
    }
    roll = sequence(9, known(-2.0, 0.1), drift=known(-0.25, 0.03), drifts=True, outliers=2)
    ends = replace(roll.segments[0], begin=known(-1.75, 0.125), end=known(-2.25, 0.25))
    second = {
        "roll": replace(roll, segments=(ends,)),
        "pitch": sequence(9, known(3.0, 0.1), known(4.0, 0.1), jumps=[(5, known(1.0, 0.1))]),
        "height": sequence(9, known(1.65, 0.01)),
    }
    rows = [row(f"run/a/{place}", (1.0, 1.5, 0.75)[place // 4] + place / 64, 0.125) for place in range(12)]
    rows[2:5] = [row(f"run/a/{place}", 2.0, 0.5, "suspect", "wide") for place in range(2, 5)]
    for place in range(9):
        posed = _posed(row(f"run/b/{place}", -1.75 - place / 16, 0.25), 3.0 + (place > 4), 1.65 + place / 100)
        rows.append(replace(posed, status="suspect", message="steep") if place == 7 else posed)
    rows[14] = replace(rows[14], pitch_ci95_deg=None, height_ci95_m=None)
    rows[15] = row("run/b/3", None)
    return _assessed(rows, first, second, changes={"b": (known(-2.75, 0.1), True)})


def _long():
    """More frames than have dots, with some that stand alone."""
    rows = [row(f"{place // 60}/{place}.png", place % 7 / 8, 0.0625) for place in range(450)]
    for place in (20, 22, 24, *range(300, 324)):
        rows[place] = row(f"5/{place}.png", 1.5, 0.5, "suspect", "wide")
    rows[324] = row("5/324.png", None)
    return _assessed(rows, {"roll": sequence(450, known(0.375, 0.0625))})


def _pairs():
    """Pairs, one of them without a size, whose right view lies lower and then, after a jump, less so."""
    values = (1.5, -0.25, 0.125, 0.5)
    parts = {
        each.name: sequence(16, known(value, 0.05), known(value / 2, 0.0625), jumps=[(10, known(-0.75, 0.1))])
        for each, value in zip(ALIGNMENT, values, strict=True)
    }
    rows = []
    for place in range(16):
        now = [value / (1 + (place > 9)) + place % 3 / 32 for value in values]
        lies = dict(zip((each.column for each in ALIGNMENT), now, strict=True))
        rows.append(replace(row(f"a/{place}", 1.0 + place / 64), right_file=f"right/{place}", **lies))
    rows[3] = replace(rows[3], width=None, height=None)
    rows[4] = replace(rows[4], **dict.fromkeys(each.column for each in ALIGNMENT))
    return _assessed(rows, {"roll": sequence(16, known(1.125, 0.0625))} | parts)


RESULTS = {make.__name__[1:]: make for make in (_one, _level, _failed, _mixed, _drives, _long, _pairs)}


def _shortened(value):
    """Nested values, of long lists how long they are, their sum, and some of them."""
    if isinstance(value, dict):
        return {name: _shortened(each) for name, each in value.items()}
    if not isinstance(value, list | tuple):
        return value
    if len(value) <= _MANY:
        return [_shortened(each) for each in value]
    numbers = [each for each in value if isinstance(each, int | float)]
    some = value[:: len(value) // 9]
    return {"length": len(value), "numbers": len(numbers), "sum": float(sum(numbers)), "some": some}


def _charts(name):
    return {each: _shortened(asdict(chart)) for each, chart in all_charts(*RESULTS[name]()).items()}


NS = 10**9


def _axis(seconds, *, name="m.mcap#/left@{}", first=1_700_000_000 * NS, pause=None):
    """Where frames stand that have such stamps; those from `pause` on are another drive."""
    files = [each if isinstance(each, str) else name.format(first + round(each * NS)) for each in seconds]
    rows = [row(each) for each in files]
    counts = [len(rows)] if pause is None else [pause, len(rows) - pause]
    _, found = _assessed(rows, *({"roll": sequence(each)} for each in counts))
    axis = frame_axis(rows, replace(found, frames=replace(found.frames, files=files)))
    return [[*axis.places], axis.unit, axis.layout()]


AXES = {
    **{name: partial(_axis, **given) for name, given in INPUTS["axes"].items()},
    **{
        name: partial(_axis, range(count), name="{}.png")
        for name, count in (("ten", 10), ("eleven", 11), ("two hundred", 200))
    },
}


def _bars(rolls=(), suspect=()):
    rows = [row(f"{place}", each) for place, each in enumerate(rolls)]
    rows += [row("s", each, status="suspect") for each in suspect]
    chart = histogram(rows)
    assert sum(sum(each["y"]) for each in chart.data) == len(rows) - outside(rows)
    return [[(each["name"], each["x"], each["y"], each["width"]) for each in chart.data], chart.layout]


BARS = {
    **{name: partial(_bars, **given) for name, given in INPUTS["bars"].items()},
    **{
        name: partial(_bars, [place / 64 for place in range(count)])
        for name, count in (("many", 150), ("too many", 500))
    },
}


def drawn(chart, size=SLIDE):
    """What stands in a figure, as matplotlib has it before it lays the figure out."""
    figures = pytest.importorskip("rollcli.report.figures", reason="matplotlib is not here")
    with mock.patch.object(figures, "figure_file", lambda figure, kind, title: (figure, kind, title)):
        figure, kind, title = figures.chart_file(chart, "svg", size)
    (axes,) = figure.axes
    return _shortened(
        {
            "kind": [kind, title, *figure.get_size_inches()],
            "limits": [*axes.get_xlim(), *axes.get_ylim()],
            "names": [axes.get_xlabel(), axes.get_ylabel(), axes.get_xscale(), axes.get_yscale()],
            "ticks": [_ticks(axis) for axis in (axes.xaxis, axes.yaxis)],
            "sides": [side.get_visible() for side in axes.spines.values()],
            "lines": [
                [each.get_xydata().tolist(), *_pen(each), each.get_transform() == axes.transData]
                for each in axes.lines
            ],
            "areas": [
                [
                    each.get_xy() if hasattr(each, "get_width") else each.get_xy().tolist(),
                    [each.get_width(), each.get_height()] if hasattr(each, "get_width") else None,
                    _hex(each.get_facecolor()),
                    _hex(each.get_edgecolor()),
                    each.get_linewidth(),
                    each.get_zorder(),
                ]
                for each in axes.patches
            ],
            "bars of error": [
                [
                    [part.tolist() for part in each.get_segments()],
                    [_hex(part) for part in each.get_colors()],
                    each.get_linewidths().tolist(),
                    each.get_zorder(),
                ]
                for each in axes.collections
            ],
            "texts": [
                [each.get_text(), each.get_position(), each.get_va(), each.get_ha(), each.get_color()]
                for each in axes.texts
            ],
            "legend": [
                [
                    [each.get_text() for each in legend.texts],
                    legend._ncols,
                    [
                        _hex(each.get_facecolor()) if hasattr(each, "get_facecolor") else _pen(each)
                        for each in legend.legend_handles
                    ],
                ]
                for legend in figure.legends
            ],
        }
    )


def _hex(colour):
    return "#" + "".join(f"{round(255 * each):02x}" for each in colour[:3])


def _pen(line):
    getp = pytest.importorskip("matplotlib.artist").getp
    shape = ("marker", "markersize", "markerfacecolor", "markeredgewidth")
    return [getp(line, name) for name in ("color", "linestyle", "linewidth", *shape, "zorder")]


def _ticks(axis):
    low, high = sorted(axis.get_view_interval())
    places = [each for each in axis.get_majorticklocs() if low <= each <= high]
    return [places, axis.get_major_formatter().format_ticks(places), len(axis.get_minorticklocs())]


def _drawn_result(name, size=SLIDE):
    return {name: drawn(chart, size) for name, chart in all_charts(*RESULTS[name]()).items()}


def _thinned():
    """A line and a band of more points than any picture shows."""
    rows = [row(f"{place}.png", (place * 7919 % 2503) / 1024, 0.25) for place in range(2501)]
    return {each: drawn(chart) for each, chart in all_charts(rows, assess_rig(rows)).items()}


_LOOK = re.compile(r' ((?:fill|stroke|font|text|class|view|aria)[\w-]*="[^"#]*")')


def _still(chart):
    """The pictures of a page but for their shapes: how lines and letters look, and what is written."""
    figures = pytest.importorskip("rollcli.report.figures", reason="matplotlib is not here")
    still = figures.stills(chart)
    written = [html.unescape(each) for each in re.findall(r"<text[^>]*>(.*?)</text>", still)]
    return [sorted(set(_LOOK.findall(still))), written]


_SCRIPTS = re.compile(r"<(script|style)( |>).*?</\1>", re.DOTALL)
_ROWS = re.compile(r'id="rows">(.*?)</script>')
_STILL = re.compile(r'<svg class="still.*?</svg>', re.DOTALL)


NO_PICTURES = Pictures({}, "it is gone")


def _page(name, *, run=None, count=0, taken=NO_PICTURES, **options):
    """The lines of a page but for its styles, scripts and drawings."""
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    content = pytest.importorskip("rollcli.report.content", reason="jinja2, of the extra report, is not here")
    rows, found = RESULTS[name]()
    shown = [(each, taken) for each in choose(rows, count, [4, 8]).items()]
    given = ReportOptions(("no/rolls.csv", "s3://key@maps/b.csv?x=1"), "page.html", **options)
    page = content.report_page(Result(rows, run), given, shown, found, all_charts(rows, found)).decode()
    text = _STILL.sub("", _SCRIPTS.sub("", page)).replace(__version__, "VERSION")
    text = re.sub(r"&#39;sha256-[^&]+&#39;", "SUM", text)
    (table,) = _ROWS.findall(page)
    return {"lines": [each for each in map(str.strip, text.split("\n")) if each], "rows": _rows(table)}


def _rows(table):
    """The rows that a script shows, of many some."""
    found = json.loads(table)
    rows, places = found["rows"], found["places"]
    return [*rows[:_MANY], *rows[_MANY :: _MANY // 2], places]


KINDS = ("road", "map", "map_counts", "level", "level_counts", "heights")
WHOLE = {name: Picture(bytes([each]), 20 + each, 10) for each, name in enumerate(KINDS)}


def _without(*names):
    return {name: each for name, each in WHOLE.items() if name not in names}


PAGES = {
    "one": partial(_page, "one", count=3, taken=Pictures(WHOLE), title="Rig <7>"),
    "failed": partial(_page, "failed", count=3, run={"encoding": "px", "options": {}}),
    "mixed": partial(_page, "mixed", count=4, run=RUN, taken=Pictures(_without("map"), "no map")),
    "drives": partial(_page, "drives", count=9, taken=Pictures(_without("heights", "road"))),
    "long": partial(_page, "long", count=12),
    "pairs": partial(_page, "pairs", run=RUN, count=16),
    "pairs without a calibration": partial(_page, "pairs", run={"calibration": {"first": []}}),
}


def _chosen(count, jumps=(), rows=None):
    rows = rows or _long()[0]
    return [*choose(rows, count, jumps).items()]


def _subjects_of(rows, run=None, path="rolls.csv", images=None, fetch=False):
    return subjects([(0, each) for each in rows], [Result((), run, path)], images, fetch=fetch)


def _looked_for(rows, there="", images=None, result="rolls.csv", inside=".", **folders):
    """Which files are those of rows, where such files and objects are there."""
    objects = [(each, 9) for each in there.split() if "://" in each]
    pairs = [each.partition("|") for each in rows.split()]
    given = [replace(row(left), right_file=right) for left, _, right in pairs]
    with (
        mock.patch.object(sources, "objects_behind", lambda url, recursive: objects if recursive else []),
        folder_of(each for each in there.split() if "://" not in each),
    ):
        os.chdir(inside)
        options = {kind.replace("_", "-"): each or None for kind, each in folders.items()}
        found = made(_subjects_of, given, {"options": options}, result, images)
    if isinstance(found, str):
        return found
    paths = [[each.frame.path, each.frame.right_path.replace(os.sep, "/")] for each in found]
    return [[*two, one.images, one.refused] for two, one in zip(paths, found, strict=True)]


def _subjects():
    """What is taken of rows."""
    rows = [row("/run/a.png"), row("b.c.png", -3.0), row("x/../b.png", None), row("m.mp4#000002")]
    rows[0] = replace(rows[0], alpha2=None)
    run = {"options": {"derotated": "a/up"}}
    there = "up/run/a.png heights/a.tif vdisparity/a.png vdisparity/b.c.png disparity/a.npy road_mask/b.png"
    with folder_of(f"out/{each}" for each in f"{there} road_mask/m_000002.png".split()):
        return [
            [each.theta, each.row.alpha, each.refused, sorted(each.images.items())]
            for each in _subjects_of(rows, run, images="out/")
        ]


def _words():
    """How numbers are put into words, and which charts there are of rows."""
    posed = replace(row("a.png", None), pitch_deg=0.0, height_m=1.5)
    pairs = [replace(row(f"{name}.png", None), right_lower_px=0.1) for name in "ab"]
    results = ([row("a.png"), row("b.png")], [row("a.png"), row("b.png", None)], [row("b.png", None), posed])
    return [
        [with_interval(2.3456, half) for half in (None, 0.5, 0.012, 0.0042)],
        [degrees(angle) for angle in (1.234, -1.235, -0.001, 0.0)],
        [[*all_charts(each, assess_rig(each))] for each in (*results, pairs, pairs[:1])],
    ]


def _ends(quantity, *further):
    """The ends of the axis of values 0 and 10 and further ones; of heights a tenth of them."""
    unit = 0.1 if quantity is HEIGHT else 1.0
    rows = []
    for value, half, status in ((0.0, None, "ok"), (10.0, 0.0, "ok"), *further):
        now = {quantity.column: value * unit, quantity.ci_column: None if half is None else half * unit}
        rows.append(replace(row("a.png", None), status=status, **now))
    return view(rows, quantity)


def _views(quantity):
    suspect = [_ends(quantity, *((each, None, "suspect") for each in two)) for two in INPUTS["suspect"]]
    wide = [_ends(quantity, (9.5, half, "ok"), (0.5, half, "ok")) for half in (0.9, 7.0)]
    return [*suspect, *wide, _ends(quantity, (5.0, 9.0, "suspect")), view([row("a.png", None)], quantity)]


def _refused():
    rows = [(replace(row(one), right_file=other), result) for one, other, result in INPUTS["remote"]]
    return [
        [_subjects_of([each], path=result, fetch=fetch)[0].refused for fetch in (False, True)]
        for each, result in rows
    ]


ROAD = road_map(0.1)
ROAD[60:70, 60:100] += 4
KERB = np.maximum(0.4 * (np.mgrid[:120, :160][0] - 20), 0)
KERB[70:110, 20:140] += 3


def _taken(images=(), disparity=ROAD, roll=5.75, camera=None, alpha0=-8.0, **options):
    """The pictures of a map, coarsely: letters are left out, and their files lose a little."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a", "up", "mm"):
            np.save(f"{folder}/{name}.npy", disparity / (1 if name == "a" else 20))
        cv2.imwrite(f"{folder}/photo.png", np.random.default_rng(1).integers(0, 256, (60, 80, 3), np.uint8))
        given = replace(row(f"{folder}/a.npy", roll), alpha0=alpha0, alpha1=0.4, height_m=camera)
        given = replace(given, width=disparity.shape[1], height=disparity.shape[0])
        run = {"options": {"encoding": "px", "heights-range": [-0.3, 0.3]}}
        (subject,) = _subjects_of([given], run, f"{folder}/rolls.csv")
        subject = replace(subject, images={kind: f"{folder}/{name}" for kind, name in images}, **options)
        with mock.patch.object(cv2, "putText", lambda picture, *_: picture):
            found = pictures.take_pictures(subject)
    shown = {name: _seen(found.made[name]) if name in found.made else None for name in KINDS}
    return {**shown, "missing": found.missing.replace(folder, ""), "empty": not found.made}


def _seen(picture):
    """The size of a picture, and its colours in an eighth of its width and height."""
    values = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR)
    coarse = cv2.resize(values, (4, 4), interpolation=cv2.INTER_AREA).astype(float)
    return {"size": [picture.width, picture.height, *values.shape], "colours": coarse.ravel().tolist()}


PHOTO = "photo.png"
WRITTEN = [("derotated", "up.npy"), ("heights", "mm.npy"), ("road_mask", PHOTO), ("vdisparity", PHOTO)]
TAKEN = {
    "of a map": _taken,
    "of a map and a height": partial(_taken, camera=2.0),
    "of images": partial(_taken, WRITTEN, refused="no map"),
    "of a preview": partial(_taken, [("heights_preview", "photo.png")], refused="no map"),
    "of nothing": partial(_taken, refused="it is far away"),
    "of a map among images": partial(_taken, [("disparity", "a.npy")], camera=1.5, refused="no map"),
    "of no parabola": partial(_taken, alpha0=None),
    "of another size": partial(_taken, row=replace(row("a.png"), width=80)),
    "turned back": partial(_taken, roll=math.degrees(-0.5)),
    "of a kerb": partial(_taken, disparity=KERB, roll=0.0),
    "of a kerb and a height": partial(_taken, disparity=KERB, roll=0.0, camera=2.0),
    "of a large map": partial(_taken, disparity=road_map(0.02, width=1280, height=400)),
    "of a larger map": partial(_taken, disparity=road_map(0.02, width=1600, height=400)),
}
CASES = {
    **{f"charts: {name}": partial(_charts, name) for name in RESULTS},
    **{f"axis: {name}": make for name, make in AXES.items()},
    **{f"bars: {name}": make for name, make in BARS.items()},
    **{f"drawn: {name}": partial(_drawn_result, name) for name in RESULTS},
    "drawn: small": partial(_drawn_result, "mixed", Size(240.0, 160.0, 26.0)),
    "drawn: thinned": _thinned,
    "still": lambda: {name: _still(chart) for name, chart in all_charts(*_mixed()).items()},
    **{f"page: {name}": make for name, make in PAGES.items()},
    "chosen": lambda: [
        _chosen(count, jumps) for count in (0, 1, 3, 8, 12) for jumps in ((), (20, 60), range(30, 450, 60))
    ],
    "chosen around gaps": lambda: [
        _chosen(count, jumps, [row(f"{i}.png", None if i in (49, 51) else 1.0) for i in range(100)])
        for count, jumps in ((12, [10, 50]), (12, [0, 99]), (4, range(10, 90, 10)), (3, [50]))
    ],
    "chosen of few": lambda: [_chosen(count, (2, 5), _mixed()[0]) for count in (2, 4, 6, 12)],
    "chosen without intervals": lambda: _chosen(4, rows=[row(f"{i}.png", 1.0, None) for i in range(9)]),
    "subjects": _subjects,
    **{f"looked for {name}": partial(_looked_for, **given) for name, given in INPUTS["looked for"].items()},
    "words": _words,
    **{f"views: {each.column}": partial(_views, each) for each in (ROLL, HEIGHT)},
    "refused": _refused,
    **{f"taken {name}": make for name, make in TAKEN.items()},
    "runs": lambda: [
        *(common_run(each) for each in (RUNS, RUNS[:2], RUNS[1:], RUNS[:1], [None], [RUNS[0], None])),
        option_lines(RUN),
        option_lines(None),
    ],
}


def _least(case):
    return 3.0 if case.startswith("taken") else 1e-6


test_answers_are_those_recorded = recorded_test("report", CASES, least=_least)
