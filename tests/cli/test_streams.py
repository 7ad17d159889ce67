"""What goes to stdout and what to stderr."""

import os
import pty
import subprocess

from tests.run_cli import command, environment

FRAMES = 3


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
