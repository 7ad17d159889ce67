"""Files that appear whole or not at all: written beside their target, then renamed onto it.

The temporary file is `.NAME.RANDOM.part`. Its name begins with the target's, so that the next run of the same
outputs finds what a killed one left, and nobody can guess the rest: a link, pipe or file put in its way
beforehand is never opened. A link in the target's own place is replaced; what it points to stays as it is.
"""

import contextlib
import errno
import os
import posixpath
import re
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from rollcli.errors import OutputError
from rollcli.files.durable import sync_file, sync_names
from rollcli.files.locking import being_written, nobody_writes
from rollcli.files.stores.locations import is_url

_LONGEST_NAME = 225  # bytes; file systems allow 255 with what is added
_ON_WINDOWS = os.name == "nt"
_WINDOWS_PATH = 259 - 27  # characters of a whole path, less what the temporary file's name adds
_RANDOM_BYTES = 8
_NO_LINKS = (errno.EPERM, errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)  # of FAT, say
_PART = re.compile(rf"\.(.+)\.[0-9a-f]{{{2 * _RANDOM_BYTES}}}\.part", re.DOTALL)


class NameTakenError(OutputError):
    """There is something of this name already, which must not be replaced."""


def output_error(path: str | Path, error: OSError) -> OutputError:
    """Make the error of a failed write: one line that names the target, not the temporary file."""
    reason = (error.strerror or str(error)).lower()
    if _ON_WINDOWS and len(str(Path(path).absolute())) > _WINDOWS_PATH:
        reason += f" (Windows takes {_WINDOWS_PATH} characters unless its long paths are switched on)"
    return OutputError(f"{path}: cannot be written: {reason}")


@contextlib.contextmanager
def atomic_file(path: str | Path, *, durable: bool = False, replaces: bool = True) -> Iterator[BinaryIO]:
    """Open a binary file that takes its name when the block ends, and vanishes when the block fails.

    Parameters
    ----------
    path : str or Path
        The target; parent folders are made. An existing file or link is replaced in one step.
    durable : bool
        Survives a power cut once the block has ended. For many files `durable.sync_files` is cheaper.
    replaces : bool
        Whether an existing file or link is replaced; otherwise it stays as it is.

    Yields
    ------
    BinaryIO
        The temporary file, in the target's folder so that the rename crosses no file system.

    Raises
    ------
    OutputError
        The target cannot be written (full disk, no permission, a folder of that name, ...).
    NameTakenError
        There is something of this name, at the moment when the block ends, and `replaces` is false.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise OutputError(f"{path}: cannot be written: is a folder")
        with _new_part(target) as (temporary, file):
            try:
                yield file
                if durable:
                    sync_file(file)
                file.close()
                if replaces:
                    temporary.replace(target)
                else:
                    _take_free_name(temporary, target)
            except BaseException:
                with contextlib.suppress(OSError):
                    file.close()  # Windows removes no open file
                with contextlib.suppress(OSError):
                    temporary.unlink()
                raise
        if durable:
            sync_names([target])
    except OSError as error:
        raise output_error(path, error) from error


def write_atomic(path: str | Path, data: bytes, *, durable: bool = False, replaces: bool = True) -> None:
    """Write `data` to `path`, whole or not at all; see `atomic_file`."""
    with atomic_file(path, durable=durable, replaces=replaces) as file:
        file.write(data)


def _take_free_name(temporary: Path, target: Path) -> None:
    """Give a file its name unless there is something of that name, be it a link to nothing.

    Raises
    ------
    NameTakenError
        There is.
    """
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise NameTakenError(f"{target}: exists already") from None
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        if os.path.lexists(target):  # not in one step with the next line: the best that such a disk can do
            raise NameTakenError(f"{target}: exists already") from None
        temporary.replace(target)
    else:
        temporary.unlink()


def mark_path(path: str) -> str:
    """Name a file that says something of another one for a while, and is removed with its leftovers."""
    folder, name = posixpath.split(path)
    return posixpath.join(folder, f".{_marker(name)}.{'0' * (2 * _RANDOM_BYTES)}.part")


def remove_leftovers(paths: Iterable[str | Path]) -> None:
    """Remove the temporary files that killed processes left beside these targets, and no others.

    Each folder is listed once. A file that a live process is still writing is left alone, and so is whatever
    is no regular file.
    """
    listed: dict[str, dict[str, list[str]]] = {}
    for path in paths:
        if is_url(str(path)):  # objects are whole or not there
            continue
        folder, name = os.path.split(path)
        if folder not in listed:
            listed[folder] = _parts_in(folder)
        if listed[folder]:
            for part in listed[folder].pop(_marker(name), ()):
                _remove_abandoned(part)


@contextlib.contextmanager
def _new_part(target: Path) -> Iterator[tuple[Path, BinaryIO]]:
    """Make a temporary file that did not exist, and hold it until the block ends."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL  # which follows no link either
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    while True:
        path = target.with_name(f".{_marker(target.name)}.{os.urandom(_RANDOM_BYTES).hex()}.part")
        try:
            descriptor = os.open(path, flags, 0o666)
        except FileExistsError:
            continue
        with os.fdopen(descriptor, "wb") as file, being_written(file):
            if os.fstat(descriptor).st_nlink:  # not removed as a leftover in the moment before it was held
                yield path, file
                return


def _marker(name: str) -> str:
    """Make the part of a temporary file's name that identifies its target."""
    data = os.fsencode(name)
    return name if len(data) <= _LONGEST_NAME else f"{zlib.crc32(data):08x}"


def _parts_in(folder: str) -> dict[str, list[str]]:
    """List the temporary files in a folder, by what identifies their targets."""
    found: dict[str, list[str]] = {}
    with contextlib.suppress(OSError), os.scandir(folder or ".") as entries:
        for entry in entries:
            if match := _PART.fullmatch(entry.name):
                found.setdefault(match[1], []).append(entry.path)
    return found


def _remove_abandoned(path: str) -> None:
    """Remove a temporary file, unless a process is writing it or it is no regular file."""
    with contextlib.suppress(OSError), nobody_writes(path) as abandoned:
        if abandoned:
            Path(path).unlink()
