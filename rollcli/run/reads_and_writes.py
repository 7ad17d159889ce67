"""Check what would be read and written before anything runs: nothing is replaced that should stay."""

import contextlib
import os
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import islice
from pathlib import Path
from unicodedata import normalize

from rollcli.errors import UsageError
from rollcli.files import storage
from rollcli.files.atomic import is_folder
from rollcli.files.containers import file_of, shown
from rollcli.files.stores.locations import is_object_url, is_url, public_name, split_url
from rollcli.files.stores.objects import list_objects
from rollcli.files.stream import STDOUT, open_stream
from rollcli.run.frame import Frame

_LISTED_AT_ONCE = 10_000


def check_one_owner(writes: Iterable[tuple[Frame, Iterable[str]]], results: Iterable[str] = ()) -> None:
    """Check that no file is written twice, however differently its path is spelled.

    Parameters
    ----------
    writes : iterable of (Frame, paths)
        Each frame, and the files that are written for it.
    results : iterable of str
        The files that are written for the run.

    Raises
    ------
    UsageError
        Names the file and what it would be written for.
    """
    owner = {_place(path): "" for path in results}
    for frame, paths in writes:
        for path in paths:
            place = _place(path)
            if place in owner:
                raise UsageError(_written_twice(path, owner[place], frame.file))
            owner[place] = frame.file


def _written_twice(path: str, first: str, second: str) -> str:
    if not first:
        return f"{path}: would be a result of this run and an image of {second}; write them apart"
    if first == second:
        return f"{path}: two images of {first} would be written there; give each kind a folder of its own"
    return (
        f"{first} and {second} would both write {path}; run them apart, or name their common folder with "
        "--recursive"
    )


def check_places(frames: Sequence[Frame], folders: Iterable[str] = ()) -> None:
    """Ask each store about a file or two, and about each folder that is written to, before any work.

    Raises
    ------
    UsageError
        The bucket does not exist or is elsewhere, the keys are wrong or have expired, or the like.
    """
    asked: dict[str, list[str]] = {}
    for path in dict.fromkeys(path for frame in (*frames[:1], *frames[-1:]) for path in frame.reads()):
        if is_url(path):
            asked.setdefault("/".join(path.split("/", 3)[:3]), []).append(path)
    for paths in asked.values():
        problems = [storage.read_problem(path) for path in paths]
        if all(problems):
            raise UsageError(f"{public_name(paths[0])}: cannot be read: {problems[0]}")
    for folder in filter(is_url, folders):
        if problem := storage.write_problem(folder):
            raise UsageError(f"{public_name(folder)}: cannot be written to: {problem}")


def check_writes(reads: Sequence[str], writes: Sequence[str], *, overwrite: bool) -> None:
    """Check that no input is written and, unless `overwrite`, that no output exists.

    Raises
    ------
    UsageError
        Names the file.
    """
    check_inputs_are_kept(lambda: reads, writes)
    if not overwrite:
        check_nothing_is_there(writes)


def check_inputs_are_kept(reads: Callable[[], Iterable[str]], writes: Iterable[str]) -> None:
    """Check that no input is written, however differently its path is spelled.

    Parameters
    ----------
    reads : callable
        Begins to yield the inputs anew; a list of them may be too long.
    writes : iterable of str

    Raises
    ------
    UsageError
        Names the file.
    """
    folders = {_real_folder(_split(file_of(path))[0]) for path in reads()}
    # only what is written beside an input can replace one
    written = {_place(path) for path in writes if _real_folder(_split(path)[0]) in folders}
    for path in reads() if written else ():
        if _place(file_of(path)) in written:
            raise UsageError(f"{path}: would be replaced by an output; write somewhere else")


def check_nothing_is_there(writes: Iterable[str]) -> None:
    """Check that no output exists.

    Raises
    ------
    UsageError
        Names the first that does.
    """
    there = Existing()
    for path in writes:
        if path in there:
            raise UsageError(f"{path}: exists already; give --overwrite to replace it")


class Existing:
    """What exists; a folder of an object store is listed once, since each question to it takes a while.

    Where `filled` is asked for, what is empty does not count.
    """

    def __init__(self, *, filled: bool = False) -> None:
        self._listed: dict[str, set[str]] = {}
        self._filled = filled

    def __contains__(self, path: str) -> bool:
        if not is_object_url(path):
            return not _is_empty(path) if self._filled else os.path.lexists(path)
        root = split_url(path)[0]
        folder = next((each for each in self._listed if path.startswith(each)), None)
        if folder is None:
            folder = path[: path.rindex("/") + 1] if path.count("/") > root.count("/") + 1 else f"{root}/"
            self._listed[folder] = {found for found, size in list_objects(folder) if size or not self._filled}
        return path in self._listed[folder]


def _is_empty(path: str) -> bool:
    """Tell whether a file is empty, or a link to nothing."""
    try:
        return Path(path).stat().st_size == 0
    except OSError:
        return True


def list_files(frames: Iterable[tuple[Iterable[str], Iterable[str]]]) -> None:
    """Print what would be read and written, a line each; `frames` holds (reads, writes)."""
    lines = (
        f"{does} {shown(public_name(path))}\n"
        for reads, writes in frames
        for does, paths in (("read ", reads), ("write", writes))
        for path in paths
    )
    with open_stream(STDOUT) as write:
        while some := "".join(islice(lines, _LISTED_AT_ONCE)):
            write(some.encode("utf-8", "surrogateescape"))


def _place(path: str) -> str:
    """Make one text of every spelling of a path."""
    folder, name = _split(path)
    real, ignores_case = _real_place(folder)
    place = f"{real}/{os.path.normcase(name)}"
    return normalize("NFC", place).casefold() if ignores_case else place


def _split(path: str) -> tuple[str, str]:
    """Split a path into its folder and its name; os.path.split takes four times as long."""
    if os.sep != "/":
        return os.path.split(path)
    folder, slash, name = path.rpartition("/")
    return folder + slash, name


# cached: resolving links costs a system call for each part of a path, and files share folders
@lru_cache(maxsize=1024)
def _real_place(folder: str) -> tuple[str, bool]:
    return _real_folder(folder), _ignores_case(folder)


@lru_cache(maxsize=1024)
def _real_folder(folder: str) -> str:
    return os.path.realpath(folder)


@lru_cache(maxsize=1024)
def _ignores_case(folder: str) -> bool:
    """Tell whether a.png and A.png are one file in a folder, by the names that it or its parents hold."""
    here = Path(folder).resolve()
    while not is_folder(here) and here != here.parent:
        here = here.parent
    with contextlib.suppress(OSError), os.scandir(here) as entries:
        for entry in entries:
            if entry.name != entry.name.swapcase():
                return _same(here / entry.name, here / entry.name.swapcase())
    return here != here.parent and not os.path.ismount(here) and _ignores_case(str(here.parent))


def _same(path: Path, other: Path) -> bool:
    try:
        return os.path.samestat(path.lstat(), other.lstat())
    except OSError:
        return False
