"""What is said of drives, poses and calibrations is on record; see `tests.recorded`."""

import dataclasses

import numpy as np
import pytest

import rollcli
from rollcli.errors import RollcliError
from rollcli.estimator.estimate import estimate_roll
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import horizon_row, pose_of, with_pose
from rollcli.rig.read_calibration import parse_calibration
from rollcli.rig.words import counts, findings, now_in_words, one_line
from tests.estimator.synthetic_maps import flat_road
from tests.recorded import unlike_record
from tests.rig import calibration_files
from tests.rig.drive.series import drive

DRIVES = {
    "steady": {"frames": 120},
    "jump": {"frames": 200, "jump": 0.8},
    "drift": {"frames": 300, "drift": 1.2, "sd": 0.08},
    "jump amid drift": {"frames": 300, "drift": 0.8, "jump": -0.9, "sd": 0.05},
    "outliers": {"frames": 300, "gross": 0.1},
    "white": {"frames": 60, "phi": 0.0, "errors": (0.1, 0.2)},
    "short": {"frames": 12, "sd": 0.02},
    "three": {"frames": 3},
}


def rows(seed, folder="run", **options):
    """Columns of a result: the roll of a drive, and with it pitch, height and how the right view lies."""
    rolls, errors = drive(seed, **options)
    frames = len(rolls)
    pitches, pitch_errors = drive(seed + 50, frames, level=2.0, sd=0.3)
    rng = np.random.default_rng(seed)
    return {
        "file": [
            f"{folder}/{1_600_000_000 + 3 * place}.{100 * place % 1000:03d}.png" for place in range(frames)
        ],
        "status": np.where(rng.random(frames) < 0.1, "suspect", "ok").tolist(),
        "roll_deg": rolls.tolist(),
        "roll_ci95_deg": (1.96 * errors).tolist(),
        "pitch_deg": pitches.tolist(),
        "pitch_ci95_deg": (1.96 * pitch_errors).tolist(),
        "height_m": (1.65 + 0.02 * pitches).tolist(),
        "height_ci95_m": (0.02 * pitch_errors).tolist(),
        "right_lower_px": rng.normal(0.1, 0.3, frames).tolist(),
    }


def assessed(given, **options):
    """All that is said of a result."""
    rig = rollcli.assess_rig(given, **options)
    return {
        "words": [one_line(rig), counts(rig), now_in_words(rig), *findings(rig)],
        "drives": [
            {
                "name": each.name,
                "differs": each.differs,
                "change": dataclasses.asdict(each.change),
                "per hour": dataclasses.asdict(rig.drift_per_hour(each)),
                **{name: quantity(found) for name, found in each.quantities.items()},
            }
            for each in rig.drives
        ],
    }


def quantity(found):
    """What is known of one quantity of a drive."""
    asked = {name: getattr(found, name) for name in ("used", "outliers", "drifts", "status", "between_sd")}
    said = {
        name: [dataclasses.asdict(each) for each in getattr(found, name)] for name in ("segments", "jumps")
    }
    means = [dataclasses.asdict(each) for each in found.means([found.frames // 3])]
    return {**asked, **said, "means": means, "drift": dataclasses.asdict(found.drift)}


def read(text, *more):
    """What is read of a calibration, or why it is not."""
    try:
        return dataclasses.asdict(
            parse_calibration([("a", text.encode()), *(("b", each.encode()) for each in more)])
        )
    except RollcliError as error:
        return str(error)


def results():
    """Drives, poses and calibrations by name."""
    drives = {name: rows(seed, **options) for seed, (name, options) in enumerate(DRIVES.items())}
    here = {name: assessed(given) for name, given in drives.items()}
    here["with suspect ones"] = assessed(drives["jump"], include_suspect=True)
    several = [
        rows(30 + number, f"day{number}", frames=80, level=level) for number, level in enumerate((0, 0, 1, 0))
    ]
    together = {name: [value for part in several for value in part[name]] for name in several[0]}
    here["days"] = assessed(together)
    here["no groups"] = assessed(together, groups="none")
    for number, rig in enumerate(
        (
            Calibration(140.0, 140.0, 79.5, 59.5, 0.3),
            Calibration(140.0, 150.0, 70.0, 65.0, 0.3, doffs=4.0, width=160, height=120),
            Calibration(200.0, 180.0, 90.0, 50.0),
        )
    ):
        for roll_deg in (-20, 3):
            estimate = with_pose(
                estimate_roll(flat_road(roll_deg) + np.random.default_rng(1).normal(0, 0.1, (120, 160))), rig
            )
            pose = dataclasses.asdict(pose_of(estimate.tangent, rig))
            row = horizon_row(estimate.tangent, rig)
            here[f"pose {number} {roll_deg}"] = {**estimate.to_dict(), **pose, "row": row}
    whole = {**calibration_files.WHOLE, "kalibr": calibration_files.kalibr, "zed": calibration_files.zed}
    for name, write in whole.items():
        here[f"{name} of one focal length"] = read(write(calibration_files.Rig(doffs=3.0)))
        here[f"{name} of two"] = read(write(calibration_files.Rig(fy=650.0)))
    for name in ("KITTI_OBJECT", "KITTI_RAW", "MIDDLEBURY", "OPENCV", "ROS_RIGHT", "KALIBR"):
        here[name] = read(getattr(calibration_files, name))
    here["ROS"] = read(calibration_files.ROS_LEFT, calibration_files.ROS_RIGHT)
    return here


@pytest.mark.slow
def test_what_is_said_is_on_record():
    assert unlike_record("rig", results(), 1e-4) == []
