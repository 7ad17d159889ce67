"""What matching finds in pairs of every kind; see `tests.recorded`."""

import json
import math
import tempfile
from functools import cache, partial
from pathlib import Path

import cv2
import numpy as np

from rollcli.errors import RollcliError
from rollcli.estimator.road.find import road_plane
from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from rollcli.stereo.alignment import level, seen_from_right
from rollcli.stereo.match import StereoOptions, compute_disparity, match_pair
from rollcli.stereo.misalignment import Misalignment, advice_of
from rollcli.stereo.row_fit import ColumnEvidence, column_support
from rollcli.stereo.views import prepare_views
from tests.odd_views import pair_at, seen_by
from tests.recorded import made, recorded_test

SIZE = (224, 160)


@cache
def _scene(scene="street", seed=3, size=SIZE, focal=150.0):
    frame = render_frame(FrameSpec(scene, math.radians(4), 0.06, size=size, focal=focal, seed=seed))
    return frame.left, frame.right


def _texture(disparity=14.0, slope=0.0):
    """Random dots whose disparity grows by `slope` px from row to row."""
    return pair_at(disparity + slope * np.arange(120), (120, 240), seed=5, first=100)


def _match(views, odd=None, road=None, *, whole=False, **options):
    left, right = views()
    try:
        found = match_pair(left, seen_by(right, **(odd or {})), StereoOptions(**options), road)
    except RollcliError as error:
        return str(error)
    disparity, measured = found.disparity[found.disparity > 0], found.measured
    shape = found.disparity.shape
    return {
        "range": [found.min_disparity, found.num_disparities],
        "shape": shape,
        "valid": len(disparity) / found.disparity.size,
        "quartiles": np.percentile(disparity, (25, 50, 75)).tolist(),
        "mean": float(disparity.mean()),
        "valid in rows": [float((rows > 0).mean()) for rows in np.array_split(found.disparity, 8)],
        "whole": None if not whole else float((found.whole > 0).mean()),
        # px: how far each part moves a corner
        "corrected": found.corrected.shifts(*shape),
        "lies": found.lies and found.lies.shifts(*shape),
        "measured": measured
        and [measured.misalignment.shifts(*shape), measured.errors.shifts(*shape), measured.spread],
        "share": measured and measured.share,
        "slope_error_px": found.slope_error * shape[1],
        "doubt": found.doubt,
        "end": found.end_fraction,
    }


def _corrected(odd, columns=None, **options):
    """A pair that is levelled as a file says: 3 px lower, at twice the size."""
    lies = {
        "right_lower_px": 6.0,
        "right_clockwise_deg": 0.0,
        "right_larger_percent": 0.5,
        "right_twist_px": 0.4,
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "correction.json")
        path.write_text(json.dumps({**lies, "width": 448, "height": 320, "columns": columns}), "utf-8")
        return _match(_scene, odd, align=str(path), **options)


def _drive():
    """What pairs of one rig say together of its columns, px in the corners."""
    views = _scene(), _scene(seed=4), _scene("open", 10)
    found = [match_pair(left, seen_by(right, **ODD), StereoOptions()).measured for left, right in views]
    told = column_support(ColumnEvidence.of_drive([each.evidence for each in found]))
    parts = Misalignment(scale=told.scale, twist=told.twist, curve=told.pitch)
    return {"columns": parts.shifts(*SIZE[::-1]), "slope_error_px": told.error * SIZE[0]}


FULL, HIGH = partial(_scene, size=(448, 320), focal=300.0), partial(_scene, size=(192, 304), focal=160.0)
ODD = {"clockwise_deg": 0.6, "larger_percent": 0.8, "lower": -3.0}
LIES = Misalignment(1.5, 0.01, -0.004, 2e-5, 0.02, 1e-5)
# a third of the size, with a gap and a box that hides a part of the rest
_NEAR = np.tile(np.arange(54, dtype=np.float32)[:, None] / 4, (1, 75))
_NEAR[20:30, 40:50], _NEAR[40:44] = 12, 0


def _levelled(near):
    return level(cv2.cvtColor(_scene()[1], cv2.COLOR_BGR2GRAY), LIES, near).astype(float)


# at the limits of each option, beyond them, and what makes no sense
OPTIONS = {
    "num_disparities": (0, 1, 2000, 2001, 64.5),
    "min_disparity": (-2001, -2000, 2000, 2001, None),
    "block_size": (-1, 1, 4, 21, 23),
    "uniqueness": (-1, 0, 99, 100),
    "speckle_size": (-1, 0, 1_000_000, 1_000_001, 10.0),
    "speckle_range": (-1, 0, 1000, 1001),
    "downscale": (0, 1, 64, 65, math.nan),
    "vertical_offset": (-101, -100, 100, 100.5, math.nan),
    "mode": ("bm",),
    "align": ("on",),
}


