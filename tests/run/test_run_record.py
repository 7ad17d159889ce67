"""FILE.run.json: what it holds, what is read back from it, and which inputs it tells apart."""

import json
import os

import pytest

from rollcli.errors import InputError
from rollcli.files.results import Row, read_run
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
from rollcli.run.record import RunRecord, recorded_options, states_of
from rollcli.run.summary import RunSummary
from tests.run.estimate_options import estimate_options
from tests.run_cli import write_maps


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


@pytest.mark.parametrize("given", [[], "x", {"scale": "much"}, {"scale": True}, {"derotated": 5}])
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


def test_a_digest_of_states_tells_changed_inputs(options):
    frames = make_plan(options).frames
    before = states_of(frames)
    assert states_of(frames) == before
    os.utime(frames[0].path, ns=(0, 2**62))
    assert states_of(frames) != before
