"""Ask what a path is. Nothing is raised: a path that the system refuses to look at is not there."""

import errno
import os
import stat
from pathlib import Path


def is_folder(path: str | Path) -> bool:
    """Tell whether this is a folder, or a link to one."""
    return stat.S_ISDIR(_mode(path))


def is_file(path: str | Path) -> bool:
    """Tell whether this is a regular file, or a link to one."""
    return stat.S_ISREG(_mode(path))


def is_there(path: str | Path) -> bool:
    """Tell whether this is anything at all; a link to nothing is not."""
    return _mode(path) != 0


def is_mount(path: str | Path) -> bool:
    """Tell whether another file system begins at this folder."""
    return os.path.ismount(path)  # Path.is_mount raises where the system fails to look


def look_at(path: str | Path) -> os.stat_result:
    """Ask the system for size, kind and time of a file; an error of the disk may pass, so it is asked twice.

    Raises
    ------
    OSError
        The system refuses, or fails twice.
    ValueError
        No file can have this name.
    """
    try:
        return os.stat(path)  # noqa: PTH116 (a path of text is not worth a Path)
    except OSError as error:
        if error.errno != errno.EIO:
            raise
    return os.stat(path)  # noqa: PTH116


def _mode(path: str | Path) -> int:
    """Return kind and rights of what is there; 0 where nothing is."""
    try:
        return look_at(path).st_mode
    except (OSError, ValueError):
        return 0
