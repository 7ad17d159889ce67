"""One run at a time writes a result, and only a run of the same kind continues it."""

import contextlib
import errno
import json
import os
import platform
import stat
import sys
import time
import uuid
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from rollcli.errors import OutputError, UsageError, cause_of
from rollcli.messages import say

# a killed run's workers end a moment after it; a lock held longer than this belongs to a run that lives
_PATIENCE_S = 2.0
_POLL_S = 0.05

_LOCK, _BREAK = ".lock", ".break"


class _NoLocksError(Exception):
    """The file system has no locks."""


if sys.platform == "win32":
    import msvcrt

    _FAR_BYTE = 2**62  # locked bytes cannot be read by others: take one that no result reaches

    def _try_lock(descriptor: int) -> bool:
        os.lseek(descriptor, _FAR_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            os.lseek(descriptor, 0, os.SEEK_SET)  # what is there is read from its start
        return True

    @contextlib.contextmanager
    def being_written(file: BinaryIO) -> Iterator[None]:
        """Do nothing: Windows keeps others from removing an open file."""
        yield

    @contextlib.contextmanager
    def nobody_writes(path: str) -> Iterator[bool]:
        """Yield whether the path is a regular file."""
        yield stat.S_ISREG(os.lstat(path).st_mode)

else:
    import fcntl

    def _try_lock(descriptor: int) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            if error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS):
                raise _NoLocksError from error
            return False
        return True

    @contextlib.contextmanager
    def being_written(file: BinaryIO) -> Iterator[None]:
        """Mark a file as being written until the block ends, also when it is closed before."""
        held = os.dup(file.fileno())
        try:
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(held, fcntl.LOCK_EX)
            yield
        finally:
            os.close(held)

    @contextlib.contextmanager
    def nobody_writes(path: str) -> Iterator[bool]:
        """Yield whether the path is a regular file that no live process is writing; a link is none."""
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            yield stat.S_ISREG(os.fstat(descriptor).st_mode) and _is_free(descriptor)
        finally:
            os.close(descriptor)

    def _is_free(descriptor: int) -> bool:
        try:
            return _try_lock(descriptor)
        except _NoLocksError:  # nobody can hold it
            return True


@contextlib.contextmanager
def locked(descriptor: int, name: str) -> Iterator[None]:
    """Hold the lock on an open file, or a lock file where the file system has no locks.

    A process that shares the descriptor holds the lock as well; the lock file is held by this one alone.

    Raises
    ------
    UsageError
        Another run holds it.
    OutputError
        The lock file cannot be made.
    """
    try:
        take_lock(descriptor, name)
    except _NoLocksError:
        say(f"{name}: its file system has no locks; {name}{_LOCK} keeps other runs away")
        with _lock_file(name):
            yield
    else:
        yield


@contextlib.contextmanager
def locked_folder(name: str) -> Iterator[None]:
    """Make a folder if there is none, and hold the lock on it; not on Windows, where none can be opened.

    Raises
    ------
    UsageError
        Another run holds it.
    OutputError
        The folder cannot be made.
    """
    try:
        Path(name).mkdir(parents=True, exist_ok=True)
        descriptor = None if sys.platform == "win32" else os.open(name, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise OutputError(f"{name}: cannot be written: {cause_of(error)}") from error
    if descriptor is None:
        yield
        return
    try:
        with locked(descriptor, name):
            yield
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def _lock_file(name: str) -> Iterator[None]:
    """Make a file that says who writes a result; that of a run on this machine that has ended is replaced.

    Such file systems make a file that is not there in one step, and rename in one step, but compare nothing.
    Of those that find the lock of an ended run, the one that makes the file `.lock.break` may look again
    and rename its own onto it: removing the old one first let two of them both win. (Refusing such file
    systems would keep their users from working at all.)
    """
    path = Path(f"{name}{_LOCK}")
    owner = f"{os.getpid()} {platform.node()}\n{uuid.uuid4().hex}\n"
    try:
        if not _made(path, owner) and not (_has_ended(path) and _replaced(path, owner)):
            raise UsageError(
                f"{name}: another run is writing this result; if none is, one was killed: remove {path}*"
            )
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {cause_of(error)}") from error
    try:
        yield
    finally:
        if _owner_in(path) == owner:
            path.unlink(missing_ok=True)


def _made(path: Path, owner: str) -> bool:
    """Make a file unless there is one; tell whether it was made."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(owner)
    except FileExistsError:
        return False
    return True


def _replaced(path: Path, owner: str) -> bool:
    """Rename a file of ours onto the lock file of an ended run; tell whether that was done."""
    ours = path.with_name(f"{path.name}{_BREAK}")
    if not _made(ours, owner):
        return False
    try:
        if not _has_ended(path):  # another one was here before
            return False
        ours.replace(path)
    finally:
        if _owner_in(ours) == owner:
            ours.unlink(missing_ok=True)
    return True


def _owner_in(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except (OSError, ValueError):
        return ""


def _has_ended(path: Path) -> bool:
    """Tell whether the run that made a lock file was on this machine and has ended."""
    try:
        process, _, machine = _owner_in(path).partition("\n")[0].partition(" ")
        if machine != platform.node() or sys.platform == "win32":
            return False
        os.kill(int(process), 0)
    except ProcessLookupError:
        return True
    except (OSError, ValueError, OverflowError):
        return False
    return False


def take_lock(descriptor: int, name: str) -> None:
    """Take the lock on an open file, which lasts until the file is closed, or say who has it.

    Raises
    ------
    UsageError
        Another run holds it.
    """
    give_up = time.monotonic() + _PATIENCE_S
    while not _try_lock(descriptor):
        if time.monotonic() > give_up:
            raise UsageError(
                f"{name}: another run is writing this result{_holders(descriptor)}; wait for it, or give "
                "another --output"
            )
        time.sleep(_POLL_S)


def _holders(descriptor: int) -> str:
    """Name the other processes that have a file open, where /proc tells.

    A worker holds the lock as well: one that was stopped keeps it when its run has ended.
    """
    wanted, holders = os.fstat(descriptor), []
    for link in Path("/proc").glob("[0-9]*/fd/*"):
        with contextlib.suppress(OSError):  # it has ended, or belongs to someone else
            if os.path.samestat(link.stat(), wanted):
                holders.append(int(link.parts[2]))
    others = sorted(set(holders) - {os.getpid()})
    if not others:
        return ""
    return f" (process{'es' if len(others) > 1 else ''} {', '.join(map(str, others))})"


def not_resumable(name: str, reason: str) -> UsageError:
    """Make the error that refuses to continue a result; its one line says what to do."""
    return UsageError(f"{name}: cannot be resumed: {reason}; --overwrite starts anew")


def differences(was: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield what differs between the version and the options of two records, in words."""
    if was["rollcli"] != now["rollcli"]:
        yield f"it was begun by rollcli {was['rollcli']}, this is {now['rollcli']}"
    options_was, options_now = was["options"], json.loads(json.dumps(now["options"]))
    for key in (*options_now, *(key for key in options_was if key not in options_now)):
        if options_was.get(key) != options_now.get(key):
            yield f"--{key} was {_shown(options_was.get(key))}, is now {_shown(options_now.get(key))}"


def _shown(value: Any) -> str:
    return "not given" if value in (None, []) else str(value)
