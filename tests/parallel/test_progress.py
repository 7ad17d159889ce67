"""How far a run is, said where nobody looks at a bar."""

import time

import pytest

from rollcli.parallel.progress import TaskProgress


class Clock:
    """A monotonic clock that a test moves."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", clock)
    return clock


def test_a_line_is_written_every_half_minute_off_a_terminal(clock, capsys):
    with TaskProgress(100) as progress:
        progress.kept = 10
        for _ in range(8):
            clock.now += 10
            progress.advance()
    assert capsys.readouterr().err == (
        "rollcli: 13 of 100 frames, 0.1 frames/s, about 14 min left\n"
        "rollcli: 16 of 100 frames, 0.1 frames/s, about 14 min left\n"
    )
    assert (progress.done, progress.seconds) == (18, 80)


@pytest.mark.parametrize(
    ("total", "left"),
    [(31, ""), (32, ", about 2 s left"), (91, ", about 2 min left"), (30_031, ", about 12 h left")],
)
def test_the_time_that_is_left_is_told_in_a_unit_that_fits(clock, capsys, total, left):
    with TaskProgress(total) as progress:
        progress.kept = 11
        for _ in range(20):
            clock.now += 1.5
            progress.advance()
    assert capsys.readouterr().err == f"rollcli: 31 of {total} frames, 0.7 frames/s{left}\n"


def test_quiet_progress_writes_no_lines(clock, capsys):
    with TaskProgress(3, quiet=True, verbose=True) as progress:
        clock.now += 40
        progress.advance()
        progress.note("a note")
        progress.detail("a detail")
    assert capsys.readouterr().err == ""


def test_a_note_is_written_once_and_a_detail_only_when_verbose(capsys):
    for verbose, expected in ((False, "rollcli: a note\n"), (True, "rollcli: a note\nrollcli: a detail\n")):
        with TaskProgress(3, verbose=verbose) as progress:
            progress.note("a note")
            progress.note("a note")
            progress.note("the same topic", topic="a note")
            progress.detail("a detail")
        assert capsys.readouterr().err == expected


def test_the_speed_leaves_out_what_an_interrupted_run_has_left(clock):
    progress = TaskProgress(100)
    progress.kept = 50
    for _ in range(6):
        clock.now += 0.5
        progress.advance()
    assert progress.speed() == "2.0 frames/s"
