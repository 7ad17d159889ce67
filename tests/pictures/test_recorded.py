"""What maps, heights, v-disparities and pictures of every kind come to; see `tests.recorded`.

Letters look otherwise in each version of OpenCV: pictures are drawn without them, and what is written where
is recorded beside the mean of each row and column.
"""

import math
from functools import partial
from unittest import mock

import cv2
import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.road.model import RoadModel
from rollcli.files.results import Row
from rollcli.pictures.colours import style_sheet
from rollcli.pictures.derotate import derotate, rotation_matrix
from rollcli.pictures.heights import FittedRoad, heights_over, steadied, unit_of
from rollcli.pictures.overlay import draw_disparity, draw_heights, draw_preview, draw_road, round_step
from rollcli.pictures.vdisparity import (
    MiddleColumn,
    VDisparity,
    draw_v_disparity,
    shown_counts,
    shown_end,
    v_disparity,
)
from rollcli.rig.calibration import Calibration
from tests.recorded import made, recorded_test

SQUARE = Calibration(400, 400, 159.5, 70, 0.5)
RIGS = {
    "unknown": None,
    "no baseline": Calibration(400, 400, 159.5, 70),
    "square": SQUARE,
    "not square": Calibration(380, 420, 150, 75, 0.3, doffs=4.0),
    "of twice the size": Calibration(820, 780, 310, 150, 0.5, doffs=-6.0, width=640, height=400),
}
ROADS = {
    "flat": (0.1, (-40.0, 0.45, 0.0), 0.0),
    "rising": (-0.2, (-30.0, 0.35, 4e-4), 0.0),
    "flattening": (0.05, (-60.0, 0.8, -1.2e-3), 0.0),
    "nearly level at its foot": (0.05, (-40.0, 0.8, -1.7e-3), 0.0),
    "crowned": (0.1, (-40.0, 0.45, 2e-4), 0.05),
    "dished": (-0.3, (-20.0, 0.4, 0.0), -0.08),
    "strongly crowned": (0.02, (-40.0, 0.5, 0.0), 0.6),
    "falling": (0.1, (40.0, -0.2, 0.0), 0.0),
    "below the horizon": (0.0, (-90.0, 0.4, 0.0), 0.0),
    "level": (0.0, (10.0, 0.0, 0.0), 0.0),
    "rising from nothing": (0.0, (-99.5, 0.5, 0.0), 0.0),
    "over its vertex": (0.0, (-2.0, -0.1, 2e-3), 0.0),
}


def _map(shape=(90, 120), kind="f8", slope=0.3, seed=0, holes=0.2):
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[: shape[0], : shape[1]]
    found = 4 + slope * v + 0.05 * u + rng.normal(0, 0.3, shape)
    return np.where(rng.random(shape) < holes, 0, np.maximum(found, 0.5)).astype(kind)


def _turned(roll_deg, kind="f8", shape=(90, 120), **options):
    return derotate(_map(shape, kind), roll_deg=roll_deg, **options)


def _seen(road, *, box=1.2, noise=0.05, hill=0.0, shape=(200, 320)):
    """A map of a road, with noise, holes, and a box whose disparities are larger by a factor."""
    theta, (a0, a1, a2), _ = road
    rng = np.random.default_rng(5)
    v, u = np.mgrid[: shape[0], : shape[1]]
    y = v * math.cos(theta) - u * math.sin(theta)
    found = a0 + a1 * y + a2 * y**2
    found = np.where(found > 1, found + hill * np.sin(found / 6) + rng.normal(0, noise, shape), 0)
    found[120:150, 140:190] *= box
    found[rng.random(shape) < 0.1] = np.nan
    return np.maximum(found, 0)


def _heights(name, **options):
    disparity = _seen(ROADS[name], **options)
    road = FittedRoad(RoadModel(*ROADS[name]), *disparity.shape[::-1])
    return {each: heights_over(disparity, road, rig) for each, rig in RIGS.items()}


