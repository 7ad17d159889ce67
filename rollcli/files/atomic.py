"""Files that appear whole or not at all: written beside their target, synced, then renamed onto it."""

import contextlib
import errno
import os
import posixpath
import re
import stat
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import BinaryIO, TypeVar

from rollcli.errors import OutputError, cause_of, writing
from rollcli.files.locking import being_written, nobody_writes
from rollcli.files.naming import gathered
from rollcli.files.stores.locations import is_url

Thing = TypeVar("Thing")
Done = TypeVar("Done")


def is_folder(path: str | Path) -> bool:
    """Tell whether this is a folder, or a link to one."""
    return stat.S_ISDIR(mode_of(path))


def is_file(path: str | Path) -> bool:
    """Tell whether this is a regular file, or a link to one."""
    return stat.S_ISREG(mode_of(path))


def is_there(path: str | Path) -> bool:
    """Tell whether this is anything at all; a link to nothing is not."""
    return mode_of(path) != 0


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


def mode_of(path: str | Path, unseen: int = 0) -> int:
    """Return kind and rights of what is there; `unseen` of nothing, and of what cannot be looked at."""
    try:
        return look_at(path).st_mode
    except (OSError, ValueError):
        return unseen


# 64 files of 300 kB take 0.3 ms each on ext4, and 4 ms each by one thread; 10,000 small objects, of 50 ms
# each, half a minute
_THREADS = 16
# a file system that cannot force a folder, or that Windows opens none
_NOT_FOR_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES, errno.EPERM)


def sync_files(paths: Iterable[str | Path], named: set[Path] | None = None) -> None:
    """Force files that have been written, by this process or another, and their names to the disk.

    Parameters
    ----------
    paths : iterable of str or Path
        Whole files, under their final names. One that is gone by now is left out.
    named : set of Path, optional
        Folders whose own names are on the disk, from earlier calls; those of this call are added.

    Raises
    ------
    OutputError
        The disk fails to take one; it is named.
    """
    every = [Path(path) for path in paths]
    # Windows forces only what is open for writing
    flags = os.O_RDWR if os.name == "nt" else os.O_RDONLY
    in_threads(partial(_sync, flags, (errno.ENOENT,)), every)
    sync_names(every, named)


def sync_names(paths: Iterable[Path], named: set[Path] | None = None) -> None:
    """Force the names of files to the disk, and those of the folders above them, unless they are `named`."""
    named = set() if named is None else named
    folders: dict[Path, None] = {}
    for path in paths:
        for folder in path.absolute().parents:  # those above may be new as well
            if folder in folders:
                break
            folders[folder] = None
            if folder in named or os.path.ismount(folder):  # Path.is_mount raises where looking fails
                break
    in_threads(partial(_sync, os.O_RDONLY, _NOT_FOR_FOLDERS), list(folders))
    named.update(folders)


def in_threads(do: Callable[[Thing], Done], things: Sequence[Thing]) -> list[Done]:
    """Return what `do`, which may be done twice, makes of each thing, in their order, in a few threads.

    Waiting, for the disk or the network, takes longer than computing. The first error that `do` raises is
    raised here, once all have ended.
    """
    from concurrent.futures import ThreadPoolExecutor  # takes as long to load as all of this

    try:
        with ThreadPoolExecutor(max(1, min(_THREADS, len(things)))) as pool:
            return list(pool.map(do, things))
    except RuntimeError:  # no memory for a further thread
        return list(map(do, things))


def _sync(flags: int, harmless: Sequence[int], path: Path) -> None:
    try:
        descriptor = os.open(path, flags)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno not in harmless:
            raise OutputError(f"{path}: cannot be forced to the disk: {cause_of(error)}") from error


_LONGEST_NAME = 225  # bytes; file systems allow 255 with what is added
_RANDOM_BYTES = 8
_NO_LINKS = (errno.EPERM, errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)  # of FAT, say
_PART = re.compile(rf"\.(.+)\.[0-9a-f]{{{2 * _RANDOM_BYTES}}}\.part", re.DOTALL)


class NameTakenError(OutputError):
    """There is something of this name already, which must not be replaced."""


@contextlib.contextmanager
def atomic_file(path: str | Path, *, durable: bool = False, replaces: bool = True) -> Iterator[BinaryIO]:
    """Open a binary file that takes its name when the block ends, and vanishes when the block fails.

    Parameters
    ----------
    path : str or Path
        The target; parent folders are made. An existing file or link is replaced in one step.
    durable : bool
        Survives a power cut once the block has ended. For many files `sync_files` is cheaper.
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
    with writing(path):
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise OutputError(f"{path}: cannot be written: is a folder")
        with _new_part(target) as (temporary, file):
            yield file
            if durable:
                file.flush()
                os.fsync(file.fileno())
            file.close()
            if replaces:
                temporary.replace(target)
            else:
                _take_free_name(temporary, target)
        if durable:
            sync_names([target])


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
    except OSError as error:
        if error.errno not in (errno.EEXIST, *_NO_LINKS):
            raise
        # without links not in one step with the next line: the best that such a disk can do
        if error.errno == errno.EEXIST or os.path.lexists(target):
            raise NameTakenError(f"{target}: exists already") from None
        temporary.replace(target)


def mark_path(path: str) -> str:
    """Name a file that says something of another one for a while, and is removed with its leftovers."""
    folder, name = posixpath.split(path)
    return posixpath.join(folder, f".{_marker(name)}.{'0' * (2 * _RANDOM_BYTES)}.part")


def remove_leftovers(paths: Iterable[str | Path]) -> None:
    """Remove the temporary files that killed processes left beside these targets, and no others.

    Each folder is listed once. A file that a live process is still writing is left alone, and so is whatever
    is no regular file.
    """
    parts_in = cache(_parts_in)
    for path in paths:
        if is_url(str(path)):  # objects are whole or not there
            continue
        folder, name = os.path.split(path)
        for part in parts_in(folder).pop(_marker(name), ()):
            with contextlib.suppress(OSError), nobody_writes(part) as abandoned:
                if abandoned:
                    Path(part).unlink()


@contextlib.contextmanager
def _new_part(target: Path) -> Iterator[tuple[Path, BinaryIO]]:
    """Make a temporary file that did not exist, and hold it until the block ends, and remove what is left."""
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
                try:
                    yield path, file
                finally:
                    with contextlib.suppress(OSError):
                        file.close()  # Windows removes no open file
                    with contextlib.suppress(OSError):
                        path.unlink()
                return


def _marker(name: str) -> str:
    """Make the part of a temporary file's name that identifies its target."""
    data = os.fsencode(name)
    return name if len(data) <= _LONGEST_NAME else f"{zlib.crc32(data):08x}"


def _parts_in(folder: str) -> dict[str, list[str]]:
    """List the temporary files in a folder, by what identifies their targets."""
    with contextlib.suppress(OSError), os.scandir(folder or ".") as entries:
        parts = ((_PART.fullmatch(entry.name), entry.path) for entry in entries)
        return gathered((match[1], path) for match, path in parts if match)
    return {}
