"""Compare what a run would write with what it reads and what exists; list both for --dry-run."""

import os
from collections.abc import Iterable, Sequence
from functools import lru_cache

from rollcli.errors import UsageError
from rollcli.files.stream import write_stdout
from rollcli.frames.frame import Frame


def check_one_owner(writes: Iterable[tuple[Frame, Iterable[str]]]) -> None:
    """Check that every file is written for one frame only.

    Parameters
    ----------
    writes : iterable of (Frame, paths)
        Each frame, and the files that are written for it.

    Raises
    ------
    UsageError
        Names both frames and the file.
    """
    owner: dict[str, str] = {}
    for frame, paths in writes:
        for path in paths:
            first = owner.setdefault(os.path.normcase(path), frame.file)
            if first is not frame.file:
                raise UsageError(
                    f"{first} and {frame.file} would both write {path}; run them apart, or name their common "
                    "folder with --recursive"
                )


def check_writes(reads: Sequence[str], writes: Sequence[str], *, overwrite: bool) -> None:
    """Check that no input is written and, unless `overwrite`, that no output exists.

    Raises
    ------
    UsageError
        Names the file.
    """
    check_inputs_are_kept(reads, writes)
    if not overwrite:
        check_nothing_is_there(writes)


def check_inputs_are_kept(reads: Sequence[str], writes: Iterable[str]) -> None:
    """Check that no input is written, however differently its path is spelled.

    Raises
    ------
    UsageError
        Names the file.
    """
    folders = {_real_folder(os.path.split(path)[0]) for path in reads}
    # only what is written beside an input can replace one
    written = {_place(path) for path in writes if _real_folder(os.path.split(path)[0]) in folders}
    for path in reads if written else ():
        if _place(path) in written:
            raise UsageError(f"{path}: would be replaced by an output; write somewhere else")


def check_nothing_is_there(writes: Iterable[str]) -> None:
    """Check that no output exists.

    Raises
    ------
    UsageError
        Names the first that does.
    """
    for path in writes:
        if os.path.lexists(path):
            raise UsageError(f"{path}: exists already; give --overwrite to replace it")


def list_files(frames: Iterable[tuple[Iterable[str], Iterable[str]]]) -> None:
    """Print what would be read and written, a line each; `frames` holds (reads, writes)."""
    lines: list[str] = []
    for reads, writes in frames:
        lines += [f"read  {path}\n" for path in reads]
        lines += [f"write {path}\n" for path in writes]
    write_stdout("".join(lines).encode("utf-8", "surrogateescape"))


def _place(path: str) -> str:
    """Make one text of every spelling of a path."""
    folder, name = os.path.split(path)
    return f"{_real_folder(folder)}/{os.path.normcase(name)}"


# cached: resolving links costs a system call for each part of a path, and files share folders
@lru_cache(maxsize=1024)
def _real_folder(folder: str) -> str:
    return os.path.realpath(folder)
