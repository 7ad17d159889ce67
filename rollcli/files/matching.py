"""Match the rows of a table with files by name, wherever the table was made."""

import os.path
import posixpath
from bisect import bisect_left
from collections.abc import Sequence
from pathlib import PurePosixPath

from rollcli.errors import UsageError
from rollcli.files.containers import frame_name
from rollcli.files.naming import listed
from rollcli.files.search import IMAGE_ENDINGS, MAP_ENDINGS

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


def _is_rooted(folders: Sequence[str]) -> bool:
    """Tell whether folders begin at a root, a drive letter or a scheme."""
    return bool(folders) and (folders[0].endswith(":") or folders[0] == "/")


def _folders(path: str) -> list[str]:
    """Split a path's folders, without the steps up that a relative one begins with."""
    parts = PurePosixPath(posixpath.normpath(path.replace("\\", "/"))).parent.parts
    return [part for part in parts if part != ".."]


def _parts(path: str) -> list[str]:
    """Split a path from its stem up to the root."""
    folders = PurePosixPath(path.replace("\\", "/")).parent.parts
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
