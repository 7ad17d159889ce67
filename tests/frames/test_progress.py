"""Counts, lines and the exit status of a run."""

import pytest

from rollcli.errors import ExitStatus
from rollcli.files.results import Row
from rollcli.frames.frame import FrameResult
from rollcli.frames.options import EncodingOptions, RunningOptions
from rollcli.frames.progress import Progress

GUESSED = EncodingOptions()


def progress(total=3, encoding=GUESSED, **running):
    return Progress(total, RunningOptions(**running), encoding)


def result(status="ok", message="", **values):
    return FrameResult(Row("a.png", status=status, message=message), **values)


@pytest.fixture
def lines(capsys):
    return lambda: capsys.readouterr().err.splitlines()


def test_it_counts_kept_and_new_rows_by_status(lines):
    counted = progress(4)
    counted.keep((Row("a.png", status="ok"), Row("b.png", status="suspect")))
    counted.add(result())
    counted.add(result("suspect"))
    assert counted.done == 4
    assert counted.totals == {"frames": 4, "ok": 2, "suspect": 2, "error": 0}
    assert counted.summary().startswith("4 frames (2 kept): 2 ok, 2 suspect, 0 failed; ")
    assert lines() == []


def test_the_exit_status_says_whether_a_frame_failed(lines):
    counted = progress()
    counted.add(result("suspect"))
    assert counted.status is ExitStatus.DONE
    counted.add(result("error", "a.png: is no map"))
    assert counted.status is ExitStatus.FRAMES_FAILED
    assert lines() == ["rollcli: a.png: is no map"]


def test_failures_after_the_fifth_are_named_only_when_verbose(lines):
    quiet, verbose = progress(quiet=True), progress(verbose=True)
    for number in range(8):
        quiet.add(result("error", f"{number}"))
    assert [line.removeprefix("rollcli: ") for line in lines()] == [
        *"01234",
        "further failures are not named here; -v names all",
    ]
    for number in range(8):
        verbose.add(result("error", f"{number}"))
    assert len(lines()) == 8


def test_how_numbers_were_read_is_said_once_unless_it_was_given(lines):
    found, given = progress(), progress(encoding=EncodingOptions(encoding="kitti"))
    for _ in range(2):
        found.add(result(encoding="kitti"))
        given.add(result(encoding="kitti"))
    assert lines() == ["rollcli: a.png: read as kitti (stored / 256)"]


def test_a_quiet_run_says_errors_alone(lines):
    counted = progress(quiet=True, verbose=True)
    counted.add(result("suspect", "is doubtful", encoding="px", warning="may be wrong", searched=(0, 63)))
    counted.note(counted.summary())
    counted.detail("a detail")
    assert lines() == []
    counted.say("an error")
    assert lines() == ["rollcli: an error"]


def test_doubts_are_said_when_verbose(lines):
    counted = progress(verbose=True)
    counted.add(result("suspect", "is doubtful"))
    assert lines() == ["rollcli: a.png: suspect: is doubtful"]