def _roads():
    """The roads of an estimate and of rows of a result."""
    v, u = np.mgrid[:120, :160]
    estimate = estimate_roll(np.maximum(0.3 * (v - 20) - 0.03 * u + 5, 0))
    full = {"roll_deg": 4.0, "pitch_deg": 2.0, "camber": 0.02, "width": 160, "height": 120}
    full |= {"alpha0": 1.0, "alpha1": 0.3, "alpha2": 1e-3}
    lacking = [
        {},
        {"image_roll_deg": 4.5},
        *({name: None} for name in ("pitch_deg", "camber", "roll_deg", "width", "height", "alpha1")),
    ]
    rows = [Row("a.png", status="ok", **full | each) for each in lacking]
    some = [FittedRoad.of_row(row, rig) for row in rows for rig in (None, RIGS["not square"])]
    return [FittedRoad.of_estimate(estimate), *some]


def _counted(given, **options):
    found = v_disparity(given, **options)
    shown = shown_counts(found, 50, shown_end(found))
    return {"counts": found.counts, "end": found.max_disparity, "shown": shown}


def _histogram(height=120, bins=96, top=96.0, beyond=0):
    counts = np.zeros((height, bins), np.int32)
    at = np.linspace(0.2 * bins, 0.8 * bins - 1, height).astype(int)
    counts[np.arange(height), at] = np.arange(height) + 1
    counts[0, -1] = beyond
    return VDisparity(counts, top)


def _picture(make, *arguments, **options):
    """The means of the rows and columns of a picture, and what is written where in it."""
    written = []

    def size_of(text, font, scale, thickness):
        return (round(20 * scale * len(text)), 0), 0

    def write(picture, *all_of_it):
        written.append(all_of_it)
        return picture

    with mock.patch.object(cv2, "getTextSize", size_of), mock.patch.object(cv2, "putText", write):
        picture = make(*arguments, **options)
    light = picture @ np.array([0.2, 0.3, 0.5])
    means = {name: light.mean(axis=axis).round(3) for axis, name in enumerate(("columns", "rows"))}
    return {"shape": picture.shape, "written": written, **means}


def _photo(shape=(75, 130, 3), kind=np.uint16, seed=1):
    return np.random.default_rng(seed).integers(0, np.iinfo(kind).max + 1, shape, kind)


def _height_picture(span, unit, photo=None):
    heights = np.linspace(-0.4, 0.5, 150 * 60, dtype=np.float32).reshape(150, 60)
    heights[20:60, 10:20] = np.nan
    return _picture(draw_heights, heights, span, unit, photo)


def _disc(shape=(60, 80), hole=True):
    v, u = np.mgrid[: shape[0], : shape[1]]
    away = np.hypot(v - 30, u - 40)
    return (away < 22) & (away > 8 if hole else True)


def _figure(disparity, theta, alpha, **options):
    """What stands in the figure of a frame, as matplotlib has it before it lays the figure out."""
    module = pytest.importorskip("rollcli.pictures.figures", reason="matplotlib is not here")
    with mock.patch.object(module, "figure_file", lambda figure, kind, title: (figure, kind, title)):
        figure, kind, title = module.v_disparity_figure(disparity, theta, alpha, "svg", **options)
    return {"kind": kind, "title": title, "inches": figure.get_size_inches(), "axes": _axes_of(figure)}


def _axes_of(figure):
    return [
        {
            "names": [axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()],
            "limits": [*axes.get_xlim(), *axes.get_ylim()],
            "share": axes.get_box_aspect(),
            "grid": [line.get_visible() for line in axes.get_xgridlines() + axes.get_ygridlines()],
            "named": [label.get_visible() for label in axes.get_xticklabels()],
            "ticks": [axes.get_xticks(), axes.get_yticks()],
            "letters": [axes.title.get_fontsize(), axes.xaxis.label.get_fontsize()],
            "images": [
                [
                    image.get_extent(),
                    image.get_cmap().name,
                    image.get_clim(),
                    np.ma.filled(image.get_array(), -1),
                ]
                for image in axes.get_images()
            ],
            "lines": [
                [line.get_xydata(), line.get_color(), line.get_linestyle(), line.get_linewidth()]
                for line in axes.get_lines()
            ],
        }
        for axes in figure.axes
    ]


