"""Search folders, patterns and stores for the inputs of a command."""

import fnmatch
import glob
import itertools
import os
import posixpath
import re
import shlex
import stat
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rollcli.errors import UsageError, as_usage, reading
from rollcli.files.atomic import is_file, is_folder, mode_of
from rollcli.files.containers import BAGS, file_of, frame_name, is_archive, members, refuse_others
from rollcli.files.stores.locations import base_name, is_object_url, is_url, public_name, split_url
from rollcli.files.stores.objects import has_objects, list_objects

MAP_ENDINGS = (".png", ".tif", ".tiff", ".npy", ".npz", ".pfm", ".exr")
IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm")
_OTHER_ENDINGS = (".csv", ".jsonl", ".parquet", ".txt", ".json", ".yaml", ".yml", ".xml", ".toml")
_OF_FILES = {*MAP_ENDINGS, *IMAGE_ENDINGS, *_OTHER_ENDINGS}
_BOTH = "is an input and an output folder; write the results elsewhere"
LEAVE_NONE = "--include and --exclude leave none"
_MAGIC = re.compile(r"[*?[]")


def is_folder_url(url: str) -> bool:
    """Return whether a URL names a prefix.

    It ends at a slash or a bucket, or its last part has no ending; or it has one that no file has which is
    read here, as of a date, and objects lie below it.
    """
    if not is_object_url(url):
        return False
    key = split_url(url)[1]
    ending = posixpath.splitext(key)[1].lower()
    if key in ("", "/") or key.endswith("/") or ending == "":
        return True
    return not (ending in _OF_FILES or glob.has_magic(url)) and has_objects(f"{url}/")


def is_place(location: str) -> bool:
    """Tell whether a location holds files: a folder, an archive, or what `is_folder_url` takes for one."""
    return is_folder_url(location) if is_url(location) else is_folder(location) or is_archive(location)


def objects_behind(url: str, *, recursive: bool) -> Iterator[tuple[str, str]]:
    """Yield the URL of each object behind a URL, and its path below the prefix or pattern.

    Hidden objects and those in hidden folders are left out, as they are on disk.

    Parameters
    ----------
    url : str
        A prefix or a pattern.
    recursive : bool
        Whether to search the folders below a prefix, too.
    """
    base, pattern = url.rstrip("/") + "/", list[str]()
    if glob.has_magic(url):
        base = url[: url.rindex("/", 0, _MAGIC.search(url).start()) + 1]  # type: ignore[union-attr]
        pattern = url.removeprefix(base).split("/")
    for found, *_ in list_objects(base):
        relative = found.removeprefix(base)
        fits = _fits(relative.split("/"), pattern) if pattern else recursive or "/" not in relative
        hidden = any(part.startswith(".") for part in relative.split("/"))
        if fits and found.startswith(base) and not hidden:
            yield found, relative


def _fits(names: Sequence[str], patterns: Sequence[str]) -> bool:
    """Return whether a path fits a pattern, folder by folder; ``**`` stands for any number of folders."""
    if not patterns:
        return not names
    if patterns[0] == "**":
        return any(_fits(names[start:], patterns[1:]) for start in range(len(names) + 1))
    return bool(names) and fnmatch.fnmatchcase(names[0], patterns[0]) and _fits(names[1:], patterns[1:])


_NOWHERE = (0, 0)
_UNSEEN = stat.S_IFREG  # what cannot be looked at counts as a file, and gets an error row
_LOOKED_AT = 1000  # names of a folder without inputs, to say what it holds
_SIDES = (
    {"left", "im0", "image_2", "image_02", "image_0", "image_00"},
    {"right", "im1", "image_3", "image_03", "image_1", "image_01"},
)
_PHOTOGRAPHS = (".png", ".tif", ".tiff")  # of what is read as maps, what may be photographs, too


