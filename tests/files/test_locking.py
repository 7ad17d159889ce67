"""One run at a time on one result, also where the file system has no locks, and on Windows."""

import errno
import importlib.util
import os
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from rollcli.errors import OutputError, UsageError
from rollcli.files import locking
from tests.run_cli import error_of

fcntl = pytest.importorskip("fcntl", reason="this system has no flock")


@pytest.fixture
def result(tmp_path):
    """An open result, as (descriptor, name)."""
    path = tmp_path / "rolls.csv"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    yield descriptor, str(path)
    os.close(descriptor)


@pytest.fixture
def without_locks(monkeypatch):
    """A file system that has none."""
    monkeypatch.setattr(fcntl, "flock", Mock(side_effect=OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))))


def test_without_locks_a_lock_file_keeps_a_second_run_away_and_that_is_said(result, without_locks, capsys):
    descriptor, name = result
    left = Path(f"{name}.lock")
    said = f"{name}: another run is writing this result; if none is, one was killed: remove {left}"

    with locking.locked(descriptor, name):
        assert error_of(UsageError, locking.locked(descriptor, name).__enter__) == said
        assert left.exists()  # that of a killed run, too, is left for the user to remove

    assert not left.exists()
    told = f"{name}: its file system has no locks; {left} keeps other runs away\n"
    assert told in capsys.readouterr().err
    with locking.locked(descriptor, name):
        assert left.exists()


def test_on_windows_a_result_is_read_from_its_start_once_it_is_locked(result, monkeypatch):
    descriptor, name = result
    os.write(descriptor, b"file,status,roll_deg\n")
    places = []
    fake = SimpleNamespace(
        LK_NBLCK=2, locking=lambda number, mode, size: places.append(os.lseek(number, 0, os.SEEK_CUR))
    )
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    monkeypatch.setattr(sys, "platform", "win32")
    spec = importlib.util.spec_from_file_location("windows_locking", locking.__file__)
    windows = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(windows)

    monkeypatch.setattr(windows, "_FAR_BYTE", 2**30)  # as far as file systems here go

    with windows.locked(descriptor, name):
        assert os.read(descriptor, 4) == b"file"

    assert places == [2**30]


def test_a_lock_is_waited_for_as_long_as_the_workers_of_a_killed_run_take_to_end(result, monkeypatch):
    descriptor, name = result
    other = os.open(name, os.O_RDWR)
    fcntl.flock(other, fcntl.LOCK_EX)
    now, slept = [100.0], []

    def sleep(seconds):
        slept.append(seconds)
        now[0] += seconds

    monkeypatch.setattr(locking, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=sleep))
    try:
        with pytest.raises(UsageError, match="another run"), locking.locked(descriptor, name):
            pass
        assert 2.0 <= sum(slept) <= 2.2
        slept.clear()

        def let_go(seconds):
            slept.append(seconds)
            fcntl.flock(other, fcntl.LOCK_UN)

        monkeypatch.setattr(locking.time, "sleep", let_go)
        with locking.locked(descriptor, name):
            assert len(slept) == 1
    finally:
        os.close(other)


def test_a_lock_file_that_cannot_be_made_is_named(tmp_path, without_locks, result):
    descriptor, _ = result
    name = str(tmp_path / "none" / "rolls.csv")
    said = error_of(OutputError, locking.locked(descriptor, name).__enter__)
    assert said == f"{name}.lock: cannot be written: no such file or directory"


def test_only_a_regular_file_that_nobody_writes_is_abandoned(tmp_path):
    path = tmp_path / "part"
    path.write_bytes(b"")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(path)
    with locking.nobody_writes(str(path)) as abandoned:
        assert abandoned
    with locking.nobody_writes(str(tmp_path / "pipe")) as abandoned:
        assert not abandoned
    with pytest.raises(OSError, match="symbolic links"), locking.nobody_writes(str(tmp_path / "link")):
        pass
    with path.open("wb") as file, locking.being_written(file):
        file.close()  # it is held until the block ends
        with locking.nobody_writes(str(path)) as abandoned:
            assert not abandoned
    with locking.nobody_writes(str(path)) as abandoned:
        assert abandoned
