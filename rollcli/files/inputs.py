"""Find, sort and pair the files that a command works on, and match files with the rows of a table by name."""

import codecs
import functools
import os
import posixpath
import re
from array import array
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath

from rollcli.errors import UsageError, as_usage, reading
from rollcli.files.bounded import MOST_LISTED, as_utf8
from rollcli.files.containers import file_of, frame_name, shown
from rollcli.files.naming import Input, match_names, natural_key
from rollcli.files.search import IMAGE_ENDINGS, LEAVE_NONE, MAP_ENDINGS, Search
from rollcli.files.storage import STREAM, read_named
from rollcli.files.stores.locations import base_name, is_url
from rollcli.messages import listed

_NO_TEXT = (  # what images and archives begin with
    *(b"\x89PNG", b"II*\0", b"MM\0*", b"\x93NUMPY", b"Pf\n", b"PF\n"),
    *(b"\xff\xd8\xff", b"PK\x03\x04", b"v/1\x01"),
)
_OTHER_SIDE = "name the images of the other camera"
_LIST = "the list of files"
_BLOCK = 4096  # lines between two places that are known: 100,000,000 lines have 200 kB of places


def find_inputs(inputs: Iterable[str], search: Search, *, files_from: str | None = None) -> list[Input]:
    """Find every file that the arguments name, sorted naturally, each once.

    Parameters
    ----------
    inputs : iterable of str
        Files, folders, glob patterns (``**`` too), or "-" for paths on stdin, one a line.
    search : Search
        How they are searched.
    files_from : str, optional
        A file that holds paths, one a line; "-" is stdin.

    Returns
    -------
    list of Input
        Files named one by one are there even when they do not exist, as long as one of all does: reading
        them says so.

    Raises
    ------
    UsageError
        Nothing is found at all, or a folder or pattern holds nothing, or a list cannot be read.
    """
    found: list[Input] = []
    seen = set[tuple[str, str]]()  # the names of one folder share its text
    real = functools.cache(os.path.realpath)  # one folder holds thousands of files
    argument = ""
    for argument, literal in _arguments(inputs, files_from):
        before, repeats = len(found), False
        for path, relative in search.files(argument, literal=literal):
            # links to files stay themselves: each may be a frame
            folder, base = ("", path) if is_url(path) else os.path.split(shown(path))
            place = real(folder), base
            repeats |= place in seen
            if place not in seen:
                seen.add(place)
                found.append(Input(path, relative))
        if repeats and len(found) == before and not literal:
            search.notes.append(f"{argument}: is named more than once; each of its files is taken once")
    if search.left_out:
        counts = search.left_out.most_common()
        kinds = (f"{count} {ending or 'without an ending'}" for ending, count in counts)
        search.notes.append(f"files in the folders that are not read: {listed(kinds, most=5)}")
        search.left_out.clear()
    del seen  # before the keys of the sort take its place
    if not any(is_url(each.location) or os.path.lexists(file_of(each.location)) for each in found):
        named = listed(each.name for each in found)
        empty = f"{LEAVE_NONE} of the named files" if argument else "the list is empty"
        raise UsageError(f"no input found: {named + ': no such file' if named else empty}")
    found.sort(key=lambda each: natural_key(each.name))
    return found


def named_input(location: str) -> Input:
    """Make the input of a file that was named by itself."""
    return Input(location, base_name(location) if is_url(location) else Path(frame_name(location)).name)


def pair_inputs(
    left: str, right: str, search: Search | None = None, *, match: str = "name"
) -> list[tuple[Input, Input]]:
    """Pair the images of two files, folders or patterns.

    Parameters
    ----------
    left, right : str
        Two files are a pair whatever their names are. Both may be one folder that holds both sides.
    search : Search, optional
        How they are searched; by default for images, each folder by itself.
    match : {"name", "order"}
        name: the same name, or the same once left and right marks are taken away (left/right, l/r, L1/R1,
        im0/im1, image_2/image_3, ...), in folder names too.
        order: the first with the first, in natural order.

    Returns
    -------
    list of (Input, Input)
        In the natural order of the left images.

    Raises
    ------
    UsageError
        An image without a partner, or with more than one, or that is given as both; it is named.
    """
    search = search or Search(IMAGE_ENDINGS)
    lefts, rights = find_inputs([left], search), find_inputs([right], search)
    if match == "order":
        if len(lefts) != len(rights):
            raise UsageError(f"{len(lefts)} left and {len(rights)} right images cannot be matched by order")
    elif not (len(lefts) == len(rights) == 1 and {left, right} & {lefts[0].location, rights[0].location}):
        return _by_name(lefts, rights)
    pairs = list(zip(lefts, rights, strict=True))
    for one, here, there in zip(lefts, _places(lefts), _places(rights), strict=True):
        if here == there:
            raise UsageError(f"{one.name}: is given by --left and by --right; {_OTHER_SIDE}")
    return pairs


