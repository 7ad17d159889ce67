"""The rig from rows, as a user of Python calls it, and which frames are one drive."""

import re
from dataclasses import make_dataclass

import numpy as np
import pytest

import rollcli
from rollcli.rig.words import one_line
from tests.rig.drive.series import drive, joined

SCHEMA = make_dataclass("Row", ["file", "status", "roll_deg", "roll_ci95_deg"])


def columns(values, errors, *, folder="run/", status=None):
    return {
        "file": [f"{folder}{place}.png" for place in range(len(values))],
        "status": ["ok"] * len(values) if status is None else status,
        "roll_deg": list(values),
        "roll_ci95_deg": list(1.96 * np.asarray(errors)),
    }


def test_rows_of_any_kind_give_the_same_answer():
    given = columns(*drive(1, 500, sd=0.1))
    rows = [dict(zip(given, cells, strict=True)) for cells in zip(*given.values(), strict=True)]
    answers = [rollcli.assess_rig(each).now() for each in (given, rows, [SCHEMA(**row) for row in rows])]
    assert answers[0] == answers[1] == answers[2]
    pandas = pytest.importorskip("pandas", reason="pandas is not here")
    assert rollcli.assess_rig(pandas.DataFrame({**given, "pitch_deg": pandas.NA})).now() == answers[0]
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not here")
    assert rollcli.assess_rig(pyarrow.table(given)).now() == answers[0]


def test_a_single_row_is_a_frame_whatever_its_kind():
    only = {name: cells[0] for name, cells in columns([1.5], [0.1]).items()}
    for rows in ([only], [SCHEMA(**only)], {name: [cell] for name, cell in only.items()}):
        rig = rollcli.assess_rig(rows)
        assert (rig.count, rig.frames.files, rig.now().value) == (1, ["run/0.png"], pytest.approx(1.5))
    failed = make_dataclass("Failed", ["file", "status"])("run/1.png", "error")
    for rows in ([failed, SCHEMA(**only)], [SCHEMA(**only), failed]):
        assert rollcli.assess_rig(rows).failed == 1
    alone = (columns([level], [0.1], folder=f"data/{level}/") for level in (1, 4))
    rig = rollcli.assess_rig(joined(*alone), groups="data/*")
    assert [each.differs for each in rig.drives] == [False, False]  # how far frames scatter is not known


def test_a_name_loses_no_more_than_the_folders_that_all_have_in_common():
    files = ["/data/0.png", "1.png"]
    assert rollcli.assess_rig(columns([1.5] * 2, [0.1] * 2) | {"file": files}).names == files


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


@pytest.mark.slow
@pytest.mark.parametrize("frames", [3, 7])
def test_short_drives_of_one_rig_do_not_differ_by_the_sway_of_its_car(frames):
    differing = 0
    for trial in range(10):
        parts = [
            columns(*drive(100 * trial + each, frames, sd=0.3, phi=0.94), folder=f"data/{each}/")
            for each in range(20)
        ]
        rig = rollcli.assess_rig(joined(*parts), groups="data/*")
        differing += any(each.differs for each in rig.drives)
    assert differing <= 1


def test_images_of_two_sizes_are_two_drives_and_so_are_two_results():
    given = columns(*drive(1, 40, sd=0.1)) | {  # a frame that could not be read has no size
        "width": [None, *[640] * 19, None, *[320] * 19],
        "height": [None, *[480] * 19, None, *[240] * 19],
    }
    assert [each.name for each in rollcli.assess_rig(given).drives] == ["run (640x480)", "run (320x240)"]


def test_rolls_on_both_sides_of_a_right_angle_are_close_together():
    rolls = 89.8 + np.random.default_rng(0).normal(0, 0.5, 300)
    rig = rollcli.assess_rig({"status": ["ok"] * 300, "roll_deg": (rolls + 90) % 180 - 90})
    assert abs(rig.now().value - 89.8) < 0.2


def test_no_rows_are_no_frames():
    rig = rollcli.assess_rig([])
    assert (rig.count, rig.used, rig.now().value) == (0, 0, None)