@dataclass
class Search:
    """How folders, patterns and stores are searched, and what was noticed on the way.

    Attributes
    ----------
    endings : tuple of str
        What counts as readable in a folder, lower case.
    recursive : bool
        Search folders recursively.
    include, exclude : sequence of str
        Globs, see `allows`.
    skip : sequence of path
        Folders that are never searched: results go there.
    maps : bool
        Disparity maps are looked for: what are the two views of pairs is never taken for such.
    left_out : Counter of str
        How many files the folders hold that are not read, by their endings.
    notes : list of str
        Lines on what is named twice, and on what the folders hold beside what is read.
    """

    endings: tuple[str, ...] = MAP_ENDINGS
    recursive: bool = False
    include: Sequence[str] = ()
    exclude: Sequence[str] = ()
    skip: Sequence[str] = ()
    maps: bool = False
    left_out: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._skip = {_identity(folder) for folder in self.skip if not is_url(folder)} - {_NOWHERE}
        self._skipped_urls = tuple(f"{folder.rstrip('/')}/" for folder in self.skip if is_url(folder))

    def files(self, argument: str, *, literal: bool = False) -> Iterator[tuple[str, str]]:
        """Yield each file of `argument`, and its path below the folder or pattern.

        Parameters
        ----------
        argument : str
            A file, which may not exist, a folder or a pattern; what exists is never taken for a pattern.
        literal : bool
            It is no pattern.

        Raises
        ------
        UsageError
            A folder cannot be read or is one of `skip`, or a folder or pattern holds nothing.
        """
        if not argument:
            raise UsageError("an input has an empty name: is a variable unset?")
        if is_url(argument):
            return self._behind_url(argument, literal=literal)
        path = Path(argument)
        if is_folder(path):
            return self._wanted(argument, self._in_folder(path), "folder")
        if not literal and glob.has_magic(argument) and not os.path.lexists(path):
            return self._wanted(argument, self._in_pattern(argument), "pattern")
        if is_archive(argument) and is_file(path):
            return self._wanted(argument, self._in_archive(argument), "archive")
        return self._named(argument, Path(frame_name(argument)).name)

    def allows(self, location: str, *, found: bool = False) -> bool:
        """Tell whether --include and --exclude allow a file.

        A glob is matched against its name, and against its path: below the folder or pattern that it was
        found in; of a file that was named, where the glob has a slash.
        """
        if not (self.include or self.exclude):
            return True
        path = public_name(location).replace(os.sep, "/").removeprefix("./")
        name = base_name(frame_name(path))

        def fits(globs: Sequence[str]) -> bool:
            return any(
                fnmatch.fnmatchcase(text, each)
                for each in globs
                for text in ((name, path) if found or "/" in each else (name,))
            )

        return (not self.include or fits(self.include)) and not fits(self.exclude)

    def _named(self, location: str, name: str) -> Iterator[tuple[str, str]]:
        refuse_others(location)
        return iter([(location, name)] if self.allows(location) else [])

    def _wanted(
        self, argument: str, files: Iterator[tuple[str, str]], kind: str
    ) -> Iterator[tuple[str, str]]:
        """Yield the files that --include and --exclude allow; finding none is an error."""
        found = list(itertools.islice(files, 1))
        every = itertools.chain(found, files)
        wanted: Iterator[tuple[str, str]] = (each for each in every if self.allows(each[1], found=True))
        if self.maps and kind != "pattern":
            wanted = _without_views(argument.rstrip("/"), wanted)
        first = next(wanted, None)
        if first is None:
            hint = self._in_place_of_inputs(argument.rstrip("/") or "/") if kind == "folder" else ""
            hint = f"; {LEAVE_NONE}" if found else hint
            endings = " ".join(self.endings) or "of any ending"
            raise UsageError(f"{argument}: no input found in this {kind} ({endings}){hint}")
        yield first
        yield from wanted

    def _in_place_of_inputs(self, folder: str) -> str:
        """Say what a folder without inputs holds instead."""
        if is_url(folder):
            return "" if self.recursive else "; --recursive searches its folders"
        names = [entry.name for entry in _entries(folder) if not entry.name.startswith(".")]
        endings = {Path(name).suffix.lower() for name in names[:_LOOKED_AT]} - {"", *self.endings}
        hint = f"; it holds {' '.join(sorted(endings)[:3])} files" if endings else ""
        if bag := next((each for each in BAGS if each in endings), ""):
            hint += f": name the bags themselves, as '{folder}/*{bag}'"
        inner = any(is_archive(name) or is_folder(Path(folder, name)) for name in names[:_LOOKED_AT])
        lower = {name.lower(): name for name in names}
        left, right = (next((lower[name] for name in sorted(side) if name in lower), "") for side in _SIDES)
        if left and right:
            return hint + f"; {_as_pairs(f'{folder}/{left}', f'{folder}/{right}')}"
        return hint + ("; --recursive searches its folders" if inner and not self.recursive else "")

    def _in_folder(self, folder: Path) -> Iterator[tuple[str, str]]:
        """Yield readable files, except hidden ones."""
        if _identity(folder) in self._skip:
            raise UsageError(f"{folder}: {_BOTH}")
        closed = self._skip | {_identity(folder)}  # links may make a circle
        base = str(folder)
        cut = 0 if base == os.curdir else len(base.rstrip(os.sep)) + 1  # what stands before a relative path
        waiting = [base]
        while waiting:  # no recursion: folders may lie a thousand deep
            root = waiting.pop()
            inner = []
            for entry in _entries(root):
                if entry.name.startswith("."):
                    continue
                # the folder tells what most entries are; asking for each takes as long as all the rest
                mode = stat.S_IFREG if entry.is_file(follow_symlinks=False) else mode_of(entry.path, _UNSEEN)
                if stat.S_ISDIR(mode):
                    inner.append(entry.path)
                elif stat.S_ISREG(mode):
                    path = entry.path.removeprefix(f"{os.curdir}{os.sep}")
                    relative = path[cut:].replace(os.sep, "/")
                    if self._reads(entry.name):
                        yield path, relative
                    elif self.recursive and is_archive(path):
                        yield from self._in_archive_found(path, relative)
                    else:
                        self.left_out[Path(entry.name).suffix.lower()] += 1
            opened = []
            for each in sorted(inner) if self.recursive else ():
                if (identity := _identity(each)) not in closed:
                    closed.add(identity)
                    opened.append(each)
            waiting += reversed(opened)

    def _in_archive(self, path: str) -> Iterator[tuple[str, str]]:
        """Yield readable members; all of its folders, for nobody sees which there are."""
        with as_usage():
            for location, name in members(path):
                if self._reads(name):
                    yield location, name
                else:
                    self.left_out[posixpath.splitext(name)[1].lower()] += 1

    def _in_archive_found(self, path: str, below: str) -> Iterator[tuple[str, str]]:
        """Yield the members of one of several archives; of maps a damaged one itself, to be an error."""
        try:
            yield from ((each, f"{below}/{name}") for each, name in self._in_archive(path))
        except UsageError:
            if not self.maps:  # without its members, others would have no partner
                raise
            yield path, below

    def _in_pattern(self, pattern: str) -> Iterator[tuple[str, str]]:
        """Yield the files that match; unless the pattern names an ending, only readable ones."""
        ending = Path(pattern).suffix
        at_its_word = ending != "" and not glob.has_magic(ending)
        base = Path(*itertools.takewhile(lambda part: not glob.has_magic(part), Path(pattern).parts))
        for match in _matches(pattern):
            path = Path(match)
            relative = Path(os.path.relpath(path, base))
            inside = {_identity(base / parent) for parent in relative.parents[:-1]}
            wanted = at_its_word or self._reads(match)
            if wanted and self._skip.isdisjoint(inside) and stat.S_ISREG(mode_of(match, _UNSEEN)):
                below = "/".join(part for part in relative.parts if part != "..")  # outputs stay below
                if is_archive(match):
                    yield from self._in_archive_found(str(path), below)
                else:
                    yield str(path), below

    def _behind_url(self, url: str, *, literal: bool) -> Iterator[tuple[str, str]]:
        """Yield the objects behind a URL: one, or those of a prefix or pattern that are readable."""
        pattern = not literal and is_object_url(url) and glob.has_magic(url)
        if not pattern and (literal or not is_folder_url(url)):
            return self._named(url, base_name(url))
        folder = f"{url.rstrip('/')}/"
        if folder in self._skipped_urls:
            raise UsageError(f"{url}: {_BOTH}")
        # an output above what is searched hides none of it
        skipped = tuple(each for each in self._skipped_urls if not folder.startswith(each))
        found = objects_behind(url, recursive=self.recursive)
        wanted = (each for each in found if not each[0].startswith(skipped))
        readable = ((each, below) for each, below in wanted if self._reads(each))
        return self._wanted(url, readable, "pattern" if pattern else "folder")

    def _reads(self, name: str) -> bool:
        return name.lower().endswith(self.endings)


