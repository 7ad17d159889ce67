"""One run at a time on one result: a lock that the system lets go when its holders end, however they end."""

import errno
import sys
import time

from rollcli.errors import UsageError

# a killed run's workers end a moment after it; a lock held longer than this belongs to a run that lives
_PATIENCE_S = 2.0
_POLL_S = 0.05

if sys.platform == "win32":
    import msvcrt

    _FAR_BYTE = 2**62  # locked bytes cannot be read by others: take one that no result reaches

    def _try_lock(descriptor: int) -> bool:
        import os

        os.lseek(descriptor, _FAR_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

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
