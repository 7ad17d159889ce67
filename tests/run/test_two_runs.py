"""Two runs on one result of parts are told apart before they mix their rows."""

import pytest

from rollcli.errors import UsageError
from rollcli.files.locking import locked_folder
from rollcli.files.results import Row, read_result
from rollcli.run.batch import BatchOptions, join_results
from rollcli.run.frame import FrameResult
from rollcli.run.options import EstimateOptions, InputOptions, ResultOptions
from rollcli.run.plan import make_plan
from rollcli.run.progress import RunSummary
from rollcli.run.result import open_output
from rollcli.run.resume import RunRecord
from rollcli.run.workers.chunks import Span
from tests.run_cli import contents, rollcli, write_maps

ANOTHER = "another run has begun to write this result"


@pytest.fixture
def plan(bucket, tmp_path):
    """The plan of a run over four maps on disk, in parts of two rows in the bucket."""
    write_maps(tmp_path / "maps", 4)
    inputs, result = (
        InputOptions((str(tmp_path / "maps"),)),
        ResultOptions(f"{bucket}/rolls.csv", part_rows=2),
    )
    return make_plan(EstimateOptions(inputs=inputs, result=result))


def append(output, frames, first=0):
    """The rows of frames, as workers would return them."""
    told = BatchOptions(EstimateOptions(notes=True))
    for at, frame in enumerate(frames, first):
        result = FrameResult(Row(frame.file, status="ok", roll_deg=1.0))
        output.append([at], [frame], join_results(Span([frame], 0, output.record.read_as), [result], told))


def test_of_two_runs_in_a_bucket_the_last_to_begin_goes_on_and_the_other_ends(bucket, plan):
    with open_output(plan) as first, open_output(plan) as last:
        append(first, plan.frames[:1])
        with pytest.raises(UsageError, match=ANOTHER):
            append(first, plan.frames[1:], 1)
        append(last, plan.frames)
        summary = RunSummary()
        for frame in plan.frames:
            summary.add_row(Row(frame.file, status="ok"))
        last.finish(summary)
        with pytest.raises(UsageError, match="another run has begun"):
            first.finish(RunSummary())
    result = read_result(f"{bucket}/rolls.csv")
    assert [row.file for row in result.rows] == [frame.file for frame in plan.frames]
    assert result.run["counts"] == {"frames": 4, "ok": 4, "suspect": 0, "error": 0}
    with pytest.raises(UsageError, match="exists already"), open_output(plan):
        pass


def test_a_run_whose_rows_come_slowly_looks_now_and_then(plan, monkeypatch):
    monkeypatch.setattr("rollcli.run.result._CHECK_S", 0.0)
    with open_output(plan) as first:
        append(first, plan.frames[:1])
        with open_output(plan), pytest.raises(UsageError, match=ANOTHER):
            append(first, plan.frames[1:2], 1)  # the part is not full


def test_two_runs_that_begin_in_the_same_second_are_told_apart_at_once(plan, monkeypatch):
    others = []
    written = RunRecord.write

    def write(record, *arguments, **words):
        """The other one writes right after the first."""
        written(record, *arguments, **words)
        if not others:
            others.append(open_output(plan))
            others.append(others[0].__enter__())

    monkeypatch.setattr(RunRecord, "write", write)
    with pytest.raises(UsageError, match="another run has begun"), open_output(plan):
        pass
    append(others[1], plan.frames)
    others[0].__exit__(None, None, None)


def test_a_folder_of_parts_on_disk_is_locked_while_a_run_writes_it(tmp_path, monkeypatch):
    monkeypatch.setattr("rollcli.files.locking._PATIENCE_S", 0.0)
    write_maps(tmp_path / "maps", 2)
    line = ("estimate", "maps", "-o", "rolls.parquet")
    with locked_folder(str(tmp_path / "rolls.parquet")):
        assert "another run is writing this result" in rollcli(*line, cwd=tmp_path).refused()
        assert not contents(tmp_path / "rolls.parquet")
    assert rollcli(*line, cwd=tmp_path).status == 0
    assert sorted(contents(tmp_path / "rolls.parquet")) == ["part-00000.parquet"]
