"""Files that survive a power cut: their bytes and their names forced to the disk, in groups.

A rename alone makes a file whole or absent for other processes, but after a power cut a file system that
writes late may show the new name with no bytes. Forcing each file by itself costs a disk turn a file; many
files in a row share most of it, and a folder is forced once however many of its names are new.
"""

import contextlib
import errno
import os
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from rollcli.errors import OutputError

# a file system that cannot force a folder, or that Windows opens none
_NOT_FOR_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES, errno.EPERM)


def sync_files(paths: Iterable[str | Path]) -> None:
    """Force files that have been written, by this process or another, and their names to the disk.

    Parameters
    ----------
    paths : iterable of str or Path
        Whole files, under their final names. One that is gone by now is left out.

    Raises
    ------
    OutputError
        The disk fails to take one; it is named.
    """
    every = [Path(path) for path in paths]
    for path in every:
        try:
            with contextlib.suppress(FileNotFoundError), path.open("rb") as file:
                os.fsync(file.fileno())
        except OSError as error:
            raise _not_durable(path, error) from error
    sync_names(every)


def sync_names(paths: Iterable[Path]) -> None:
    """Force the names of files to the disk, and those of the folders above them; each folder once."""
    folders: dict[Path, None] = {}
    for path in paths:
        for folder in path.absolute().parents:  # those above may be new as well
            if folder in folders:
                break
            folders[folder] = None
            if folder.is_mount():
                break
    for folder in folders:
        try:
            _sync_folder(folder)
        except OSError as error:
            if error.errno not in _NOT_FOR_FOLDERS:
                raise _not_durable(folder, error) from error


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_file(file: BinaryIO) -> None:
    """Force what was written to an open file to the disk."""
    file.flush()
    os.fsync(file.fileno())


def _not_durable(path: Path, error: OSError) -> OutputError:
    return OutputError(f"{path}: cannot be forced to the disk: {(error.strerror or str(error)).lower()}")
