"""Lock a result for one run; the system releases the lock when its holders end, however they end."""

import contextlib
import errno
import os
import stat
import sys
import time
from collections.abc import Iterator
from typing import BinaryIO

from rollcli.errors import UsageError

# a killed run's workers end a moment after it; a lock held longer than this belongs to a run that lives
_PATIENCE_S = 2.0
_POLL_S = 0.05

if sys.platform == "win32":
    import msvcrt

    _FAR_BYTE = 2**62  # locked bytes cannot be read by others: take one that no result reaches

    def _try_lock(descriptor: int) -> bool:
        os.lseek(descriptor, _FAR_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
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
            # a file system without locks: better to run unguarded than not at all
            return error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)
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
            yield stat.S_ISREG(os.fstat(descriptor).st_mode) and _try_lock(descriptor)
        finally:
            os.close(descriptor)


def lock(descriptor: int, name: str) -> None:
    """Take the lock on an open file.

    Raises
    ------
    UsageError
        Another run holds it.
    """
    give_up = time.monotonic() + _PATIENCE_S
    while not _try_lock(descriptor):
        if time.monotonic() > give_up:
            raise UsageError(
                f"{name}: another run is writing this result; wait for it, or give another --output"
            )
        time.sleep(_POLL_S)
