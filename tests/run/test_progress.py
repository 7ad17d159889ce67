"""Counts, lines, the bar and the exit status of a run."""

import os
import struct
import sys
import time
from types import SimpleNamespace

import pytest

from rollcli.files.results import Row
from rollcli.run.frame import Frame, failed_frame
from rollcli.run.options import FramesOptions, RunningOptions
from rollcli.run.progress import Progress, RunSummary, TaskProgress

MAP = Frame("a.png", "", "a.png", "", "a.png", None)


def test_of_many_causes_the_first_five_are_said(capsys):
    counted = Progress(3, FramesOptions(running=RunningOptions(quiet=True)), ("ok",))
    for cause in "abcdefg":
        counted.add(failed_frame(MAP, cause, cause))
    counted.tell_end()
    assert capsys.readouterr().err.splitlines() == [
        *(f"rollcli: a.png: {cause}" for cause in "abcde"),
        "rollcli: 2 further frames: other causes, which -v names",
    ]


def test_frames_of_two_sizes_are_two_drives():
    summary = RunSummary()
    for place in range(40):
        roll, size = ((1.0, (320, 240)), (4.0, (640, 480)))[place % 2]
        moved = roll + 0.1 * (place % 8 - 3.5)
        row = Row(f"m/{place}.png", "", "ok", moved, 0.1, width=size[0], height=size[1])
        summary.add_row(row, place)
    told = summary.rig_roll()
    assert "in m (640x480); the drives differ: " in told
    assert "in m (320x240)" in told


@pytest.fixture
def clock(monkeypatch):
    """A monotonic clock that a test moves."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    return clock


def test_a_line_is_written_every_half_minute_off_a_terminal(clock, capsys):
    with TaskProgress(100, RunningOptions()) as progress:
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
    with TaskProgress(total, RunningOptions()) as progress:
        progress.kept = 11
        for _ in range(20):
            clock.now += 1.5
            progress.advance()
    assert capsys.readouterr().err == f"rollcli: 31 of {total} frames, 0.7 frames/s{left}\n"


class Terminal:
    """A terminal so many characters wide, which shows what this process says; 0 if it tells no size."""

    def __init__(self, monkeypatch, columns):
        fcntl = pytest.importorskip("fcntl", reason="this system has no terminals of POSIX")
        import termios

        self.reader, end = os.openpty()
        fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 24 if columns else 0, columns, 0, 0))
        self.stream = os.fdopen(end, "w")
        monkeypatch.setattr(sys, "stderr", self.stream)

    def read(self):
        """What was written since it was read."""
        self.stream.write("\0")  # what was written before it has arrived when this has
        self.stream.flush()
        data = b""
        while not data.endswith(b"\0"):
            data += os.read(self.reader, 100_000)
        return data[:-1].decode()


class WithFailures(TaskProgress):
    def counted(self):
        return {"failed": 2}


@pytest.mark.parametrize(("columns", "longest"), [(60, 60), (0, 80)])
def test_a_terminal_shows_a_bar_which_makes_room_for_messages_and_vanishes(monkeypatch, columns, longest):
    terminal = Terminal(monkeypatch, columns)
    progress = WithFailures(10, RunningOptions())
    progress.kept = 4
    with progress:
        shown = terminal.read().rpartition("\r")[2]
        assert " 4/10 " in shown
        assert longest - 2 <= len(shown) <= longest
        for _ in range(3):
            progress.advance()
        terminal.read()
        progress.say("a message")
        cleared, said, after = terminal.read().partition("rollcli: a message\r\n")
        assert (cleared.strip(), said != "") == ("", True)
        assert len(cleared) > longest - 5
        assert " 7/10 " in after
        assert "failed=2" in after
    erased = terminal.read()
    assert (erased.strip(), erased[-1:]) == ("", "\r")
    terminal.stream.close()
    os.close(terminal.reader)


def test_of_more_frames_than_memory_is_meant_for_the_answer_names_who_has_it(monkeypatch):
    monkeypatch.setattr("rollcli.run.progress._MOST_FRAMES", 3)
    found = RunSummary()
    for number in range(5):
        found.add_row(Row(f"{number}.png", status="ok", roll_deg=1.0, roll_ci95_deg=0.1))
    assert found.rig_roll() == "more than 3 frames: rollcli rig RESULT says what they say of the rig"
