"""The rig's roll in the last line of a run, against `rollcli rig` on the result."""

import json
import math

from rollcli.files.results import Row
from rollcli.run import summary
from rollcli.run.summary import Figures, RunSummary
from tests.run_cli import road_map, rollcli, write_kitti


def test_a_run_ends_with_the_roll_of_the_rig_and_its_interval(tmp_path):
    for place in range(40):
        write_kitti(tmp_path / "maps" / f"{place}.png", road_map(math.radians(2), noise=0.3, seed=place))
    (tmp_path / "maps" / "z.png").write_bytes(b"no map")
    done = rollcli("estimate", "maps", "-o", "rolls.csv", cwd=tmp_path)
    assert done.status == 3
    rig = json.loads(rollcli("rig", "rolls.csv", "--format", "json", "-q", cwd=tmp_path).out)
    last = done.err.splitlines()[-1]
    told = float(last.removeprefix("rollcli: roll ").partition(" ")[0])
    assert abs(told - rig["roll_deg"]) < 0.001
    assert " ± " in last
    assert last.endswith("°, 40 ok, 0 suspect, 1 failed")
    assert abs(rig["roll_deg"] - 2) < 0.1


def test_a_resumed_run_answers_for_all_frames_and_a_quiet_one_does_not(tmp_path):
    for place in range(4):
        write_kitti(tmp_path / "maps" / f"{place}.png", road_map(0.1, seed=place))
    rollcli("estimate", "maps", "-o", "rolls.csv", "-q", cwd=tmp_path)
    lines = (tmp_path / "rolls.csv").read_bytes().splitlines(keepends=True)
    (tmp_path / "rolls.csv").write_bytes(b"".join(lines[:3]))
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "-q", "--resume", cwd=tmp_path).err == ""
    (tmp_path / "rolls.csv").write_bytes(b"".join(lines[:3]))
    done = rollcli("estimate", "maps", "-o", "rolls.csv", "--resume", cwd=tmp_path)
    assert done.err.splitlines()[-1].endswith(", 4 ok, 0 suspect, 0 failed")


def test_frames_without_an_angle_leave_the_roll_unknown():
    found = RunSummary()
    found.add_row(Row("a.png", message="a.png: is empty"))
    assert found.rig_roll() == "roll unknown, 0 ok, 0 suspect, 1 failed"


def test_of_more_frames_than_memory_is_meant_for_the_answer_names_who_has_it(monkeypatch):
    monkeypatch.setattr(summary, "_MOST_FRAMES", 3)
    found = RunSummary()
    for number in range(5):
        found.add_row(Row(f"{number}.png", status="ok", roll_deg=1.0, roll_ci95_deg=0.1))
        found.replace([number], Figures.of([Row(f"{number}.png")]))
    assert found.rig_roll() == "more than 3 frames: rollcli rig RESULT says what they say of the rig"
