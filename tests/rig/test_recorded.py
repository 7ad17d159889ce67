"""What drives and calibrations of every kind say of a rig, to the digit; see `tests.recorded`."""

import math
from functools import partial
from pathlib import Path

import numpy as np

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.rig.calibration import Calibration, CalibrationOptions
from rollcli.rig.drive.assess import assess_rig, split_drives
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.drive.quantity import assess_sequence
from rollcli.rig.formats.fields import File, parse_yaml
from rollcli.rig.pose import horizon_row, taken_as_exact, with_pose
from rollcli.rig.quantities import ALIGNMENT, HEIGHT, PITCH, ROLL
from rollcli.rig.read_calibration import parse_calibration
from rollcli.rig.words import answer, counts, drift_in_words, findings, now_in_words, one_line
from tests.estimator.synthetic_maps import bent_road
from tests.recorded import made, recorded_test
from tests.rig import calibration_files as files
from tests.rig.drive.series import drive, joined

SERIES = {
    "brief": lambda: drive(1, 40),
    "brief and other": lambda: drive(4, 40, level=1.5, sd=0.1),
    "short": lambda: drive(2, 12),
    "sixteen with a jump": lambda: drive(0, 16, jump=3.0, at=8, sd=0.1, phi=0.0),
    "seven": lambda: drive(2, 7),
    "a drift": lambda: drive(3, 400, drift=1.5, sd=0.1),
    "a small jump": lambda: drive(5, 500, jump=0.35, phi=0.8, sd=0.1, at=140),
    "two jumps": lambda: (
        drive(7, 600, jump=0.9, sd=0.08)[0] + 0.7 * (np.arange(600) > 450),
        drive(7, 600, jump=0.9, sd=0.08)[1],
    ),
    "outliers": lambda: drive(8, 300, gross=0.1),
    "no errors": lambda: (drive(10, 150)[0], np.full(150, np.nan)),
    "all alike": lambda: (np.full(60, 1.25), np.full(60, 0.1)),
    "holes": lambda: (np.where(np.arange(200) % 3, drive(11, 200)[0], np.nan), drive(11, 200)[1]),
    "white": lambda: drive(12, 90, phi=0.0),
    "nothing": lambda: (np.full(20, np.nan), np.full(20, 0.1)),
}


