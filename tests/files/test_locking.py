"""One run at a time on one result, also where the file system has no locks, and on Windows."""

import errno
import importlib.util
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rollcli.errors import UsageError
from rollcli.files import locking

fcntl = pytest.importorskip("fcntl", reason="this system has no flock")


@pytest.fixture
def result(tmp_path):
    """An open result, as (descriptor, name)."""
    path = tmp_path / "rolls.csv"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    yield descriptor, str(path)
    os.close(descriptor)


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(locking, "_PATIENCE_S", 0.0)


@pytest.fixture
def without_locks(monkeypatch):
    """A file system that has none."""

    def fail(descriptor, operation):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", fail)


def test_a_second_run_is_refused(result, impatient):
    descriptor, name = result
    other = os.open(name, os.O_RDWR)
    refused = pytest.raises(UsageError, match="another run is writing this result")
    try:
        with locking.locked(descriptor, name), refused, locking.locked(other, name):
            pass
    finally:
        os.close(other)


def test_where_locks_are_there_is_no_lock_file_and_nothing_is_said(result, capsys):
    descriptor, name = result

    with locking.locked(descriptor, name):
        assert [path.name for path in Path(name).parent.iterdir()] == ["rolls.csv"]

    assert capsys.readouterr().err == ""


def test_without_locks_a_lock_file_keeps_a_second_run_away_and_that_is_said(result, without_locks, capsys):
    descriptor, name = result

    with locking.locked(descriptor, name):
        assert Path(f"{name}.lock").exists()
        with pytest.raises(UsageError, match=r"remove .*rolls.csv.lock"), locking.locked(descriptor, name):
            pass
        assert Path(f"{name}.lock").exists()

    assert not Path(f"{name}.lock").exists()
    assert (
        f"{name}: its file system has no locks; {name}.lock keeps other runs away\n"
        in capsys.readouterr().err
    )


def test_the_lock_file_of_a_run_that_was_killed_here_is_replaced(result, without_locks):
    descriptor, name = result
    child = os.fork()
    if child == 0:
        holder = locking.locked(descriptor, name)
        holder.__enter__()
        os._exit(9)
    os.waitpid(child, 0)
    assert Path(f"{name}.lock").exists()

    with locking.locked(descriptor, name):
        assert Path(f"{name}.lock").exists()


@pytest.mark.parametrize("owner", ["1 another-machine\n", "nonsense", ""])
def test_the_lock_file_of_a_run_elsewhere_is_left_alone(result, without_locks, owner):
    descriptor, name = result
    Path(f"{name}.lock").write_text(owner)

    with pytest.raises(UsageError, match="another run is writing"), locking.locked(descriptor, name):
        pass

    assert Path(f"{name}.lock").exists()


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
