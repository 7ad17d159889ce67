"""What drives and calibrations of every kind say of a rig, to the digit; see `tests.recorded`."""

from functools import partial

import numpy as np
import pytest

from rollcli.errors import RollcliError
from rollcli.estimator.estimate import estimate_roll
from rollcli.rig.calibration import Calibration, CalibrationOptions
from rollcli.rig.drive.assess import assess_rig
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.drive.quantity import assess_sequence
from rollcli.rig.pose import horizon_row, pose_jacobian, with_pose
from rollcli.rig.quantities import ALIGNMENT, HEIGHT, PITCH, ROLL
from rollcli.rig.read_calibration import parse_calibration
from rollcli.rig.words import answer, counts, findings, now_in_words, one_line
from tests.estimator.synthetic_maps import bent_road
from tests.recorded import check
from tests.rig import calibration_files as files
from tests.rig.drive.series import drive

SERIES = {
    "brief": lambda: drive(1, 40),
    "brief and other": lambda: drive(4, 40, level=1.5, sd=0.1),
    "short": lambda: drive(2, 12),
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
    "few": lambda: _columns("seven"),
    "two drives": lambda: _joined(_columns("brief", "a/1/"), _columns("brief and other", "b/2/")),
    "many small": lambda: _joined(
        *({key: each[k : k + 9] for key, each in _columns("white", f"{k}/").items()} for k in range(0, 90, 9))
    ),
    "nothing": lambda: _columns("nothing"),
}


def _joined(*parts):
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}


def _rig(name, **options):
    rig = assess_rig(RIGS[name](), **options)
    last = rig.latest_drive()
    quantities = (ROLL, PITCH, HEIGHT, *ALIGNMENT)
    return {
        "counts": [rig.used, rig.suspect, rig.failed, rig.outliers, rig.count],
        "now": [rig.now(each) for each in quantities],
        "drift": [rig.drift_per_hour(last, each) for each in quantities],
        "words": [one_line(rig), counts(rig), *(now_in_words(rig, each) for each in quantities)],
        "findings": [findings(rig), findings(rig, roll=False)],
        "drives": [
            [each.name, len(each.frames), each.change, each.differs, rig.name_of(each)] for each in rig.drives
        ],
        "jumps": [each.quantities["roll"].jumps for each in rig.drives],
    }


def _read(text, *more, **given):
    texts = [text, *more]
    try:
        found = parse_calibration(
            [(f"calib{place}.txt", each.encode()) for place, each in enumerate(texts)],
            CalibrationOptions(**given) if given else None,
        )
    except RollcliError as error:
        return str(error)
    return [found, str(found)]


RIG = files.Rig(doffs=3.25)
FILES = {
    **{name: [make(RIG)] for name, make in files.WHOLE.items()},
    "ros": [files.ros(RIG, right=False), files.ros(RIG, right=True)],
    "ros alone": [files.ros(RIG, right=True)],
    "ros swapped": [files.ros(RIG, right=True), files.ros(RIG, right=False)],
    "ros positive": [files.ros(RIG, right=False), files.ros(RIG, right=True, positive=True)],
    "kalibr": [files.kalibr(RIG)],
    "zed": [files.zed(RIG)],
    "kitti object": [files.KITTI_OBJECT],
    "real kitti raw": [files.KITTI_RAW],
    "real middlebury": [files.MIDDLEBURY],
    "real opencv": [files.OPENCV],
    "real ros": [files.ROS_LEFT, files.ROS_RIGHT],
    "real kalibr": [files.KALIBR],
    "nothing known": ["a: b\n"],
}


def _posed(name, calibration):
    given = {
        "noisy": lambda: bent_road(4, width=240, height=160, noise=0.3, seed=2),
        "bent": lambda: bent_road(-9, width=240, height=160, bend=0.001, noise=0.1, seed=3),
    }[name]()
    found = estimate_roll(given)
    try:
        found = with_pose(found, calibration)
    except RollcliError as error:
        return str(error)
    numbers = found.to_dict()
    return {
        **{
            key: numbers[key]
            for key in numbers
            if key.startswith(("status", "roll", "pitch", "height", "mess"))
        },
        "horizon": horizon_row(found.tangent, calibration),
        "jacobian": pose_jacobian(found.tangent, calibration).ravel(),
    }


def _calibration(**values):
    return Calibration(**{"fx": 200.0, "fy": 200.0, "cx": 119.5, "cy": 79.5, "baseline": 0.5, **values})


CASES = {
    **{f"series: {name}": partial(_sequence, name) for name in SERIES},
    "series: of another unit": partial(_sequence, "a small jump", 0.01),
    **{f"rig: {name}": partial(_rig, name) for name in RIGS},
    "rig: with suspects": partial(_rig, "one", include_suspect=True),
    "rig: as one": partial(_rig, "two drives", groups="none"),
    "rig: by pattern": partial(_rig, "two drives", groups="*/1"),
    **{f"file: {name}": partial(_read, *texts) for name, texts in FILES.items()},
    **{
        f"file: {name}, and numbers": partial(
            _read, *texts, baseline=0.3, focal=500.0, principal_point=(320.0, 200.0)
        )
        for name, texts in FILES.items()
        if name in ("zed", "kalibr", "middlebury")
    },
    **{
        f"pose: {name}, {key}": partial(_posed, name, calibration)
        for name in ("noisy", "bent")
        for key, calibration in {
            "square": Calibration(200.0, 200.0, 119.5, 79.5, 0.5),
            "no baseline": Calibration(200.0, 200.0, 119.5, 79.5),
            "not square": Calibration(190.0, 215.0, 100.0, 90.0, 0.2, doffs=2.0),
            "at the edge": Calibration(200.0, 205.0, 12.0, 8.0, 0.5),
        }.items()
    },
    "answers": lambda: [
        answer(Estimate(value, half), quantity, change=change)
        for value in (None, 0.0, -1.23456, 12.5)
        for half in (None, 0.0004, 0.0321, 0.96, 4.0, 100.0)
        for quantity in (ROLL, HEIGHT)
        for change in (False, True)
    ],
}


@pytest.mark.parametrize("case", CASES)
def test_answers_are_those_recorded(case):
    check("rig", case, CASES[case](), rel=1e-5, least=1e-6)
