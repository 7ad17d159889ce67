"""Rows enter the result once their images survive a power cut, and a resume restores images that are gone."""

import os
import sys

import pytest

from rollcli.run.result_file import DurableRows, open_result
from tests.run_cli import contents, keep_rows, rollcli, write_maps
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


def image(folder, number):
    path = folder / f"{number}.png"
    path.write_bytes(b"image")
    return path


@pytest.mark.skipif(os.name == "nt", reason="Windows forces no folders")
def test_a_row_is_written_after_its_images_and_their_folder_are_on_the_disk(tmp_path, synced):
    file = WatchedFile(synced)
    rows = DurableRows(file, WatchedFile([]))
    paths = [image(tmp_path, number) for number in range(40)]
    for number, path in enumerate(paths):
        rows.append([b"%d " % number], [b"read"], [str(path)])
    rows.commit()
    assert list(file.rows) == [b"%d" % number for number in range(40)]
    for path, forced in zip(paths, file.rows.values(), strict=True):
        assert {path.stat().st_ino, tmp_path.stat().st_ino} <= forced
    assert file.synced == rows.written == 40


@pytest.fixture
def finished(tmp_path):
    write_maps(tmp_path / "maps", 6)
    (tmp_path / "maps" / "frame3.png").write_bytes(b"no map")
    assert rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, cwd=tmp_path).status == 3
    return tmp_path


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


def interrupted_at(step, work):
    """Run `work` until a line of a result's modules, as a second Ctrl-C would; return whether it came."""
    left = [step]

    def trace(frame, event, argument):
        if "durable_rows" not in frame.f_code.co_filename and "result_file" not in frame.f_code.co_filename:
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


def test_a_second_interrupt_at_any_line_writes_no_row_twice_and_leaves_none_out(tmp_path):
    expected, step, came = [b"%d\n" % number for number in range(6)], 0, True
    while came:
        step += 1
        path = tmp_path / f"{step}.csv"
        with open_result(str(path)) as file, open_result(f"{path}.inputs") as inputs:
            rows = DurableRows(file, inputs)

            def work(rows=rows):
                for number, row in enumerate(expected):
                    rows.append([row], [row], [str(image(tmp_path, number))] if number else [])
                rows.commit()

            came = interrupted_at(step, work)
            rows.commit()  # as the run does whatever ended it
        lines = path.read_bytes().splitlines(keepends=True)
        assert lines == expected[: len(lines)], step
        read = (tmp_path / f"{step}.csv.inputs").read_bytes().splitlines(keepends=True)
        assert read == expected[: len(read)], step
        assert len(read) >= len(lines), step
    assert step > 50
    assert lines == expected
