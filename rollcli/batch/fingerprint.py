"""The fingerprint of a run's inputs, by which a resume sees whether they are still the same."""

import errno
import hashlib
import os
from collections.abc import Collection, Sequence
from typing import Any

from rollcli.files.existence import look_at
from rollcli.files.stores.locations import is_url
from rollcli.frames.frame import Frame

# what these errors say of a path, they say again the next time; others may pass, such as EIO
_LASTING = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG, errno.EACCES, errno.ELOOP, errno.EINVAL)


def fingerprint(frames: Sequence[Frame], unknown: Collection[str] = ()) -> dict[str, Any]:
    """Summarise the frames: how many, their names, and size and time of every file that they need.

    Parameters
    ----------
    frames : sequence of Frame
    unknown : collection of str
        Files to leave out.

    Returns
    -------
    dict
        "frames", "names" and "files"; "unknown" lists the files that were left out, and those whose size
        could not be read, if there are any.
    """
    names, files = hashlib.sha256(), hashlib.sha256()
    shared: dict[str, bytes | None] = {}  # a mask for all frames is looked at once
    left_out = set(unknown)
    for frame in frames:
        names.update(os.fsencode(f"{frame.file}\0{frame.right_file}\0"))
        for path in frame.reads():
            if path in left_out:
                continue
            state = shared[path] if path in shared else _state(path)
            if path == frame.mask:
                shared[path] = state
            if state is None:
                left_out.add(path)
            else:
                files.update(state)
    found = {"frames": len(frames), "names": names.hexdigest(), "files": files.hexdigest()}
    return {**found, "unknown": sorted(left_out)} if left_out else found


def changed_input(frames: Sequence[Frame], since_ns: int) -> str | None:
    """Find the first file that is missing, or newer than a time in nanoseconds."""
    for path in (path for frame in frames for path in frame.reads()):
        if is_url(path):
            continue
        try:
            if look_at(path).st_mtime_ns > since_ns:
                return path
        except (OSError, ValueError):
            return path
    return None


def _state(path: str) -> bytes | None:
    """Summarise a file; None when the system fails to look at it."""
    if is_url(path):  # asking for the state of each object would take as long as reading it
        return b"url\0"
    try:
        found = look_at(path)
    except ValueError:  # no file can have this name
        return b"missing\0"
    except OSError as error:
        return b"missing\0" if error.errno in _LASTING else None
    return b"%d %d\0" % (found.st_size, found.st_mtime_ns)
