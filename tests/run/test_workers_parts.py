"""Parts that workers write: which rows they take, what keeps them from it, and what a resume does."""

import random
import signal
import sys
from itertools import accumulate
from pathlib import Path

import pytest

from rollcli.errors import UsageError
from rollcli.files.results import Row, format_header, format_row
from rollcli.files.storage import list_names, remove
from rollcli.run.batch import BatchOptions, join_results
from rollcli.run.frame import Frame, FrameResult, ReadAs
from rollcli.run.options import EstimateOptions, ResultOptions
from rollcli.run.result_file import inputs_line
from rollcli.run.workers.chunks import Chunks, Done, Span, Work
from tests.object_store import joined
from tests.run_cli import contents, estimated, python, rollcli, started, wait_for_files, write_maps
from tests.slow import mostly_slow

KITTI = ReadAs(frozenset(["kitti"]))
FRAMES = [Frame(f"{n}.png", "", f"{n}.png", "", f"{n}.png", None) for n in range(11)]
ROWS = [Row(frame.file, status="ok", roll_deg=float(n)) for n, frame in enumerate(FRAMES)]


def lines(first, end):
    """The rows as they stand in a CSV."""
    return [format_row(row, "csv") for row in ROWS[first:end]]


def noted(first, end):
    """What says that nothing is known of their files, which were not read."""
    return [inputs_line(frame, {}) for frame in FRAMES[first:end]]


def join(folder, first, end, *, known=KITTI, rows=ROWS, numbers=range(4)):
    """What a worker hands back of frames that a run of eleven has, in parts of three rows."""
    told = EstimateOptions(result=ResultOptions(part_rows=3), notes=True, run="run")
    rows_of = BatchOptions(told, (), str(folder), numbers, len(FRAMES))
    results = [FrameResult(row, KITTI) for row in rows[first:end]]
    return join_results(Span(FRAMES[first:end], first, known), results, rows_of)


@pytest.mark.parametrize(
    ("first", "end", "parts"),
    [
        (0, 3, [0]),
        (0, 8, [0, 1]),
        (3, 9, [1, 2]),
        (9, 11, [3]),  # the last one, which is short
        (6, 11, [2, 3]),
        (0, 2, []),
        (9, 10, []),
        (1, 11, []),  # another worker has the first row
    ],
)
def test_a_worker_writes_the_parts_that_it_has_whole_and_hands_back_other_rows(tmp_path, first, end, parts):
    batch = join(tmp_path / "rolls.csv", first, end)
    expected = {}
    for number in parts:
        data = b"".join(lines(3 * number, 3 * number + 3))
        expected[f"rolls.csv/part-0000{number}.csv"] = data if number else format_header("csv") + data
        expected[f"rolls.csv.inputs/part-0000{number}.inputs"] = b"".join(noted(3 * number, 3 * number + 3))
    assert contents(tmp_path) == expected
    assert batch.in_parts == sum(min(3, 11 - 3 * number) for number in parts)
    assert batch.lines == lines(first + batch.in_parts, end)
    assert batch.notes == noted(first + batch.in_parts, end)
    assert len(batch) == end - first


def test_a_part_that_a_dying_worker_had_written_counts_and_another_runs_does_not(tmp_path, bucket):
    here = tmp_path / "rolls.csv"
    for folder in (here, f"{bucket}/rolls.csv"):
        assert join(folder, 0, 3).in_parts == 3
        assert join(folder, 0, 3).in_parts == 3
    other = [Row(row.file, status="ok", roll_deg=5.0) for row in ROWS]
    with pytest.raises(UsageError, match="another run has written this part"):
        join(here, 0, 3, rows=other)


