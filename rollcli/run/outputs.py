"""Where the files that are written for a frame lie, and the checks before anything is read or written."""

import contextlib
import errno
import hashlib
import os
import posixpath
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain, filterfalse, islice
from pathlib import Path
from unicodedata import normalize

from rollcli.errors import InputError, OutputError, UsageError, output_error
from rollcli.files import storage
from rollcli.files.atomic import is_folder, mark_path, remove_leftovers
from rollcli.files.containers import BAGS, file_of, is_archive, shown
from rollcli.files.naming import gathered
from rollcli.files.results import STATUSES
from rollcli.files.storage import create, read_bytes, remove, remove_all, write_bytes
from rollcli.files.stores.locations import is_object_url, is_url, public_name, within
from rollcli.files.stores.objects import list_objects
from rollcli.run.frame import Frame
from rollcli.run.options import ENDING_OF_FORMAT, FramesOptions, RunningOptions, Written


def possible_paths(frame: Frame, writes: Iterable[Written]) -> Iterator[tuple[str, list[str]]]:
    """Yield the kind of each file of a frame, and the paths of which one is written, the usual one first."""
    stem = posixpath.splitext(frame.relative)[0]
    for kind, folder, endings in writes if frame.relative else ():
        names = (frame.relative if ending is None else stem + ending for ending in endings)
        yield kind, [within(folder, name) for name in names]


def roomy_path(path: str) -> str:
    """Name the TIFF that is written in place of a KITTI PNG which cannot hold the map."""
    return posixpath.splitext(path)[0] + ENDING_OF_FORMAT["tiff"]


def local_files(frames: Iterable[Frame], status: bytes, writes: Sequence[Written]) -> Iterator[str]:
    """Yield the files of those frames that have angles which a power cut may take from a local disk."""
    angled = (frame for frame, at in zip(frames, status, strict=True) if STATUSES[at] != "error")
    return filterfalse(is_url, files_of(angled, writes))


def every_path(frame: Frame, writes: Iterable[Written]) -> list[str]:
    """List every file that may be written for a frame; there is none where its URL names no file."""
    return [path for _, paths in possible_paths(frame, writes) for path in paths]


def files_of(frames: Iterable[Frame], writes: Sequence[Written]) -> Iterator[str]:
    """Yield every file that may be written for frames; a list of them would take most of our memory."""
    for frame in frames if writes else ():
        yield from every_path(frame, writes)


def write_outputs(frame: Frame, files: Mapping[str, bytes], options: FramesOptions) -> None:
    """Write the files of a frame, each whole or not at all; a failed frame has none.

    Parameters
    ----------
    frame : Frame
    files : mapping from str to bytes
        What is written, by its path.
    options : FramesOptions
        Where it `replaces` files of an earlier run, those that are not written now are removed: they would
        pass for this run's. Otherwise nothing that another run or program wrote is touched. What an earlier
        retry of the result `retry_of` made and did not live to write a row of is taken back: a mark beside
        such a file says so until the row is in the result.

    Raises
    ------
    OutputError
        One cannot be written, or must not be replaced.
    """
    paths = every_path(frame, options.writes)
    if options.retry_of and not options.replaces:
        _write_marked(files, paths, options.retry_of)
        return
    write = write_bytes if options.replaces else _write_new
    for path, data in files.items():
        write(path, data)
    if options.replaces:
        for path in set(paths) - files.keys():
            with contextlib.suppress(OutputError):  # the row says what is wrong with the frame
                remove(path)


def _write_new(path: str, data: bytes) -> None:
    if not create(path, data, durable=False):
        raise OutputError(
            f"{public_name(path)}: exists already and is not of this run; move it away, or give --overwrite "
            "to replace it"
        )


def _write_marked(files: Mapping[str, bytes], paths: Collection[str], result: str) -> None:
    for path in paths:  # what a retry of this result made, unless somebody has changed it since
        with contextlib.suppress(InputError):  # it was not marked, or is gone
            if read_bytes(mark_path(path)) == _mark(read_bytes(path), result):
                remove(path)
    for path, data in files.items():
        write_bytes(mark_path(path), _mark(data, result))
        try:
            _write_new(path, data)
        except OutputError:
            remove(mark_path(path))
            raise


def _mark(data: bytes, result: str) -> bytes:
    return hashlib.sha256(result.encode("utf-8", "surrogateescape") + b"\0" + data).hexdigest().encode()


def remove_marks(frames: Collection[Frame], writes: Sequence[Written]) -> None:
    """Remove the marks beside the files of frames that were done again, and what killed workers left."""
    paths = list(files_of(frames, writes))
    marks = [mark_path(path) for path in paths]
    remove_leftovers([*paths, *marks])
    remove_all(filter(is_url, marks))


_LISTED_AT_ONCE = 10_000


def check_one_owner(frames: Iterable[Frame], writes: Sequence[Written], results: Iterable[str] = ()) -> None:
    """Check that no file is written twice, however differently its path is spelled.

    Parameters
    ----------
    frames : iterable of Frame
    writes : sequence of Written
        What is written for each of them.
    results : iterable of str
        The files that are written for the run.

    Raises
    ------
    UsageError
        Names the file and what it would be written for.
    """
    owner = {_place(path): "" for path in results}
    for frame in frames if writes else ():
        for path in every_path(frame, writes):
            place = _place(path)
            if place in owner:
                raise UsageError(_written_twice(path, owner[place], frame.file))
            owner[place] = frame.file


