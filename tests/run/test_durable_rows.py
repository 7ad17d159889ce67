"""Rows enter the result once their images survive a power cut, and a resume restores images that are gone."""

import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rollcli.files.results import STATUSES
from rollcli.run.batch import Batch
from rollcli.run.frame import Frame, ReadAs
from rollcli.run.options import EstimateOptions, ImageOptions, ResultOptions
from rollcli.run.plan import Plan
from rollcli.run.progress import Figures
from rollcli.run.result import FileOutput
from rollcli.run.result_file import open_result
from rollcli.run.resume import KeptRows, RunRecord
from tests.run_cli import contents, estimated, keep_rows, rollcli
from tests.slow import mostly_slow

IMAGES = ("--derotated", "up", "--vdisparity", "v")


class WatchedFile:
    """A result that notes, with each row, which files were forced to the disk before it."""

    def __init__(self, forced):
        self.forced, self.rows, self.synced = forced, {}, 0

    def append(self, rows):
        for row in rows.split():
            self.rows[row] = {inode for inode, _ in self.forced}

    def sync(self):
        self.synced = len(self.rows)

    def is_there(self):
        return True


def plan_of(folder, count):
    """The plan of a run over so many maps, whose workers have written an image of each."""
    images, result = ImageOptions(derotated=str(folder)), ResultOptions(str(folder / "rolls.csv"))
    options = EstimateOptions(images=images, result=result)
    names = [f"{number}.png" for number in range(count)]
    for name in names:
        (folder / name).write_bytes(b"image")
    return Plan(options, [Frame(name, "", name, "", name, None) for name in names])


def add(output, frame, position, row, line, status="ok"):
    """Add a row and the line of its inputs; an error has no image."""
    figures = Figures(bytes([STATUSES.index(status)]), ())
    output.append([position], [frame], Batch(figures, 0, [row], [line], ReadAs(), []))


@pytest.mark.skipif(os.name == "nt", reason="Windows forces no folders")
def test_a_row_is_written_after_its_images_and_their_folder_are_on_the_disk(tmp_path, synced, monkeypatch):
    now, file, plan = [100.0], WatchedFile(synced), plan_of(tmp_path, 40)
    monkeypatch.setattr("rollcli.run.result.time", SimpleNamespace(monotonic=lambda: now[0]))
    output = FileOutput(file, WatchedFile([]), RunRecord(plan), KeptRows(plan))
    for number, frame in enumerate(plan.frames):
        now[0] += 0.06
        add(output, frame, number, b"%d " % number, b"read")
        assert len(file.rows) == (number + 1) // 17 * 17  # together, each second
    output.commit()
    assert list(file.rows) == [b"%d" % number for number in range(40)]
    for frame, forced in zip(plan.frames, file.rows.values(), strict=True):
        assert {(tmp_path / frame.file).stat().st_ino, tmp_path.stat().st_ino} <= forced
    assert file.synced == 40
    assert output.hint() == "; 40 rows kept, continue with --resume"


@pytest.fixture
def finished(tmp_path):
    return estimated(tmp_path, 6, *IMAGES, broken={3: b"no map"})


def resume(folder, *arguments):
    return rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--resume", *arguments, cwd=folder)


@pytest.mark.parametrize("jobs", mostly_slow(["-j1", "-j2"], "-j1"))
@pytest.mark.parametrize("rows", [6, 4])
def test_a_resume_makes_missing_and_empty_images_of_kept_rows_again(finished, rows, jobs):
    before = contents(finished)
    keep_rows(finished / "rolls.csv", rows)
    (finished / "up" / "frame0.png").unlink()
    (finished / "v" / "frame1.png").write_bytes(b"")
    kept = (finished / "up" / "frame2.png").stat().st_mtime_ns
    done = resume(finished, jobs)
    assert done.status == 3
    assert "images are missing or empty for 2 of the kept rows" in done.err
    assert contents(finished) == before
    assert (finished / "up" / "frame2.png").stat().st_mtime_ns == kept


def test_images_that_cannot_be_made_again_end_the_resume_with_one_line(finished):
    state = (finished / "maps" / "frame0.png").stat()
    size = (finished / "maps" / "frame0.png").stat().st_size
    (finished / "maps" / "frame0.png").write_bytes(b"x" * size)
    os.utime(finished / "maps" / "frame0.png", ns=(state.st_atime_ns, state.st_mtime_ns))
    (finished / "up" / "frame0.png").unlink()
    done = resume(finished)
    assert done.status == 1
    assert "the images of maps/frame0.png cannot be made again: is no PNG, TIFF, " in done.err


TRACED = tuple(str(Path("run", name)) for name in ("result.py", "result_file.py", "resume.py", "outputs.py"))


def interrupted_at(step, work):
    """Run `work` until a line of a result's modules, as a second Ctrl-C would; return whether it came."""
    left = [step]

    def trace(frame, event, argument):
        path = frame.f_code.co_filename
        if path != __file__ and not path.endswith(TRACED):
            return None
        if event == "line":
            left[0] -= 1
            if left[0] == 0:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()  # of a debugger, or of what measures coverage
    sys.settrace(trace)
    try:
        work()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


@pytest.mark.slow
def test_a_second_interrupt_at_any_line_writes_no_row_twice_and_leaves_none_out(tmp_path):
    expected, step, came = [b"%d\n" % number for number in range(6)], 0, True
    plan = plan_of(tmp_path, len(expected))
    while came:
        step += 1
        path = tmp_path / f"{step}.csv"
        with open_result(str(path)) as file, open_result(f"{path}.inputs") as inputs:
            output = FileOutput(file, inputs, RunRecord(plan), KeptRows(plan))

            def work(output=output):
                for number, row in enumerate(expected):
                    add(output, plan.frames[number], number, row, row, "ok" if number else "error")
                output.commit()

            came = interrupted_at(step, work)
            output.commit()  # as the run does whatever ended it
        lines = path.read_bytes().splitlines(keepends=True)
        assert lines == expected[: len(lines)], step
        read = (tmp_path / f"{step}.csv.inputs").read_bytes().splitlines(keepends=True)
        assert read == expected[: len(read)], step
        assert len(read) >= len(lines), step
    assert step > 50
    assert lines == expected
