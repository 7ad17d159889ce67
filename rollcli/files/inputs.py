"""Find, sort and pair the files that a command works on."""

import fnmatch
import glob
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rollcli.errors import UsageError
from rollcli.files.naming import match_names, natural_key

MAP_ENDINGS = (".png", ".tif", ".tiff", ".npy", ".pfm")
IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm")
_NAMED = 3  # how many files a message lists


@dataclass(frozen=True)
class Input:
    """A file to work on.

    Attributes
    ----------
    path : Path
        Where it is.
    name : str
        As the user named it, with "/" separators: what a result's column `file` says.
    relative : str
        Its path below the folder or pattern it was found in: where outputs keep it.
    """

    path: Path
    name: str
    relative: str


@dataclass(frozen=True)
class Pair:
    """A left and a right image that belong together."""

    left: Input
    right: Input


def find_inputs(
    inputs: Iterable[str],
    *,
    files_from: str | None = None,
    stdin: Iterable[str] | None = None,
    recursive: bool = False,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
    skip: Sequence[str | Path] = (),
    endings: Sequence[str] = MAP_ENDINGS,
) -> list[Input]:
    """Every file that the arguments name, sorted naturally, each once.

    Parameters
    ----------
    inputs : iterable of str
        Files, folders, glob patterns (``**`` too), or "-" for paths on stdin, one a line.
    files_from : str, optional
        A file that holds paths, one a line; "-" is stdin.
    stdin : iterable of str, optional
        The lines behind "-"; sys.stdin by default.
    recursive : bool
        Look into the folders of folders.
    include, exclude : sequence of str
        Globs on the names or relative paths of what folders and patterns hold.
    skip : sequence of path
        Folders never looked into: where this run's own results go.
    endings : sequence of str
        What counts as readable in a folder.

    Returns
    -------
    list of Input
        Files named one by one are there even when they do not exist: reading them says so.

    Raises
    ------
    UsageError
        Nothing is found at all, or a folder or pattern holds nothing.
    """
    choice = _Choice(recursive, tuple(include), tuple(exclude), _resolved(skip), tuple(endings))
    found: dict[str, Input] = {}
    for argument, literal in _arguments(inputs, files_from, stdin):
        for each in choice.expand(argument, literal):
            found.setdefault(_identity(each.path), each)
    if not found:
        raise UsageError("no input: name files, folders or patterns, or - for a list on stdin")
    return sorted(found.values(), key=lambda each: natural_key(each.name))


def pair_inputs(
    left: str,
    right: str,
    *,
    match: str = "name",
    recursive: bool = False,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
    skip: Sequence[str | Path] = (),
) -> list[Pair]:
    """Pair the images of two files, folders or patterns.

    Parameters
    ----------
    left, right : str
        Two files are a pair whatever their names are. Both may be one folder that holds both sides.
    match : {"name", "order"}
        name: the same name, or the same once left and right marks are taken away (left/right, l/r, L1/R1,
        im0/im1, image_2/image_3, ...), in folder names too.
        order: the first with the first, in natural order.
    recursive, include, exclude, skip
        As in `find_inputs`.

    Returns
    -------
    list of Pair
        In the natural order of the left images.

    Raises
    ------
    UsageError
        An image without a partner, or with more than one; it is named.
    """
    lefts, rights = (
        find_inputs(
            [side], recursive=recursive, include=include, exclude=exclude, skip=skip, endings=IMAGE_ENDINGS
        )
        for side in (left, right)
    )
    if match == "order":
        if len(lefts) != len(rights):
            raise UsageError(f"{len(lefts)} left and {len(rights)} right images cannot be matched by order")
        return [Pair(*both) for both in zip(lefts, rights, strict=True)]
    if len(lefts) == len(rights) == 1:
        return [Pair(lefts[0], rights[0])]
    return _by_name(lefts, rights)


def _by_name(lefts: list[Input], rights: list[Input]) -> list[Pair]:
    shared = {_identity(each.path) for each in lefts} & {_identity(each.path) for each in rights}
    matching = match_names([e.relative for e in lefts], [e.relative for e in rights], marked=bool(shared))
    if matching.ambiguous is not None:
        names = ", ".join(
            [lefts[i].name for i in matching.ambiguous[0]] + [rights[i].name for i in matching.ambiguous[1]]
        )
        raise UsageError(f"{names}: more than one partner; rename them, or use --match order")
    pairs = [Pair(lefts[i], rights[j]) for i, j in matching.pairs]
    paired = {_identity(each.path) for pair in pairs for each in (pair.left, pair.right)}
    alone = list(dict.fromkeys(each.name for each in (*lefts, *rights) if _identity(each.path) not in paired))
    if alone:
        more = f" and {len(alone) - _NAMED} more" if len(alone) > _NAMED else ""
        raise UsageError(f"no partner found for {', '.join(alone[:_NAMED])}{more}")
    return pairs


