"""What a run would write, held against what it reads and what is there already."""

import os
from collections.abc import Iterable, Sequence
from functools import lru_cache

from rollcli.errors import UsageError
from rollcli.frames.frame import Frame


def check_one_owner(writes: Iterable[tuple[Frame, Iterable[str]]]) -> None:
    """Every file is written for one frame.

    Parameters
    ----------
    writes : iterable of (Frame, paths)
        Each frame, and what is written for it.

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
    """Nothing that is read is written and, unless `overwrite`, no output exists.

    Raises
    ------
    UsageError
        Names the file.
    """
    check_inputs_are_kept(reads, writes)
    if not overwrite:
        check_nothing_is_there(writes)


def check_inputs_are_kept(reads: Sequence[str], writes: Iterable[str]) -> None:
    """Nothing that is read is written.

    Raises
    ------
    UsageError
        Names the file, however differently it was spelled.
    """
    folders = {_real_folder(os.path.split(path)[0]) for path in reads}
    # only what is written beside an input can replace one
    written = {_place(path) for path in writes if _real_folder(os.path.split(path)[0]) in folders}
    for path in reads if written else ():
        if _place(path) in written:
            raise UsageError(f"{path}: would be replaced by an output; write somewhere else")


def check_nothing_is_there(writes: Iterable[str]) -> None:
    """No output exists.

    Raises
    ------
    UsageError
        Names the first that does.
    """
    for path in writes:
        if os.path.lexists(path):
            raise UsageError(f"{path}: exists already; give --overwrite to replace it")


def _place(path: str) -> str:
    """The same for every spelling of a path."""
    folder, name = os.path.split(path)
    return f"{_real_folder(folder)}/{os.path.normcase(name)}"


# resolving links costs a system call for each part of a path, and files share folders
@lru_cache(maxsize=1024)
def _real_folder(folder: str) -> str:
    return os.path.realpath(folder)