def _sequence(name, unit=1.0):
    found = assess_sequence(*SERIES[name](), unit)
    shown = {key: getattr(found, key) for key in found.__dataclass_fields__ if key != "series"}
    middle = [found.frames // 3, 2 * found.frames // 3]
    return {**shown, "now": found.now, "means": found.means(middle)}


def _columns(name, folder="run/", stamps=None, **others):
    values, errors = SERIES[name]()
    count = len(values)
    status = np.where(np.isfinite(values), "ok", "error").astype(object)
    status[5::17] = np.where(np.isfinite(values[5::17]), "suspect", "error")
    names = [f"{folder}{place if stamps is None else stamps(place):06d}.png" for place in range(count)]
    return {
        "file": names,
        "status": status.tolist(),
        "roll_deg": values.tolist(),
        "roll_ci95_deg": (1.96 * errors).tolist(),
        "pitch_deg": (2 - values / 2).tolist(),
        "pitch_ci95_deg": (3 * errors).tolist(),
        "height_m": (1.6 + values / 50).tolist(),
        "height_ci95_m": (errors / 50).tolist(),
        **{key: (values * factor).tolist() for key, factor in others.items()},
    }


RIGS = {
    "one": lambda: _columns("brief", right_lower_px=0.2, right_twist_px=0.1),
    "drifting": lambda: _columns("a drift", stamps=lambda place: 1403636579763555584 + place * 50_000_000),
    "recorded": lambda: _columns(
        "a drift", "m.mcap#/left@", lambda place: 1403636579763555584 + place * 10**10
    ),
    "few": lambda: _columns("seven"),
    "two drives": lambda: joined(_columns("brief", "a/1/"), _columns("brief and other", "b/2/")),
    "many small": lambda: joined(
        *({key: each[k : k + 9] for key, each in _columns("white", f"{k}/").items()} for k in range(0, 90, 9))
    ),
    "nothing": lambda: _columns("nothing"),
    "alike": lambda: {key: each[:5] for key, each in _columns("all alike").items()},
    "failed": lambda: _columns("all alike") | {"status": ["error"] * 60},
    "on its side": lambda: _columns("brief") | {"roll_deg": [88.0] * 20 + [-89.0] * 20},
}
NO_VALUES = {"roll_deg": (500.0, -90.1), "roll_ci95_deg": (-1.0,), "pitch_deg": (90.5,), "height_m": (-1.5,)}
NO_ROWS = (
    {"roll_deg": [1.0]},
    {"status": ["ok"]},
    {"roll_deg": [1.0], "status": ["ok", "ok"]},
    {"roll_deg": ["far"], "status": ["ok"]},
    {"roll_deg": [1.0], "status": ["fine"]},
    *(
        {"status": ["ok"] * 3, "roll_deg": [1.0, -90.0, 90.0], name: [None, value, 0.5]}
        for name, values in NO_VALUES.items()
        for value in values
    ),
)
FOLDERS = {  # of frames, and how many are in each
    "a": {"a": 8},
    "few": {"a": 7},
    "two": {"a": 8, "b": 8},
    "few on average": {"a": 7, "b": 8},
    "uneven": {"a": 1, "b": 15},
    "deep": {"data/run1/x": 9, "data/run2": 9, "data/run1": 3, "other/run3": 4, ".": 2},
    "of a root": {"/data/run1/x": 9, "/data/run1/y": 9, "s3://data/run1": 9, "/data/run2.zip#": 9},
    "none": {},
}


def _split(groups):
    """Which frames are one drive, where those of the folders take turns."""
    found = {}
    for name, counts_of in FOLDERS.items():
        frames = sorted((place, folder) for folder, count in counts_of.items() for place in range(count))
        files = [f"{folder}/{place}.png".removeprefix("./").replace("#/", "#") for place, folder in frames]
        found[name] = made(split_drives, files, groups, [""] * len(files), np.full(len(files), np.nan))
    return found


def _rig(name, **options):
    rig = assess_rig(RIGS[name](), **options)
    last = rig.latest_drive()
    quantities = (ROLL, PITCH, HEIGHT, *ALIGNMENT)
    return {
        "counts": [rig.used, rig.suspect, rig.failed, rig.outliers, rig.count],
        "now": [rig.now(each) for each in quantities],
        "drift": [rig.drift_per_hour(last, each) for each in quantities],
        "words": [one_line(rig), counts(rig), *(now_in_words(rig, each) for each in quantities)],
        "drift in words": drift_in_words(rig, last) if last else None,
        "findings": [findings(rig), findings(rig, roll=False)],
        "drives": [
            [each.name, len(each.frames), each.change, each.differs, rig.name_of(each)] for each in rig.drives
        ],
        "jumps": [each.quantities["roll"].jumps for each in rig.drives],
    }


def _read(*texts, **given):
    named = [(f"calib{place}.txt", text.encode()) for place, text in enumerate(texts)]
    found = made(parse_calibration, named, CalibrationOptions(**given))
    assert "\n" not in str(found)
    return found


RIG = files.Rig(doffs=3.25)
GREY = files.written("kitti-benchmark", RIG)
FILES = {
    **{name: [files.written(name, RIG)] for name in (*files.WHOLE, "kalibr", "zed")},
    "ros": [files.ros(RIG, right=False), files.ros(RIG, right=True)],
    "ros alone": [files.ros(RIG, right=True)],
    "ros swapped": [files.ros(RIG, right=True), files.ros(RIG, right=False)],
    "ros positive": [files.ros(RIG, right=False), files.ros(RIG, right=True, positive=True)],
    "real kitti raw": [files.KITTI_RAW],
    "real middlebury": [files.MIDDLEBURY],
    "real opencv": [files.OPENCV],
    "real kitti object": [files.KITTI_OBJECT],
    "four cameras": [GREY + files.KITTI_OBJECT],
    "four cameras of one baseline": [GREY + GREY.replace("P0:", "P2:").replace("P1:", "P3:")],
    "real ros": [files.ROS_LEFT, files.ROS_RIGHT],
    "real ros alone": [files.ROS_LEFT],
    "real kalibr": [files.KALIBR],
    "nothing known": ["a: b\n"],
    "two of one": [files.KITTI_RAW, files.KITTI_RAW],
    "ros of two sizes": [files.ros(RIG, right=False), files.ros(RIG._replace(width=1280), right=True)],
    "no file": [],
}


CAMERA = {"focal": 500.0, "principal_point": (320.0, 200.0)}
PLAIN = files.Rig()
INPUTS = Path(__file__).with_name("inputs.txt").read_text("utf-8")


def _texts(kind):
    """The texts of a kind among the inputs."""
    lines = [line.partition(" ")[2] for line in INPUTS.split("\n") if line.startswith(f"{kind} ")]
    return [line.encode().decode("unicode_escape") for line in lines]


def _changed(line):
    """A sample in which other words stand in the place of some."""
    form, *changes = line.split("|")
    text = files.written(form, PLAIN)
    for old, _, new in (each.partition("=>") for each in changes):
        assert old in text
        text = text.replace(old, new)
    return text


ROS = files.ros(PLAIN, right=False)
CLOSE = files.written("opencv-yaml", PLAIN._replace(baseline=-0.5))
DAMAGED = (
    *_texts("calibration"),
    *map(_changed, _texts("changed")),
    *(text[:-60] for text in (files.KITTI_RAW, files.KALIBR)),
    files.MIDDLEBURY[:30],
    files.OPENCV[:-30],
    files.written("cityscapes", PLAIN)[:-5],
    files.KITTI_RAW.replace("-3.875744e+02", "9" * 5000),
    files.KITTI_RAW.splitlines()[1],
    files.written("zed", PLAIN).partition("Baseline")[0],
    *(files.ROS_RIGHT, files.ROS_LEFT, CLOSE, CLOSE.partition("Q:")[0]),
    *(ROS.replace("[707.0912", "[0.0"), ROS.replace("width: 1226", "width: 12.5")),
    "left:\n" + ROS.replace("\n", "\n  ").join(("  ", "")),
)
YAMLS = [*_texts("yaml"), "a: " + "[" * 9_000, "a: [" + "1," * 80_000 + "]"]

POSED = {
    "noisy": lambda: bent_road(4, width=240, height=160, noise=0.3, seed=2),
    "bent": lambda: bent_road(-9, width=240, height=160, bend=0.001, noise=0.1, seed=3),
    "ceiling": lambda: bent_road(4, width=240, height=160, noise=0.3, seed=2)[::-1],
}


def _posed(name, calibration):
    request = Request(road="all" if name == "ceiling" else "auto", doffs=calibration.doffs)
    found = made(lambda: with_pose(estimate_roll(POSED[name](), request), calibration))
    if isinstance(found, str):
        return found
    shown = ("status", "roll", "pitch", "height", "mess")
    return {
        **{key: value for key, value in found.to_dict().items() if key.startswith(shown)},
        "horizon": horizon_row(found.tangent, calibration),
        "exact": taken_as_exact(calibration.for_size(240, 160), found.pitch or 0.1, found.height_m),
    }


POSES = {
    "square": Calibration(200.0, 200.0, 119.5, 79.5, 0.5),
    "no baseline": Calibration(200.0, 200.0, 119.5, 79.5),
    "millimetres": Calibration(200.0, 200.0, 119.5, 79.5, 500.0),
    "not square": Calibration(190.0, 215.0, 100.0, 90.0, 0.2, doffs=2.0),
    "at the edge": Calibration(200.0, 205.0, 12.0, 8.0, 0.5),
    "at the other edge": Calibration(200.0, 205.0, 225.0, 150.0, 0.5),
    "of another size": Calibration(200.0, 200.0, 119.5, 79.5, 0.5, 0.0, 240, 150),
    "behind": Calibration(200.0, 200.0, 119.5, 79.5, 0.5, doffs=-500.0),
}
SIZES = ((640, 480), (320, 240), (1280, 960), (600, 480), (640, 479), (641, 481), (1280, 959), (321, 241))
SIZES = (*SIZES, (300, 480), (320, 480), (640, 200), (621, 400), (2484, 750))
SOUND = {"fx": 700.0, "fy": 705.0, "cx": 320.0, "cy": 200.0, "baseline": 0.5, "doffs": 12.0}
UNSOUND = {
    "fx": (0.0, math.nan, 1e308, 0.99, 1.0, 1e6),
    "fy": (-1.0, 1e-300, 1.01e6),
    "cx": (math.inf, -1e300, 0.0, 639.0, 640.0),
    "cy": (480.0, -1.0),
    "baseline": (-0.5, 0.0, 1e-300, 1e300, 1e-4, 1e4, 1.01e4),
    "doffs": (math.nan, 1e300, -1e6),
    "width": (0, -3),
}


def _sizes(calibration):
    """What images of every size have for a calibration, and what is said of it."""
    return [
        [made(calibration.for_size, *size), calibration.seems_of_another_size(*size), calibration.at_edge]
        for size in SIZES
    ]


CASES = {
    **{f"series: {name}": partial(_sequence, name) for name in SERIES},
    "series: of another unit": partial(_sequence, "a small jump", 0.01),
    **{f"rig: {name}": partial(_rig, name) for name in RIGS},
    "rig: with suspects": partial(_rig, "one", include_suspect=True),
    "rig: as one": partial(_rig, "two drives", groups="none"),
    "rig: by pattern": partial(_rig, "two drives", groups="*/1"),
    **{f"file: {name}": partial(_read, *texts) for name, texts in FILES.items()},
    "file: raw, and a camera": lambda: [_read(each, **CAMERA) for each in (files.KALIBR, *_texts("raw"))],
    "file: opencv, and a baseline": partial(_read, files.OPENCV, baseline=0.5),
    "file: no file, and a part": lambda: [
        _read(**given) for given in ({"focal": 500.0}, {"baseline": 0.5}, {"principal_point": (3.0, 4.0)})
    ],
    **{
        f"file: {name}, and numbers": partial(_read, *texts, baseline=0.3, doffs=2.0, **CAMERA)
        for name, texts in FILES.items()
        if name in ("zed", "kalibr", "middlebury", "no file")
    },
    **{
        f"pose: {name}, {key}": partial(_posed, name, calibration)
        for name in POSED
        for key, calibration in POSES.items()
    },
    "sizes": lambda: [
        _sizes(Calibration(**SOUND | {"cx": cx}, **size))
        for cx in (320.0, 575.5, 576.0)
        for size in ({}, {"width": 640}, {"height": 480}, {"width": 640, "height": 480})
    ],
    "unsound": lambda: [
        made(Calibration, **{**SOUND, "width": 640, "height": 480, name: value})
        for name, values in UNSOUND.items()
        for value in values
    ],
    "files: damaged": lambda: [_read(text) for text in DAMAGED],
    "files: YAML": lambda: [made(parse_yaml, File("f", text)) for text in YAMLS],
    "no rows": lambda: [made(assess_rig, rows) for rows in NO_ROWS],
    **{
        f"drives: {groups}": partial(_split, groups)
        for groups in ("auto", "none", "data/run*", "data/run*/", "a", "/data/run*", "s3://data/*")
    },
    "answers": lambda: [
        answer(Estimate(value, half), quantity, change=change)
        for value in (None, 0.0, -1.23456, 12.5)
        for half in (None, 0.0004, 0.0321, 0.96, 4.0, 100.0)
        for quantity in (ROLL, HEIGHT)
        for change in (False, True)
    ],
}

test_answers_are_those_recorded = recorded_test("rig", CASES, rel=1e-5, least=1e-6)