def _arguments(
    inputs: Iterable[str], files_from: str | None, stdin: Iterable[str] | None
) -> Iterator[tuple[str, bool]]:
    """Each argument, and whether it is meant literally (lists are; the command line may hold patterns)."""
    for argument in inputs:
        if argument == "-":
            yield from ((line, True) for line in _lines(sys.stdin if stdin is None else stdin))
        else:
            yield argument, False
    if files_from == "-":
        yield from ((line, True) for line in _lines(sys.stdin if stdin is None else stdin))
    elif files_from is not None:
        try:
            text = Path(files_from).read_text(encoding="utf-8", errors="surrogateescape")
        except OSError as error:
            raise UsageError(f"{files_from}: the list of files cannot be read: {error.strerror}") from None
        yield from ((line, True) for line in _lines(text.splitlines()))


def _lines(lines: Iterable[str]) -> Iterator[str]:
    return (stripped for line in lines if (stripped := line.rstrip("\r\n")))


@dataclass(frozen=True)
class _Choice:
    """What is taken from folders and patterns."""

    recursive: bool
    include: tuple[str, ...]
    exclude: tuple[str, ...]
    skip: frozenset[str]
    endings: tuple[str, ...]

    def expand(self, argument: str, literal: bool) -> Iterator[Input]:
        """The files behind one argument."""
        path = Path(argument)
        if path.is_dir():
            yield from self._found(argument, self._walk(path), "folder")
        elif literal or os.path.lexists(path) or not glob.has_magic(argument):
            yield Input(path, _shown(argument), path.name)
        else:
            base = _fixed_part(argument)
            matches = (Path(match) for match in glob.iglob(argument, recursive=True))  # noqa: PTH207 (absolute patterns)
            named = Path(argument).suffix.lower() not in ("", ".*") and not glob.has_magic(
                Path(argument).suffix
            )
            files = (
                m
                for m in matches
                if _is_candidate(m) and (named or self._readable(m)) and not self._skipped(m)
            )
            yield from self._found(
                argument, ((m, _shown(os.path.relpath(m, base))) for m in files), "pattern"
            )

    def _found(self, argument: str, files: Iterable[tuple[Path, str]], kind: str) -> Iterator[Input]:
        count = 0
        for path, relative in files:
            if self._wanted(relative):
                count += 1
                yield Input(path, _shown(str(path)), relative)
        if count == 0:
            hint = "; --recursive looks into its folders" if kind == "folder" and not self.recursive else ""
            raise UsageError(f"{argument}: no input found in this {kind} ({', '.join(self.endings)}){hint}")

    def _walk(self, folder: Path) -> Iterator[tuple[Path, str]]:
        """Readable files of a folder, and of its folders if asked; (path, path below the folder)."""
        if os.path.realpath(folder) in self.skip:
            raise UsageError(f"{folder}: is an output folder too; write the results elsewhere")
        seen = set()
        for root, folders, files in os.walk(folder, onerror=_unlistable, followlinks=True):
            seen.add(os.path.realpath(root))
            folders[:] = sorted(
                each
                for each in folders
                if self.recursive
                and not each.startswith(".")
                and (real := os.path.realpath(Path(root, each))) not in self.skip
                and real not in seen
            )
            for file in files:
                path = Path(root, file)
                if not file.startswith(".") and self._readable(path) and _is_candidate(path):
                    yield path, _shown(os.path.relpath(path, folder))

    def _readable(self, path: Path) -> bool:
        return path.suffix.lower() in self.endings

    def _skipped(self, path: Path) -> bool:
        return any(os.path.realpath(parent) in self.skip for parent in path.parents) if self.skip else False

    def _wanted(self, relative: str) -> bool:
        def matches(patterns: tuple[str, ...]) -> bool:
            name = relative.rpartition("/")[2]
            return any(
                fnmatch.fnmatchcase(relative, each) or fnmatch.fnmatchcase(name, each) for each in patterns
            )

        return (not self.include or matches(self.include)) and not matches(self.exclude)


def _unlistable(error: OSError) -> None:
    raise UsageError(f"{error.filename}: the folder cannot be read: {error.strerror}")


def _is_candidate(path: Path) -> bool:
    """A file, or a link to nothing: that gets a row that says so."""
    return path.is_file() or (path.is_symlink() and not path.exists())


def _fixed_part(pattern: str) -> str:
    """The folder before the first wildcard."""
    parts = Path(pattern).parts
    fixed = next((i for i, part in enumerate(parts) if glob.has_magic(part)), len(parts))
    return str(Path(*parts[:fixed]))


def _identity(path: Path) -> str:
    """The same for every spelling of a path; links to files stay themselves."""
    return str(Path(os.path.realpath(path.parent), path.name))


def _resolved(folders: Sequence[str | Path]) -> frozenset[str]:
    return frozenset(os.path.realpath(each) for each in folders)


def _shown(path: str) -> str:
    return path.replace(os.sep, "/")
