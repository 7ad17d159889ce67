"""What goes to stdout and what to stderr."""

import os
import pty
import subprocess

import numpy as np

from tests.run_cli import command, environment, road_map, rollcli, write_kitti

FRAMES = 3


def test_results_alone_go_to_standard_output(maps):
    done = rollcli("estimate", "maps", cwd=maps)
    assert done.out.count("\n") == 4
    counts, answer = done.err.splitlines()[-2:]
    assert counts.startswith("rollcli: 3 frames: 3 ok, 0 suspect, 0 failed; ")
    assert answer.startswith("rollcli: roll +0.5")
    assert answer.endswith("; an interval takes 8), 3 ok, 0 suspect, 0 failed")


def test_quiet_says_nothing_when_all_is_well(maps):
    assert rollcli("estimate", "maps", "-q", "-o", "rolls.csv", cwd=maps)[1:] == ("", "")


def test_the_encoding_that_was_taken_is_said_once(maps):
    err = rollcli("estimate", "maps", cwd=maps).err
    assert err.count("kitti") == 1
    assert "kitti" not in rollcli("estimate", "maps", "--encoding", "kitti", cwd=maps).err


def test_whole_pixels_in_16_bits_are_warned_of_once(tmp_path):
    for name in ("a.png", "b.png"):
        write_kitti(tmp_path / name, np.rint(road_map()) / 256)
    err = rollcli("estimate", "a.png", "b.png", cwd=tmp_path).err
    assert err.count("a.png: warning: ") == 1
    assert err.count("--encoding px") == 2
    assert "rollcli: 2 frames: warning: uint16 numbers up to" in err


def test_a_terminal_sees_a_progress_bar(maps):
    main, other = pty.openpty()
    line = command("estimate", "maps", "-o", "rolls.csv")
    with subprocess.Popen(line, cwd=maps, env=environment(), stdout=other, stderr=other) as run:
        os.close(other)
        shown = b""
        while chunk := read(main):
            shown += chunk
    os.close(main)
    assert run.returncode == 0
    assert b"/3 [" in shown
    assert b"3 frames: 3 ok" in shown


def read(terminal):
    try:
        return os.read(terminal, 4096)
    except OSError:  # Linux's way to say that the other end is closed
        return b""


def test_timing_is_a_further_column(maps):
    lines = rollcli("estimate", "maps", "--timing", cwd=maps).out.splitlines()
    assert lines[0].endswith(",message,elapsed_ms")
    assert float(lines[1].rpartition(",")[2]) > 0
