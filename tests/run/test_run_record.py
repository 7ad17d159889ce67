"""FILE.run.json: what it holds and what is read back; the roll of the rig that ends a run."""

import json
import math

import pytest

from rollcli.errors import InputError
from rollcli.files.results import Row, read_run
from rollcli.run import summary
from rollcli.run.frame import ReadAs
from rollcli.run.options import (
    EncodingOptions,
    FrameOptions,
    ImageOptions,
    InputOptions,
    MethodOptions,
    RegionOptions,
    ResultOptions,
)
from rollcli.run.plan import make_plan
from rollcli.run.record import RunRecord, recorded_options
from rollcli.run.summary import Figures, RunSummary
from tests.run.estimate_options import estimate_options
from tests.run_cli import keep_rows, road_map, rollcli, write_kitti, write_maps


@pytest.fixture
def options(tmp_path):
    write_maps(tmp_path / "maps", 3)
    return estimate_options(
        inputs=InputOptions((str(tmp_path / "maps"),)),
        encoding=EncodingOptions(scale=0.5, invalid=(1.0, 2.0)),
        region=RegionOptions(roi=(0, 0, 9, 9)),
        method=MethodOptions(method="gss"),
        images=ImageOptions(derotated=str(tmp_path / "up")),
        result=ResultOptions(output=str(tmp_path / "rolls.csv")),
    )


def summary_of(frames):
    """The summary of a run of so many frames."""
    summary = RunSummary()
    for _ in range(frames):
        summary.add_row(Row("a.png", status="ok"))
    return summary


def written(options, *seen):
    """The record of a run that saw these encodings and ranges."""
    record = RunRecord(make_plan(options), options)
    for encoding, searched in seen:
        record.saw(ReadAs(frozenset([encoding]), searched))
    record.write(summary_of(3))
    return read_run(options.result.output)


def test_options_are_read_back_as_they_were_given(options):
    run = written(options)
    kept = {name: getattr(options, name) for name in ("encoding", "stereo", "method", "images")}
    expected = FrameOptions(**kept)
    assert recorded_options(run, "rolls.csv.run.json") == expected
    assert run["options"]["method"] == "gss"
    assert run["options"]["roi"] == [0, 0, 9, 9]


@pytest.mark.parametrize(
    "given", [[], 3, "x", {"scale": "much"}, {"scale": True}, {"derotated": 5}, {"invalid": ["x"]}]
)
def test_what_is_no_record_of_options_is_refused(given):
    with pytest.raises(InputError, match="is not the record of a run"):
        recorded_options({"options": given}, "rolls.csv.run.json")


def test_it_says_how_inputs_were_read_before_the_run_is_over(options):
    record = RunRecord(make_plan(options), options)
    record.saw(ReadAs(frozenset(["kitti"])))
    record.saw(ReadAs(searched=(0, 63)))
    record.saw(ReadAs(frozenset(["px"]), (-16, 47)))
    run = read_run(options.result.output)
    assert run["encoding"] == ["kitti", "px"]
    assert run["disparities_searched_px"] == [-16, 63]
    assert run["counts"] == {}


def test_a_resumed_run_writes_the_record_of_an_undisturbed_one(options):
    whole = written(options, ("kitti", (0, 63)), ("px", (0, 79)))
    record = RunRecord(make_plan(options), options)
    record.continue_from(json.loads(json.dumps(written(options, ("kitti", (0, 63))))))
    record.saw(ReadAs(frozenset(["px"]), (0, 79)))
    record.write(summary_of(3))
    assert read_run(options.result.output) == whole


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
    keep_rows(tmp_path / "rolls.csv", 2)
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "-q", "--resume", cwd=tmp_path).err == ""
    keep_rows(tmp_path / "rolls.csv", 2)
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