GREY = np.ones((4, 5), np.uint8)
NO_VIEWS = (
    *((np.ones(shape, kind),) * 2 for shape, kind in (((4, 5), "i2"), ((4, 5), "f4"), ((4, 5, 3), "i4"))),
    *((np.ones((4, 5, count), np.uint8),) * 2 for count in (1, 2, 4)),
    *((GREY, np.ones(shape, np.uint8)) for shape in ((4, 6, 3), (3, 5, 3))),
    (np.zeros((0, 100), np.uint8),) * 2,
)


def _taken(name, value):
    """The option as it is taken, or why it is not."""
    found = made(StereoOptions, **{name: value})
    return found if isinstance(found, str) else getattr(found, name)


CASES = {
    "level": partial(_match, _scene),
    "verge": partial(_match, partial(_scene, "verge", 6)),
    "turned": partial(_match, _scene, {"clockwise_deg": 0.8}),
    "lower": partial(_match, _scene, {"lower": 2.5}),
    "larger": partial(_match, _scene, {"larger_percent": 0.7}),
    "odd": partial(_match, _scene, ODD),
    "far off": partial(_match, _scene, {"clockwise_deg": 2.5, "lower": 14.0}),
    "as it is": partial(_match, _scene, ODD, align="off"),
    "corrected": partial(_corrected, {"lower": 3.0, "larger_percent": 0.5}),
    "corrected, of known columns": partial(
        _corrected,
        {"lower": 3.0},
        {"scale": 0.004, "twist": 2e-5, "pitch": 1e-5, "slope_error": 1e-3},
        downscale=1.2,
        num_disparities=64,
    ),
    "corrected otherwise": partial(_corrected, {"lower": -3.0}),
    "given": partial(_match, _scene, {"lower": 2.0}, vertical_offset=2.0),
    "along the road": partial(_match, _scene, None, road_plane),
    "along a road of full size": partial(_match, FULL, None, road_plane),
    "along a road in a high view": partial(_match, HIGH, ODD, road_plane),
    "a high view, whole": partial(_match, HIGH, ODD, road_plane, whole=True),
    "full size, whole": partial(_match, FULL, ODD, road_plane, whole=True),
    "whole": partial(_match, _scene, None, road_plane, whole=True),
    "smaller": partial(_match, _scene, None, downscale=1.5),
    "five ways": partial(_match, _scene, None, mode="sgbm", num_disparities=48, block_size=7),
    "eight ways": partial(_match, _scene, None, mode="hh", speckle_size=0, uniqueness=2),
    "from four on": partial(_match, _scene, None, min_disparity=4, num_disparities=48),
    "texture": partial(_match, _texture),
    "texture of a slope": partial(_match, partial(_texture, 4.0, 0.3), {"lower": 1.0}),
    "a drive": _drive,
    "swapped": partial(_match, lambda: _scene()[::-1]),
    "two scenes": partial(_match, lambda: (_scene()[0], _scene("open", 9)[1])),
    "one image": partial(_match, lambda: (_scene()[0],) * 2),
    "levelled": lambda: [_levelled(None), _levelled(seen_from_right(_NEAR))],
    "seen from the right": lambda: seen_from_right(_NEAR),
    "options": lambda: {name: [_taken(name, each) for each in given] for name, given in OPTIONS.items()},
    "no views": lambda: [made(prepare_views, *each) for each in NO_VIEWS],
    "narrow and wide views": lambda: [
        made(compute_disparity, *(np.zeros(shape, np.uint8),) * 2)
        for shape in ((1, 1), (2, 3), (5, 20), (300, 10), (60, 16384))
    ],
    # each part alone, of either sign, and all of them
    "advice": lambda: [
        advice_of(*each)
        for each in (
            *np.diag([0.4, 0.2, 0.4, 1.0]),
            *np.diag([-0.4, -0.2, -0.4, -1.0]),
            (0.6, -0.2, 0.3, 1.5),
        )
    ],
    "lies": lambda: [
        LIES.resized(0.5),
        LIES.times(2.0),
        LIES.shifts(100, 300),
        math.degrees(LIES.rotation),
        LIES.matrix(100, 300, LIES.scale, (0.0, 0.0)),
        Misalignment.of_values((1.5, -0.5, 0.4, 2.0), 100, 300),
    ],
}

# px: as much as OpenCV 4.7 and 5.0 differ by
test_answers_are_those_recorded = recorded_test("stereo", CASES, rel=1e-4, least=1e-3)