@pytest.mark.parametrize(
    ("rows", "seconds"), [(1000, 0.001), (1000, 0.005), (7, 0.005), (1000, 0.1), (1, 0.1)]
)
def test_chunks_are_whole_parts_or_pieces_of_one(rows, seconds):
    chunks = Chunks(range(40_000), 1, Work(str, str, unit=rows))
    sizes = []
    while chunk := chunks.take(2):
        pieces = {task // rows for task in chunk}
        assert len(pieces) == 1 or len(chunk) % rows == chunk[0] % rows == 0 or chunk[-1] == 39_999
        sizes.append(len(chunk))
        chunks.measure(Done(range(len(chunk)), seconds * len(chunk)), 2)
    assert sum(sizes) == 40_000
    if rows * seconds <= 8:
        amid = [size for size, end in zip(sizes, accumulate(sizes), strict=True) if 4000 < end < 36_000]
        assert all(size % rows == 0 for size in amid)
    else:
        assert max(sizes) * seconds <= 1.01


@pytest.fixture
def maps(tmp_path):
    """Twenty-three maps, one of them broken, and the CSV of a run on one process."""
    return estimated(tmp_path, 23, "-j", "1", broken={7: b"no map"})


@pytest.mark.parametrize("rows", mostly_slow(["1", "2", "7", "23", "1000"], "7"))
def test_parts_of_several_workers_are_the_file_of_one_process(maps, bucket, rows):
    line = ("estimate", "maps", "-o", f"{bucket}/{rows}.csv", "--part-rows", rows, "-j", "2", "-q")
    assert rollcli(*line, cwd=maps).status == 3
    assert joined(f"{bucket}/{rows}.csv") == (maps / "rolls.csv").read_bytes()
    assert len(list_names(f"{bucket}/{rows}.csv")) == -(-23 // int(rows))


@pytest.mark.slow
@pytest.mark.skipif(sys.version_info < (3, 11), reason="Python 3.10 searches the current folder")
def test_workers_run_nothing_that_lies_in_the_current_folder(maps):
    pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
    (maps / "struct.py").write_text("open('has run', 'w').close()")
    installed = "import sys; sys.path.remove(''); from rollcli.__main__ import main; main()"
    line = ("estimate", "maps", "-o", "rolls.parquet", "-j", "2", "-q")
    assert python(installed, *line, cwd=maps).returncode == 3
    assert not (maps / "has run").exists()


@pytest.mark.parametrize("missing", mostly_slow([[0], [1, 2, 5], [0, 11], range(12)], [1, 2, 5]))
@pytest.mark.parametrize("jobs", mostly_slow(["1", "2"], "1"))
def test_a_resume_does_the_parts_that_are_missing_wherever_they_are_and_no_others(maps, missing, jobs):
    line = ("estimate", "maps", "-o", "rolls.parquet", "--part-rows", "2", "-j", jobs)
    undisturbed = rollcli(*line, cwd=maps)
    whole, places = contents(maps), {}
    for number in range(12):
        part = maps / "rolls.parquet" / f"part-{number:05d}.parquet"
        if number in missing:
            part.unlink()
        else:
            places[part] = part.stat().st_ino
    listed = rollcli(*line, "--resume", "--dry-run", cwd=maps).out
    positions = [position for number in missing for position in (2 * number, 2 * number + 1) if position < 23]
    assert [each.split()[1] for each in listed.splitlines() if each.startswith("read")] == [
        f"maps/frame{position}.png" for position in positions
    ]
    done = rollcli(*line, "--resume", cwd=maps)
    kept = f" ({23 - len(positions)} kept)" if len(positions) < 23 else ""
    assert (done.status, f"23 frames{kept}: 21 ok, 1 suspect, 1 failed" in done.err) == (3, True), done.err
    assert done.err.splitlines()[-1] == undisturbed.err.splitlines()[-1]  # the rig's roll
    assert contents(maps) == whole
    assert {part: part.stat().st_ino for part in places} == places


@pytest.mark.slow
def test_a_hole_is_filled_before_a_failed_frame_of_a_later_part_is_done_again(maps, bucket):
    line = ("estimate", "maps", "-o", f"{bucket}/rolls.csv", "--part-rows", "3", "-q")
    assert rollcli(*line, cwd=maps).status == 3
    for number in (0, 4):
        remove(f"{bucket}/rolls.csv/part-{number:05d}.csv")
    write_maps(maps / "new", 23)
    Path(maps / "maps" / "frame7.png").write_bytes((maps / "new" / "frame7.png").read_bytes())
    assert rollcli(*line, "--resume", "--retry-failed", cwd=maps).status == 0
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "--overwrite", "-q", cwd=maps).status == 0
    assert joined(f"{bucket}/rolls.csv") == (maps / "rolls.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_runs_that_are_stopped_and_killed_end_in_the_parts_of_an_undisturbed_one(tmp_path, seed):
    write_maps(tmp_path / "maps", 300, width=320, height=240)
    line = ("estimate", "../maps", "-o", "rolls.parquet", "--part-rows", "4", "-j", "2")
    for name in ("whole", "disturbed"):
        (tmp_path / name).mkdir()
    assert rollcli(*line, cwd=tmp_path / "whole").status == 0
    chance, parts, status = random.Random(seed), tmp_path / "disturbed" / "rolls.parquet", 1
    while status != 0:
        run = started(*line, "--resume", "-q", cwd=tmp_path / "disturbed")
        end = len(list(parts.glob("part-*"))) + chance.randint(5, 30)
        wait_for_files(parts, "part-*", end, run)
        run.send_signal(chance.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT]))
        _, said = run.communicate(timeout=60)
        status = run.returncode
        assert status in (0, 130, -signal.SIGKILL), said
        assert "Traceback" not in said
    assert contents(tmp_path / "disturbed") == contents(tmp_path / "whole")