def _by_name(lefts: list[Input], rights: list[Input]) -> list[tuple[Input, Input]]:
    places = _places(lefts), _places(rights)
    same_files = {*places[0]} & {*places[1]}
    matched, ambiguous = match_names(
        [each.relative for each in lefts], [each.relative for each in rights], marked=bool(same_files)
    )
    if ambiguous is not None:
        rivals = [side[i].name for side, some in zip((lefts, rights), ambiguous, strict=True) for i in some]
        raise UsageError(f"{', '.join(rivals)}: more than one partner; rename them, or use --match order")
    pairs = [(lefts[i], rights[j]) for i, j in matched]
    paired = {side[at] for pair in matched for side, at in zip(places, pair, strict=True)}
    every = zip((*lefts, *rights), (*places[0], *places[1]), strict=True)
    alone = list(dict.fromkeys(each.name for each, place in every if place not in paired))
    # numbers of frames may look like a mark: frame_0002 and frame_0003
    if alone and len(alone) >= len(paired) and {*places[0]} == same_files:
        raise UsageError(
            "--left and --right name the same images, and most names have no mark of their side (such as "
            f"left and right, L1 and R1): {listed(each.name for each in lefts)}; {_OTHER_SIDE}"
        )
    if alone:
        remedy = "--exclude leaves out what is no view"
        if len(lefts) == len(rights) and not pairs:
            remedy = "--match order pairs the first with the first, and so on"
        raise UsageError(f"no partner found for {listed(alone)}; {remedy}")
    return pairs


def _places(inputs: Iterable[Input]) -> list[tuple[str, str]]:
    """Return the folder that each input really lies in, and its name there."""
    real = functools.cache(os.path.realpath)  # one folder holds thousands of files
    return [(real(folder), name) for folder, name in (os.path.split(each.location) for each in inputs)]


def _arguments(inputs: Iterable[str], files_from: str | None) -> Iterator[tuple[str, bool]]:
    """Yield each argument, and whether it is literal: lists are, the command line may hold patterns."""
    for argument in inputs:
        if argument == STREAM:
            yield from ((line, True) for line in _listed_in(STREAM))
        else:
            yield argument, False
    if files_from is not None:
        yield from ((line, True) for line in _listed_in(files_from))


def _listed_in(name: str) -> Iterator[str]:
    """Yield the paths of a list: of a file, an object, or stdin ("-").

    They stand one a line, or as `find -print0` writes them; bytes, for file names need not be text.
    """
    with as_usage():
        data = as_utf8(read_named(name, MOST_LISTED, _LIST), name)
    if data.startswith(_NO_TEXT):
        what = "what came is an image or an archive: name its file as an input"
        raise UsageError(f"{name}: stands for a list of files, one a line; {what}")
    # one after the other: all at once, a list of line ends alone would take ten times its memory
    if b"\0" in data:
        return (os.fsdecode(line[0]) for line in re.finditer(rb"[^\0]+", data))
    lines = (line[0].removesuffix(b"\r") for line in re.finditer(rb"[^\n]+", data))
    return (os.fsdecode(line) for line in lines if line)


class Manifest:
    """The sorted names of a file, one a line, read when they are asked for: there may be a hundred million.

    Parameters
    ----------
    path : str

    Raises
    ------
    UsageError
        It cannot be read, holds no name, or its names are not in natural order, each once.
    """

    def __init__(self, path: str) -> None:
        self._path, self._places, self._count = path, array("Q"), 0
        before, key_before = "", ""
        for number, name in self._lines(0, self._places):
            if "\0" in name:
                raise UsageError(
                    f"{path}: line {number}: holds a NUL byte; --sorted takes names in UTF-8, one a line"
                )
            key = natural_key(name)
            if self._count and key <= key_before:
                how = "is there twice" if name == before else f"sorts before {before}"
                raise UsageError(
                    f"{path}: line {number}: {name} {how}; --sorted takes names in natural order "
                    "(frame2 before frame10), each once: leave it out, and they are sorted"
                )
            before, key_before = name, key
            self._count += 1
        if not self._count:
            raise UsageError(f"{path}: no input found: the list is empty")

    def __len__(self) -> int:
        return self._count

    def names(self, places: range) -> Iterator[str]:
        """Yield the names at these places, which increase."""
        if not places:
            return
        first = places[0] // _BLOCK
        for place, (_, name) in enumerate(self._lines(self._places[first]), first * _BLOCK):
            if place in places:
                yield name
            if place == places[-1]:
                return

    def _lines(self, offset: int, places: "array[int] | None" = None) -> Iterator[tuple[int, str]]:
        """Yield each name from an offset on, and the number of its line there; note where blocks begin."""
        count = 0
        with reading(self._path, _LIST, UsageError), Path(self._path).open("rb") as file:
            file.seek(offset)
            for number, line in enumerate(file, 1):
                text = line if offset else line.removeprefix(codecs.BOM_UTF8)
                if name := text.rstrip(b"\r\n"):
                    if places is not None and count % _BLOCK == 0:
                        places.append(offset)
                    count += 1
                    yield number, os.fsdecode(name)
                offset += len(line)


