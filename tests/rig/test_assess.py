"""The rig from rows, as a user of Python calls it, and which frames are one drive."""

import re
from dataclasses import make_dataclass

import numpy as np
import pytest

import rollcli
from rollcli.rig.drive.assess import difference
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.words import findings, one_line
from tests.rig.drive.series import drive

SCHEMA = make_dataclass("Row", ["file", "status", "roll_deg", "roll_ci95_deg"])


def columns(values, errors, *, folder="run/", status=None):
    return {
        "file": [f"{folder}{place}.png" for place in range(len(values))],
        "status": ["ok"] * len(values) if status is None else status,
        "roll_deg": list(values),
        "roll_ci95_deg": list(1.96 * np.asarray(errors)),
    }


def joined(*parts):
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}


def test_rows_of_any_kind_give_the_same_answer():
    given = columns(*drive(1, 500, sd=0.1))
    rows = [dict(zip(given, cells, strict=True)) for cells in zip(*given.values(), strict=True)]
    answers = [rollcli.assess_rig(each).now() for each in (given, rows, [SCHEMA(**row) for row in rows])]
    assert answers[0] == answers[1] == answers[2]
    pandas = pytest.importorskip("pandas", reason="pandas is not here")
    assert rollcli.assess_rig(pandas.DataFrame(given)).now() == answers[0]


def test_a_single_row_is_a_frame_whatever_its_kind():
    only = {name: cells[0] for name, cells in columns([1.5], [0.1]).items()}
    for rows in ([only], [SCHEMA(**only)], {name: [cell] for name, cell in only.items()}):
        rig = rollcli.assess_rig(rows)
        assert (rig.count, rig.frames.files, rig.now().value) == (1, ["run/0.png"], pytest.approx(1.5))


def test_suspect_frames_are_counted_and_left_out_unless_asked_for():
    values, errors = drive(2, 800, sd=0.1)
    status = np.where(np.arange(800) % 5 == 0, "suspect", "ok")
    values[::5] += 0.5
    given = columns(values, errors, status=status.tolist())
    rig = rollcli.assess_rig(given)
    assert (rig.suspect, rig.used) == (160, 640)
    assert abs(rig.now().value + 0.44) < 0.15
    counted = rollcli.assess_rig(given, include_suspect=True)
    assert counted.used + counted.outliers == 800
    assert counted.now().value > rig.now().value + 0.02


def test_each_folder_is_a_drive_and_the_one_that_differs_is_named():
    parts = [
        columns(*drive(seed, 1500, level=level, sd=0.1), folder=f"{name}/")
        for seed, (name, level) in enumerate([("monday", -0.4), ("tuesday", -0.4), ("friday", 0.3)])
    ]
    rig = rollcli.assess_rig(joined(*parts))
    assert [each.name for each in rig.drives] == ["monday", "tuesday", "friday"]
    assert [each.differs for each in rig.drives] == [False, False, True]
    (sentence,) = findings(rig)
    assert sentence.startswith("friday differs from tuesday by +0.")
    assert abs(rig.now().value - 0.3) < 0.15


def test_single_frames_in_folders_of_their_own_are_not_drives():
    parts = [columns([value], [0.05], folder=f"scene{n}/") for n, value in enumerate(np.linspace(0, 1, 40))]
    assert len(rollcli.assess_rig(joined(*parts)).drives) == 1


def test_groups_name_the_folders_that_are_drives():
    parts = [columns(*drive(n, 50), folder=f"data/run{n // 2}/part{n}/") for n in range(4)]
    assert len(rollcli.assess_rig(joined(*parts)).drives) == 4
    named = rollcli.assess_rig(joined(*parts), groups="data/run*")
    assert [each.name for each in named.drives] == ["data/run0", "data/run1"]
    assert len(rollcli.assess_rig(joined(*parts), groups="none").drives) == 1
    with pytest.raises(rollcli.RollcliError, match="matches no folder"):
        rollcli.assess_rig(joined(*parts), groups="nothing*")


def test_the_interval_of_a_difference_is_that_of_both():
    change = difference(Estimate(0.3, 0.3), Estimate(0.7, 0.4))
    assert (change.value, change.ci95) == pytest.approx((0.4, 0.5))
    assert difference(Estimate(0.3), Estimate(0.7, 0.4)).ci95 is None


@pytest.mark.parametrize("frames", [3, 10])
def test_rigs_that_differ_are_not_pooled_however_few_their_frames(frames):
    rng = np.random.default_rng(0)
    parts = [
        columns(level + rng.normal(0, 0.1, frames), [0.1] * frames, folder=f"data/{name}/")
        for name, level in (("a", 2.8), ("b", -3.0), ("c", -0.4))
    ]
    rig = rollcli.assess_rig(joined(*parts))
    assert [each.differs for each in rig.drives] == [False, True, True]
    line = one_line(rig)
    assert line.startswith("roll -0.")
    assert " in c" in line
    assert re.search(r"the drives differ: \+2\.\S+( ± \S+)? in a, -[23]\.\S+( ± \S+)? in b", line)


def test_images_of_two_sizes_are_two_drives_and_so_are_two_results():
    given = columns(*drive(1, 40, sd=0.1)) | {
        "width": [640] * 20 + [320] * 20,
        "height": [480] * 20 + [240] * 20,
    }
    names = [each.name for each in rollcli.assess_rig(given).drives]
    assert names == ["run (640x480)", "run (320x240)"]


def test_pitch_and_height_are_assessed_by_themselves_where_they_are_there():
    given = columns(*drive(1, 1500, sd=0.1))
    pitch, errors = drive(2, 1500, level=2.0, sd=0.1, jump=0.8, at=900)
    given |= {"pitch_deg": pitch, "pitch_ci95_deg": errors, "height_m": [1.65] * 750 + [None] * 750}
    rig = rollcli.assess_rig(given)
    found = rig.drives[0].quantities
    assert not found["roll"].jumps
    assert [abs(jump.frame - 900) < 20 for jump in found["pitch"].jumps] == [True]
    assert found["height"].now.value == pytest.approx(1.65)
    assert found["height"].used == 750


def test_rolls_on_both_sides_of_a_right_angle_are_close_together():
    rng = np.random.default_rng(0)
    rolls = 89.8 + rng.normal(0, 0.5, 300)
    wrapped = np.where(rolls > 90, rolls - 180, rolls)
    rig = rollcli.assess_rig({"status": ["ok"] * 300, "roll_deg": wrapped})
    assert abs(rig.now().value - 89.8) < 0.2


def test_no_rows_are_no_frames():
    rig = rollcli.assess_rig([])
    assert (rig.count, rig.used, rig.now().value) == (0, 0, None)
