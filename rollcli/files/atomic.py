"""Files that appear whole or not at all: written beside their target, then renamed onto it."""

import contextlib
import os
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from rollcli.errors import OutputError

_LONGEST_NAME = 240  # bytes; file systems allow 255 with what is added


def output_error(path: str | Path, error: OSError) -> OutputError:
    """One line for a write that failed, naming the target rather than the temporary file."""
    return OutputError(f"{path}: cannot be written: {(error.strerror or str(error)).lower()}")


@contextlib.contextmanager
def atomic_file(path: str | Path) -> Iterator[BinaryIO]:
    """Open a binary file that takes its name when the block ends, and vanishes when the block fails.

    Parameters
    ----------
    path : str or Path
        The target; parent folders are made. An existing file is replaced in one step.

    Yields
    ------
    BinaryIO
        The temporary file, in the target's folder so that the rename crosses no file system.

    Raises
    ------
    OutputError
        The target cannot be written (full disk, no permission, a folder of that name, ...).
    """
    target = Path(path)
    temporary = part_of(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise OutputError(f"{path}: cannot be written: is a folder")
        with _alone(temporary) as file:
            try:
                yield file
                file.close()
                temporary.replace(target)
            except BaseException:
                with contextlib.suppress(OSError):
                    temporary.unlink()
                raise
    except OSError as error:
        raise output_error(path, error) from error


@contextlib.contextmanager
def _alone(temporary: Path) -> Iterator[BinaryIO]:
    """The temporary file, empty; who writes the same target at this moment is waited for.

    A cluster may give a frame to a second worker while the first, given up as lost, is still writing.
    """
    flags = os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    while True:
        with os.fdopen(os.open(temporary, flags, 0o666), "wb") as file, _locked(file):
            if _is_still(temporary, file):
                file.truncate()
                yield file
                return


@contextlib.contextmanager
def _locked(file: BinaryIO) -> Iterator[None]:
    """Keep others from the file until the block ends, also when the file is closed before."""
    if sys.platform == "win32":  # which keeps others from replacing an open file anyway
        yield
        return
    import fcntl

    held = os.dup(file.fileno())
    try:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(held, fcntl.LOCK_EX)
        yield
    finally:
        os.close(held)


def _is_still(path: Path, file: BinaryIO) -> bool:
    """Whether the file has this name, and not its target's by now."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def part_of(target: Path) -> Path:
    """The temporary file of a target; not a random name: what a killed run leaves, the next takes over."""
    name = os.fsencode(target.name)
    short = target.name if len(name) <= _LONGEST_NAME else f"{zlib.crc32(name):08x}"
    return target.with_name(f".{short}.part")


def write_atomic(path: str | Path, data: bytes) -> None:
    """Write `data` to `path`, whole or not at all; see `atomic_file`."""
    with atomic_file(path) as file:
        file.write(data)