_ENDINGS = {*MAP_ENDINGS, *IMAGE_ENDINGS}


def stem_of(name: str) -> str:
    """Cut folders and ending off a frame's name; a table may leave out both."""
    path = PurePosixPath(frame_name(name).replace("\\", "/"))
    return path.stem if path.suffix.lower() in _ENDINGS else path.name


def match_paths(names: Sequence[str], rows: Sequence[str], table: str) -> list[int | None]:
    """Find the row of each name.

    Parameters
    ----------
    names : sequence of str
        Paths with "/" separators.
    rows : sequence of str
        The paths that the rows of a table are about. They need not exist here, and their endings may differ:
        the same stem is a match. Of several, the one with the most equal folders before it, and of these
        the one with the same ending.
    table : str
        What errors call the table.

    Returns
    -------
    list of int or None
        For each name the position of its row; no row is there twice.

    Raises
    ------
    UsageError
        Several rows fit one name equally well, or one row fits several names.
    """
    by_end = sorted((_parts(row), position) for position, row in enumerate(rows))
    found: list[int | None] = []
    owner: dict[int, str] = {}
    for name in names:
        best = _closest(_parts(name), by_end)
        if len(best) > 1:  # of files of one name, that with the same ending
            ending = PurePosixPath(name).suffix
            best = [at for at in best if PurePosixPath(rows[at]).suffix == ending] or best
        if len(best) > 1:
            raise UsageError(f"{table}: more than one row fits {name}: {listed(rows[at] for at in best)}")
        found.append(best[0] if best else None)
        if best and owner.setdefault(best[0], name) != name:
            raise UsageError(f"{table}: the row of {rows[best[0]]} fits {owner[best[0]]} and {name}")
    return found


def is_elsewhere(name: str, row: str, *, of_pair: bool = False) -> bool:
    """Tell whether a row is about a file of the same stem in another drive.

    Paths are compared from the stem up, and, where they start in the same place, from there down. What
    differs between is another drive. Where it is one folder, a map may have been made of the row's file: of
    a pair, or in another format.

    Parameters
    ----------
    name, row : str
        Paths with the same stem; a shorter one may leave out the folders above.
    of_pair : bool
        Whether the row is that of a pair.
    """
    one, other = _folders(name), _folders(row)
    if one[:1] != other[:1] and (_is_rooted(one) or _is_rooted(other)):
        return False  # one of them may be the same folder, as another machine calls it
    while one and other and one[-1] == other[-1]:
        one, other = one[:-1], other[:-1]
    rooted, same = _is_rooted(one), _common(one, other)
    least = min(len(one), len(other)) - same
    if rooted and same < 2:  # a root alone, or a scheme: the same folder may be mounted elsewhere
        return False
    made = of_pair or PurePosixPath(name).suffix.lower() != PurePosixPath(row).suffix.lower()
    return least > (1 if made else 0)


def _as_path(name: str) -> str:
    """Write a name as a path: an archive, and what is made of it, is a folder that has its name."""
    return re.sub(r"(?i)\.(?:zip|tar)[#/]", "/", name.replace("\\", "/"))


def _is_rooted(folders: Sequence[str]) -> bool:
    """Tell whether folders begin at a root, a drive letter or a scheme."""
    return bool(folders) and (folders[0].endswith(":") or folders[0] == "/")


def _folders(path: str) -> list[str]:
    """Split a path's folders, without the steps up that a relative one begins with."""
    parts = PurePosixPath(posixpath.normpath(_as_path(path))).parent.parts
    return [part for part in parts if part != ".."]


def _parts(path: str) -> list[str]:
    """Split a path from its stem up to the root."""
    folders = PurePosixPath(_as_path(path)).parent.parts
    return [stem_of(path), *reversed(folders)]


def _closest(wanted: list[str], by_end: Sequence[tuple[list[str], int]]) -> list[int]:
    """Find those that share the stem and the most folders before it with what is wanted.

    In a list sorted from the stem up to the root they lie next to each other, where `wanted` would stand.
    """
    place = bisect_left(by_end, (wanted, -1))
    beside = by_end[max(0, place - 1) : place + 1]
    most = max((_common(wanted, parts) for parts, _ in beside), default=0)
    if most == 0:
        return []
    first = end = bisect_left(by_end, (wanted[:most], -1))
    while end < len(by_end) and by_end[end][0][:most] == wanted[:most]:
        end += 1
    return sorted(at for _, at in by_end[first:end])


def _common(one: Sequence[str], other: Sequence[str]) -> int:
    return len(os.path.commonprefix([list(one), list(other)]))  # noqa: RUF071 (of lists, part by part)
