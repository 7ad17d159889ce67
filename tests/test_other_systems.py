"""What differs on Windows and macOS, as far as it can be shown on any system.

A run gets by without what POSIX alone has, names of Windows are paths and no URLs, lines may end
in CR LF, and paths may be long. Several workers are spawned everywhere.
"""

import os
from pathlib import PureWindowsPath

import pytest

from rollcli import errors
from rollcli.files import naming
from rollcli.files.stores.locations import is_url, public_name
from tests.run_cli import contents, keep_rows, python, rollcli, write_maps
from tests.slow import mostly_slow

# a process like one of Windows: no fork, no flock, no signals but two, no flags of open that POSIX alone has
WITHOUT_POSIX = """
import os, signal, sys, types
from unittest import mock
for name in ("fork", "forkpty", "kill", "killpg", "mkfifo", "sched_getaffinity", "geteuid",
             "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_DIRECTORY"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGKILL", "SIGPIPE", "SIGSTOP"):
    if hasattr(signal, name):
        delattr(signal, name)
system, sys.modules["fcntl"] = sys.platform, None
sys.modules["msvcrt"] = types.SimpleNamespace(LK_NBLCK=2, locking=lambda number, mode, size: None)
sys.platform = "win32"
import rollcli.files.locking
rollcli.files.locking._FAR_BYTE = 2**30
sys.platform = system
from rollcli.cli.main import main
main(prog_name="rollcli")
"""


def without_posix(*arguments, cwd):
    return python(WITHOUT_POSIX, *arguments, cwd=cwd, timeout=120)


@pytest.mark.parametrize("jobs", mostly_slow(["1", "2"], "1"))
def test_a_run_needs_neither_fork_nor_flock_nor_signals_of_posix(tmp_path, jobs):
    write_maps(tmp_path / "maps", 3)
    line = ["estimate", "maps", "--derotated", "level", "-j", jobs]
    done = without_posix(*line, "-o", "rolls.csv", cwd=tmp_path)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    found = contents(tmp_path / "level"), (tmp_path / "rolls.csv").read_bytes()

    keep_rows(tmp_path / "rolls.csv", 1)
    done = without_posix(*line, "-o", "rolls.csv", "--resume", cwd=tmp_path)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert (contents(tmp_path / "level"), (tmp_path / "rolls.csv").read_bytes()) == found

    assert rollcli(*line, "-o", "rolls.csv", "--overwrite", cwd=tmp_path).status == 0
    assert (contents(tmp_path / "level"), (tmp_path / "rolls.csv").read_bytes()) == found


@pytest.mark.parametrize(
    "path", [PureWindowsPath("C:/maps/a.png"), PureWindowsPath("d:\\maps\\run 7\\a.png")]
)
def test_a_drive_letter_is_no_scheme(path):
    for text in (str(path), path.as_posix(), f"{path.drive}//maps/a.png", f"{path.drive}a.png"):
        assert not is_url(text)
        assert public_name(text) == text


def test_rows_name_files_with_slashes_where_the_system_has_backslashes(monkeypatch):
    monkeypatch.setattr(naming.os, "sep", "\\")
    assert naming.Input(str(PureWindowsPath("C:/maps/run7/a.png")), "a.png").name == "C:/maps/run7/a.png"


@pytest.mark.skipif(os.name == "nt", reason="Windows takes no such path unless long paths are on")
def test_paths_of_more_than_260_characters_are_paths(tmp_path):
    folder = "/".join(["a_long_name_of_a_folder_of_a_drive"] * 9)
    write_maps(tmp_path / folder, 2)
    out = f"{folder}/out"
    done = rollcli("estimate", folder, "-o", f"{out}/rolls.csv", "--derotated", f"{out}/level", cwd=tmp_path)
    assert done.status == 0, done.err
    assert len(folder) > 260
    assert sorted(contents(tmp_path / folder / "out" / "level")) == ["frame0.png", "frame1.png"]
    assert rollcli("report", f"{folder}/out/rolls.csv", "--svg", f"{folder}/slides", cwd=tmp_path).status == 0


def test_a_path_that_windows_does_not_take_is_told_so(monkeypatch):
    failed = FileNotFoundError(2, "No such file or directory")
    long, short = "/" + "x" * 300, "/x"
    monkeypatch.setattr(errors, "_ON_WINDOWS", True)
    assert "(Windows takes 232 characters" in str(errors.output_error(long, failed))
    assert str(errors.output_error(short, failed)) == "/x: cannot be written: no such file or directory"
    monkeypatch.setattr(errors, "_ON_WINDOWS", False)
    assert "Windows" not in str(errors.output_error(long, failed))