def _without_views(folder: str, files: Iterator[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield the files of a folder, unless they are the two views of pairs, not maps.

    Raises
    ------
    UsageError
        The place of one, but for the side, is that of a file before it.
    """
    sides: dict[str, tuple[int, str]] = {}  # of places that are the same but for the side
    for path, relative in files:
        stem, ending = posixpath.splitext(relative)
        *folders, name = stem.split("/")
        before, _, mark = name.rpartition(".")
        for at, part in enumerate((*folders, mark) if ending.lower() in _PHOTOGRAPHS else ()):
            side = next((each for each in (0, 1) if part.lower() in _SIDES[each]), None)
            if side is not None:
                above = folders[:at] if at < len(folders) else [*folders, before]
                here = "/".join(folders[: at + 1])
                other, there = sides.setdefault("/".join([*above, "*"]), (side, here))
                if other != side:
                    both = (there, here) if side == 1 else (here, there)
                    holder = file_of(path)  # an archive is given whole
                    alone = holder == path
                    left, right = (f"{folder}/{each}".rstrip("/") if alone else holder for each in both)
                    raise UsageError(f"{folder}: {_as_pairs(left, right)}")
        yield path, relative


def _as_pairs(left: str, right: str) -> str:
    """Say what to type for pairs; they are not taken as such, since scripts should say which they mean."""
    command = shlex.join(["--left", left, "--right", right])
    rest = ", and --exclude what is neither" if left == right else ""
    return f"it holds the left and right views of pairs: give {command}{rest}; or name its maps alone"


def _matches(pattern: str) -> Iterator[str]:
    try:
        found = glob.glob(pattern, recursive=True)  # noqa: PTH207 (Path.glob takes no absolute pattern)
        # of several ways to a file the first counts: not by the order in which a file system lists them
        yield from sorted(found, key=lambda each: (each.count(os.sep), each))
    except RecursionError:
        hint = "name the folder, with --recursive"
        raise UsageError(f"{pattern}: the folders lie too deep for a pattern; {hint}") from None


def _entries(folder: str) -> list[os.DirEntry[str]]:
    with reading(folder, "this folder", UsageError), os.scandir(folder) as entries:
        return list(entries)


def _identity(folder: str | Path) -> tuple[int, int]:
    """Return the same for every path of a folder, and _NOWHERE where there is none."""
    try:
        found = os.stat(folder)  # noqa: PTH116
    except OSError:
        return _NOWHERE
    return found.st_dev, found.st_ino
