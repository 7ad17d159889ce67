"""What happens when nobody reads: only a closed stdout that takes results may end a run, and quietly."""

import os
import pty
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.run_cli import command, ended, environment, holding, started, wait_until, write_maps
from tests.slow import mostly_slow

FRAMES = 8


WORK = {
    "estimate": (["estimate", "maps", "-v", "-o", "rolls.csv", "--derotated", "out"], "out/*.png"),
    "derotate": (["derotate", "maps", "-v", "--roll", "1", "-o", "out"], "out/*.png"),
    "simulate": (["simulate", "out", "-v", "--frames", "8", "--size", "64x48", "-j1"], "out/disparity/*.png"),
}


def without_reader(folder, arguments, stream):
    """Run the program with nobody at the other end of one of its streams."""
    read, write = os.pipe()
    os.close(read)
    done = ended(command(*arguments), folder, timeout=60, **{stream: write})
    os.close(write)
    return done


def test_a_current_folder_that_is_gone_is_said(tmp_path):
    shell = ["sh", "-c", 'rmdir "$PWD"; exec "$@"', "sh"]
    (tmp_path / "gone").mkdir()
    done = ended([*shell, *command("estimate", "maps")], tmp_path / "gone")
    assert (done.returncode, done.stderr) == (2, "rollcli: the current folder is gone\n")


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are UTF-8 on this system")
def test_a_name_that_the_locale_cannot_write_is_said(maps):
    (maps / "options.toml").write_text('output = "\u00e9.csv"', encoding="utf-8")
    line = command("estimate", "maps", "--config", "options.toml")
    done = ended(line, maps, env=environment(LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0"))
    said = "\\xe9.csv: no file can have this name in the encoding of the locale, ascii; set PYTHONUTF8=1"
    assert (done.returncode, done.stderr) == (2, f"rollcli: {said}\n")


NO_DISK = pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")


@pytest.mark.parametrize("reader", ["pipe", "terminal", pytest.param("full disk", marks=NO_DISK)])
@pytest.mark.parametrize("name", mostly_slow(WORK, "estimate"))
def test_a_reader_of_messages_who_is_lost_neither_ends_nor_hides_the_work(maps, name, reader):
    arguments, written = WORK[name]
    if reader == "full disk":
        with Path("/dev/full").open("wb") as full:
            run = started(*arguments, cwd=maps, stderr=full)
    else:
        reads, writes = os.pipe() if reader == "pipe" else pty.openpty()
        out = writes if reader == "pipe" else None
        run = started(*arguments, cwd=maps, stdout=out, stderr=writes)
        os.close(writes)
        os.read(reads, 1)
        os.close(reads)
    assert run.wait(60) == 0
    assert len(list(maps.glob(written))) == FRAMES
    if name == "estimate":
        assert (maps / "rolls.csv").read_bytes().count(b"\n") == FRAMES + 1


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--versions"], ["estimate", "--help"], ["estimate", "maps", "-q"]]
)
def test_a_reader_of_answers_who_has_left_ends_the_program_quietly(maps, arguments):
    done = without_reader(maps, arguments, "stdout")
    assert (done.returncode, done.stderr) == (0, "")


@NO_DISK
@pytest.mark.parametrize("arguments", [[], ["--version"], ["rig", "--help"], ["estimate", "maps", "-q"]])
def test_an_answer_that_meets_a_full_disk_is_told_in_words(maps, arguments):
    with Path("/dev/full").open("wb") as full:
        done = ended(command(*arguments), maps, stdout=full, timeout=60)
    said = "rollcli: standard output: cannot be written: no space left on device\n"
    assert (done.returncode, done.stderr) == (1, said)


def test_dev_stdout_is_standard_output_where_that_is_a_file_too(maps):
    with (maps / "rolls.csv").open("ab", buffering=0) as file:
        file.write(b"kept\n")
        ended(command("estimate", "maps", "-q", "-o", "/dev/stdout"), maps, stdout=file, timeout=60)
    assert (maps / "rolls.csv").read_bytes().count(b"\n") == FRAMES + 2


def test_an_error_keeps_its_status_when_nobody_reads_its_message(maps):
    assert without_reader(maps, ["estimate", "nothing"], "stderr").returncode == 2


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no SIGHUP")
def test_a_hangup_stops_a_run_as_sigterm_does_unless_it_is_ignored(maps):
    write_maps(maps / "maps", 60)
    line = ["estimate", "maps", "-o", "rolls.csv", "-v", "-j2"]
    default = partial(signal.signal, signal.SIGHUP, signal.SIG_DFL)  # the tests may run under nohup
    run = started(*line, cwd=maps, env=holding(maps, "frame2"), preexec_fn=default)
    wait_until((maps / "has-begun").exists)
    run.send_signal(signal.SIGHUP)
    (maps / "may-go-on").touch()
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "interrupted; continue with: rollcli estimate maps" in err
    ignore = partial(signal.signal, signal.SIGHUP, signal.SIG_IGN)
    ignored = started(*line, "--resume", cwd=maps, preexec_fn=ignore)
    ignored.send_signal(signal.SIGHUP)
    ignored.communicate(timeout=60)
    assert ignored.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_the_run_is_one_line_and_status_130(maps, number):
    run = started("estimate", "-", cwd=maps, stdin=subprocess.PIPE)
    wait_until_it_reads(run)
    run.send_signal(number)
    _, err = run.communicate(timeout=60)
    assert (run.returncode, err) == (130, "rollcli: interrupted\n")


def wait_until_it_reads(run):
    """Until the program sleeps in its read of stdin: by then it has set up its signals."""
    wchan = Path(f"/proc/{run.pid}/wchan")
    if not wchan.exists():
        pytest.skip("this system does not tell what a process waits for")
    while "pipe" not in wchan.read_text():
        assert run.poll() is None


def test_file_names_neither_forge_lines_nor_command_the_terminal(tmp_path):
    name = "a\x1b[2J\x07\nrollcli: all is well\r.png"
    (tmp_path / name).write_bytes(b"no map at all")
    done = ended(command("estimate", ".", "-v"), tmp_path, text=False, timeout=60)
    assert done.returncode == 3
    assert not any(byte in done.stderr for byte in b"\x1b\x07\r")
    assert b"\nrollcli: all is well" not in done.stderr
    refused = ended(command("estimate", f"no{name}"), tmp_path, text=False, timeout=60)
    assert refused.stderr.count(b"\n") == 1
    assert b"\x1b" not in refused.stderr


def test_a_terminal_sees_a_progress_bar(maps):
    main, other = pty.openpty()
    with started("estimate", "maps", "-o", "rolls.csv", cwd=maps, stdout=other, stderr=other) as run:
        os.close(other)
        shown = b""
        while chunk := read(main):
            shown += chunk
    os.close(main)
    assert run.returncode == 0
    assert b"/8 [" in shown
    assert b"8 frames: 8 ok" in shown


def read(terminal):
    try:
        return os.read(terminal, 4096)
    except OSError:  # Linux's way to say that the other end is closed
        return b""
