"""One run at a time writes a result, and only a run of the same kind continues it."""

import contextlib
import errno
import json
import os
import stat
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from rollcli.errors import UsageError, writing
from rollcli.messages import say

# a killed run's workers end a moment after it; a lock held longer than this belongs to a run that lives
_PATIENCE_S = 2.0
_POLL_S = 0.05

_LOCK, _BUSY = ".lock", "another run is writing this result"


if sys.platform == "win32":
    import msvcrt

    _FAR_BYTE = 2**62  # locked bytes cannot be read by others: take one that no result reaches

    def _try_lock(descriptor: int) -> bool | None:
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

    _WITHOUT_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)

    def _try_lock(descriptor: int) -> bool | None:
        """Return whether the lock is taken now; None where the file system has no locks."""
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            return None if error.errno in _WITHOUT_LOCKS else False
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
            # where there are no locks, nobody can hold one
            yield stat.S_ISREG(os.fstat(descriptor).st_mode) and _try_lock(descriptor) is not False
        finally:
            os.close(descriptor)


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
    if take_lock(descriptor, name):
        yield
    else:
        say(f"{name}: its file system has no locks; {name}{_LOCK} keeps other runs away")
        with _lock_file(name):
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
    with contextlib.ExitStack() as held:
        with writing(name):
            Path(name).mkdir(parents=True, exist_ok=True)
            descriptor = None if sys.platform == "win32" else os.open(name, os.O_RDONLY | os.O_CLOEXEC)
        if descriptor is not None:
            held.callback(os.close, descriptor)
            held.enter_context(locked(descriptor, name))
        yield


@contextlib.contextmanager
def _lock_file(name: str) -> Iterator[None]:
    """Make a file, which such file systems do in one step if there is none, and remove it at the end.

    A run that is killed leaves it: whether it was another machine's, only the user can tell.
    """
    path = Path(f"{name}{_LOCK}")
    with writing(path):
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            raise UsageError(f"{name}: {_BUSY}; if none is, one was killed: remove {path}") from None
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def take_lock(descriptor: int, name: str) -> bool:
    """Take the lock on an open file, which lasts until the file is closed; false where there are no locks.

    Raises
    ------
    UsageError
        Another run holds it.
    """
    give_up = time.monotonic() + _PATIENCE_S
    while (taken := _try_lock(descriptor)) is False:
        if time.monotonic() > give_up:
            raise UsageError(f"{name}: {_BUSY}; wait for it, or give another --output")
        time.sleep(_POLL_S)
    return bool(taken)


def exists_already(name: str) -> UsageError:
    """Make the error that refuses to touch a result unless told how."""
    return UsageError(f"{name}: exists already; give --resume to continue it or --overwrite to replace it")


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
            yield f"--{key} was {given_as(options_was.get(key))}, is now {given_as(options_now.get(key))}"


def given_as(value: Any) -> str:
    """Say how an option was given, by its value in a record."""
    if value is True:  # of an option that is given alone
        return "given"
    return "not given" if value is False or value in (None, []) else str(value)