def _style(*size, salt=""):
    """What is drawn otherwise than matplotlib does by itself."""
    figures = pytest.importorskip("rollcli.pictures.figures", reason="matplotlib is not here")
    with figures.drawing_style(figures.Size(*size), salt):
        usual, settings = figures.mpl.rcParamsDefault, dict(figures.mpl.rcParams)
    return {name: value for name, value in settings.items() if value != usual[name] and name != "backend"}


def _files():
    """Sizes of PNGs, and what vector files hold beside the drawing."""
    figures = pytest.importorskip("rollcli.pictures.figures", reason="matplotlib is not here")
    found = {}
    for size in (figures.SLIDE, figures.PRINT, (505.0, 72.0, 7.0), (503.0, 72.0, 7.0)):
        figure = figures.Figure((size[0] / 72, size[1] / 72))
        picture = cv2.imdecode(np.frombuffer(figures.figure_file(figure, "png", "What"), np.uint8), -1)
        found[str(size[0])] = [picture.shape, picture[5, 5]]
    return found


WHOLE = np.add.outer(np.arange(40), np.arange(30) % 7) + 1.0
CURVE = (30.0, 0.3, 5e-4)

CASES = {
    **{f"turned by {deg:g}": partial(_turned, deg) for deg in (-170, -38, -3, 0, 2, 11.5, 77, 123)},
    **{f"turned {kind}": partial(_turned, -8, kind) for kind in ("u1", "u2", "i2", "i4", "f2", "f4")},
    "turned and enlarged": partial(_turned, 17, "f4", expand=True),
    "turned upright and enlarged": partial(_turned, 70, "u2", expand=True),
    "turned without some": partial(_turned, 4, "u1", invalid=[7.0, 21.0, 1e9]),
    "turned halves without some": partial(_turned, 4, "f2", invalid=[7.0, 1e30, -3.4e38]),
    "turned in blocks": partial(_turned, 6, "f4", (420, 500)),
    "matrices": lambda: [
        rotation_matrix(shape, roll, expand=expand)
        for shape in ((40, 60), (31, 20))
        for roll in (-0.3, 0.0, 1.2)
        for expand in (False, True)
    ],
    "refused": lambda: [
        *(
            made(derotate, np.ones((2, 2)), *angles)
            for angles in ((), (3.14,), (3.15,), (-3.2,), (math.nan,))
        ),
        *(made(derotate, np.ones((2, 2)), roll_deg=angle) for angle in (180, -181)),
        *(
            made(derotate, np.ones(shape, kind), 0.1)
            for shape, kind in ((4, "f8"), ((2, 2, 2), "f8"), ((2, 2), "c8"))
        ),
        *(made(v_disparity, np.ones(shape)) for shape in ((4,), (2, 2, 2))),
        *(
            made(v_disparity, np.ones((2, 2)), bins=bins, max_disparity=end)
            for bins, end in ((0, 1.0), (-1, None), (1, 0.0), (None, -1.0), (3, math.inf))
        ),
    ],
    "counts": partial(_counted, _map()),
    "counts of whole pixels": partial(_counted, WHOLE),
    "counts in few bins": partial(_counted, _map(), bins=9),
    "counts to an end": partial(_counted, _map(), max_disparity=25.0),
    "counts in many bins": partial(_counted, 40 * _map((20, 30))),
    "counts of nothing": partial(_counted, np.zeros((5, 4))),
    "along the middle": lambda: [
        [column.profile(CURVE), column.row(33.0), MiddleColumn.of_level(theta, width, 41).start]
        for theta in (-0.4, 0.0, 0.3)
        for width in (1, 30, 31)
        for column in [MiddleColumn.of_map(theta, width)]
    ],
    **{f"heights: {name}": partial(_heights, name) for name in ROADS},
    "heights: hill": partial(_heights, "flat", hill=1.5),
    "heights: much noise": partial(_heights, "rising", noise=1.5, box=0.8),
    "heights: few pixels": partial(_heights, "crowned", shape=(160, 256)),
    "steadied": lambda: steadied(_map(kind="f4", holes=0.01)),
    "roads": _roads,
    "round steps": lambda: [
        round_step(least) for least in (0.013, 0.2, 0.21, 0.5, 0.51, 1.0, 1.99, 6, 10, 4e3)
    ],
    "units": lambda: [unit_of(rig) for rig in RIGS.values()],
    "colours": style_sheet,
    "picture of heights": partial(_height_picture, (-0.3, 0.3), "metres"),
    "picture of heights, uneven": partial(_height_picture, (-0.05, 0.4), "camera heights"),
    "picture of heights, ends near labels": partial(_height_picture, (-0.24, 0.24), "metres"),
    "picture of heights above": partial(_height_picture, (0.1, 0.45), "metres"),
    "picture of heights on a photo": lambda: _height_picture((-0.2, 0.3), "metres", _photo()),
    "picture of heights on grey": lambda: _height_picture(
        (-0.2, 0.3), "metres", _photo((150, 60), np.uint8) // 4
    ),
    "disparities": lambda: _picture(draw_disparity, _map()),
    "disparities, empty": lambda: _picture(draw_disparity, np.zeros((9, 12))),
    **{
        f"preview of {height} rows to {top:g} px": partial(
            _picture, draw_preview, np.linspace(0, top, 40 * height).reshape(height, 40)
        )
        for height, top in ((40, 60.0), (50, 33.0), (51, 60.0), (120, 0.7), (260, 150.0), (960, 150.0))
    },
    "road": lambda: _picture(draw_road, _map((60, 80)), _disc()),
    "road on a photo": lambda: _picture(draw_road, _map((60, 80)), _disc(hole=False), _photo() >> 4),
    "road on a small photo": lambda: _picture(
        draw_road, _map((60, 80)), _disc(), _photo((60, 80, 3), np.uint8)
    ),
    **{
        f"v-disparity of {height} rows": partial(
            _picture, draw_v_disparity, _histogram(height), MiddleColumn(5.0, 1.0).profile(CURVE), horizon
        )
        for height, horizon in ((120, 31.0), (479, 2.0), (960, 400.4))
    },
    **{
        f"v-disparity, road at {disparity:g} px, horizon at {horizon:g}": partial(
            _picture, draw_v_disparity, _histogram(40), (disparity, 0, 0), horizon=horizon
        )
        for disparity, horizon in ((0.0, -5.0), (0.2, 39.0), (-0.2, 39.5), (95.8, 0.0), (96.0, 1e9))
    },
    "v-disparity alone": lambda: _picture(draw_v_disparity, _histogram(beyond=12)),
    "v-disparity with one count beyond all": lambda: _picture(
        draw_v_disparity, _histogram(1200, beyond=10**6)
    ),
    "v-disparity with few beyond": lambda: _picture(draw_v_disparity, _histogram(beyond=15), horizon=119.0),
    "v-disparity in many bins": lambda: _picture(
        draw_v_disparity, _histogram(bins=800, top=200.0), (-40, 2, 0), horizon=-1.0
    ),
    "v-disparity of nothing": lambda: _picture(draw_v_disparity, v_disparity(np.zeros((50, 4)))),
    "figure": partial(_figure, _map(), math.radians(6), (4.0, 0.3, 1e-4)),
    "figure without a road": partial(_figure, _map((40, 90)), -0.1, None, bins=30, max_disparity=32.0),
    "figure of nothing": partial(_figure, np.zeros((20, 30)), 0.0, CURVE),
    "style": lambda: [_style(300.0, 200.0, 9.0), _style(300.0, 200.0, 13.0, salt="salt")],
    "figure files": _files,
}


def _least(case):
    return 5e-3 if case.startswith(("picture", "disp", "preview", "road ", "v-disp")) else 2e-5


test_answers_are_those_recorded = recorded_test("pictures", CASES, rel=2e-4, least=_least)