def _written_twice(path: str, first: str, second: str) -> str:
    if not first:
        return f"{path}: would be a result of this run and an image of {second}; write them apart"
    if first == second:
        return f"{path}: two images of {first} would be written there; give each kind a folder of its own"
    files = file_of(first), file_of(second)
    within_archives = (first, second) if is_archive(files[0]) else files
    folders = {posixpath.dirname(each.replace("#", "/")) for each in within_archives}
    # bags are not searched for in folders
    told_apart = len(folders) > 1 and not files[0].lower().endswith(BAGS)
    hint = "or name their common folder with --recursive" if told_apart else "each into a folder of its own"
    return f"{first} and {second} would both write {path}; run them apart, {hint}"


def check_places(frames: Sequence[Frame], folders: Iterable[str] = ()) -> None:
    """Ask each store about a file or two, and about each folder that is written to, before any work.

    Raises
    ------
    UsageError
        The bucket does not exist or is elsewhere, the keys are wrong or have expired, or the like.
    """
    few = dict.fromkeys(path for frame in (*frames[:1], *frames[-1:]) for path in frame.reads())
    for paths in gathered(("/".join(path.split("/", 3)[:3]), path) for path in few if is_url(path)).values():
        problems = [storage.read_problem(path) for path in paths]
        if all(problems):
            raise UsageError(f"{public_name(paths[0])}: cannot be read: {problems[0]}")
    for folder in filter(is_url, folders):
        if problem := storage.write_problem(folder):
            raise UsageError(f"{public_name(folder)}: cannot be written to: {problem}")


def check_named_once(names: Sequence[str]) -> None:
    """Refuse a file that is named twice, however differently its path is spelled.

    Raises
    ------
    UsageError
    """
    paths = list(map(os.path.realpath, names))
    if twice := [name for at, name in enumerate(names) if paths[at] in paths[:at]]:
        raise UsageError(f"{twice[0]}: is named twice")


def listed_only(
    files: Callable[[], Iterable[tuple[Iterable[str], Iterable[str]]]], running: RunningOptions
) -> bool:
    """Check what would be read and written, and list it where that is all that was asked.

    Parameters
    ----------
    files : callable
        Begins to yield anew what is read and what is written, in parts; a list of all may be too long.
    running : RunningOptions

    Returns
    -------
    bool
        Whether that was all.

    Raises
    ------
    UsageError
        Names an input that would be written, or without --overwrite an output that exists.
    OutputError
        Names an output below what is no folder.
    """
    written = [path for _, writes in files() for path in writes]
    check_inputs_are_kept(lambda: chain.from_iterable(reads for reads, _ in files()), written)
    if not running.overwrite:
        check_nothing_is_there(written)
    # a file of each folder, before any work: what is written last would leave the others behind
    for folder, path in {os.path.split(each)[0]: each for each in written[::-1] if not is_url(each)}.items():
        above = next(filter(os.path.lexists, (folder, *map(str, Path(folder).parents))), "")
        if above and not is_folder(above):
            raise output_error(path, FileExistsError(errno.EEXIST, "", above))
    if running.dry_run:
        list_files(files())
    return running.dry_run


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
    folders = {_real_folder(os.path.split(file_of(path))[0]) for path in reads()}
    # only what is written beside an input can replace one
    written = {_place(path) for path in writes if _real_folder(os.path.split(path)[0]) in folders}
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
        folder = next((each for each in self._listed if path.startswith(each)), None)
        if folder is None:
            folder = path[: path.rindex("/") + 1]
            self._listed[folder] = {url for url, size, _ in list_objects(folder) if size or not self._filled}
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
    with storage.open_stream(storage.STREAM) as write:
        while some := "".join(islice(lines, _LISTED_AT_ONCE)):
            write(some.encode("utf-8", "surrogateescape"))


def _place(path: str) -> str:
    """Make one text of every spelling of a path."""
    folder, name = os.path.split(path)
    place = f"{_real_folder(folder)}/{os.path.normcase(name)}"
    return normalize("NFC", place).casefold() if _ignores_case(folder) else place


# cached: resolving links costs a system call for each part of a path, and files share folders
@lru_cache(maxsize=1024)
def _real_folder(folder: str) -> str:
    return os.path.realpath(folder)


@lru_cache(maxsize=1024)
def _ignores_case(folder: str) -> bool:
    """Tell whether a.png and A.png are one file in a folder, by the names that it or its parents hold."""
    here = Path(os.path.realpath(folder))  # Path.resolve raises for links in a circle before Python 3.13
    while not is_folder(here) and here != here.parent:
        here = here.parent
    with contextlib.suppress(OSError), os.scandir(here) as entries:
        for entry in entries:
            other = here / entry.name.swapcase()
            if other.name != entry.name:
                return os.path.lexists(other) and os.path.samestat(other.lstat(), os.lstat(entry))
    return here != here.parent and not os.path.ismount(here) and _ignores_case(str(here.parent))
