"""What goes to stdout and what to stderr."""

import os
import pty
import subprocess

import numpy as np

from tests.run_cli import command, environment, road_map, rollcli, write_kitti

FRAMES = 3


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
