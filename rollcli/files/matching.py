"""Match the rows of a table with files by name, wherever the table was made."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import PurePosixPath

from rollcli.errors import UsageError
from rollcli.files.inputs import IMAGE_ENDINGS, MAP_ENDINGS
from rollcli.files.naming import listed

_ENDINGS = {*MAP_ENDINGS, *IMAGE_ENDINGS}


def stem_of(name: str) -> str:
    """Cut folders and ending off a frame's name; a table may leave out both."""
    path = PurePosixPath(name.replace("\\", "/"))
    return path.stem if path.suffix.lower() in _ENDINGS else path.name


def match_paths(names: Sequence[str], rows: Sequence[str], table: str) -> list[int | None]:
    """Find the row of each name.

    Parameters
    ----------
    names : sequence of str
        Paths with "/" separators.
    rows : sequence of str
        The paths that the rows of a table are about. They need not exist here, and their endings may differ:
        the same stem is a match. Of several, the one with the most equal folders before it.
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
    by_stem: dict[str, list[int]] = defaultdict(list)
    parts = [_parts(row) for row in rows]
    for position, (stem, *_) in enumerate(parts):
        by_stem[stem].append(position)
    found: list[int | None] = []
    owner: dict[int, str] = {}
    for name in names:
        wanted = _parts(name)
        best = _closest(wanted, {at: parts[at] for at in by_stem.get(wanted[0], ())})
        if len(best) > 1:
            raise UsageError(f"{table}: more than one row fits {name}: {listed(rows[at] for at in best)}")
        found.append(best[0] if best else None)
        if best and owner.setdefault(best[0], name) != name:
            raise UsageError(f"{table}: the row of {rows[best[0]]} fits {owner[best[0]]} and {name}")
    return found


def _parts(path: str) -> list[str]:
    """Split a path from its stem up to the root."""
    folders = PurePosixPath(path.replace("\\", "/")).parent.parts
    return [stem_of(path), *reversed(folders)]


def _closest(wanted: Sequence[str], candidates: dict[int, list[str]]) -> list[int]:
    """Find the candidates that share the most folders with the wanted path."""
    shared = {at: _common(wanted, each) for at, each in candidates.items()}
    most = max(shared.values(), default=0)
    return [at for at, count in shared.items() if count == most]


def _common(one: Sequence[str], other: Sequence[str]) -> int:
    count = 0
    for mine, yours in zip(one, other, strict=False):
        if mine != yours:
            break
        count += 1
    return count
