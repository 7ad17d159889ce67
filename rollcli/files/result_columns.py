"""Some columns of a result as arrays: a million rows without an object for each."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.results import BOUNDS, STATUSES, STDIN, cells_of, is_text, pieces_of, read_run, value_of

Made = TypeVar("Made")

_PLACES = {status: place for place, status in enumerate(STATUSES)}
_CHUNK = 300  # rows that are held as text: twenty thousand do not fit into a cache, and take a third longer


@dataclass(frozen=True, slots=True, eq=False)
class ResultColumns:
    """Columns of a result file, and the run that made it.

    Attributes
    ----------
    path : str
    files : list of str
        The column `file`.
    status : ndarray of uint8, shape (N,)
        Positions in `STATUSES`.
    numbers : mapping of str to ndarray of float, shape (N,)
        By column; NaN where a cell is empty. Columns that the file does not have are not in it.
    methods : frozenset of str
        The solvers of the rows that name one.
    run : mapping or None
        The content of FILE.run.json.
    """

    path: str
    files: list[str]
    status: NDArray[np.uint8]
    numbers: Mapping[str, NDArray[np.float64]]
    methods: frozenset[str]
    run: Mapping[str, Any] | None


def read_columns(path: str, wanted: Sequence[str]) -> ResultColumns:
    """Read columns of a result that `rollcli estimate` wrote, CSV, JSON Lines or Parquet.

    Parameters
    ----------
    path : str
        "-" is stdin.
    wanted : sequence of str
        Names of number columns.

    Returns
    -------
    ResultColumns

    Raises
    ------
    InputError
        The file cannot be read, or is not a result of `rollcli estimate`; the line is named.
    """
    files: list[str] = []
    statuses: list[NDArray[np.uint8]] = []
    parts: dict[str, list[NDArray[np.float64]]] = {}
    methods: set[str] = set()
    for name_of_part, data in pieces_of(path):
        names, rows = cells_of(data, name_of_part, ["file", "status", "method", *wanted])
        while chunk := list(islice(rows, _CHUNK)):
            lines, *columns = zip(*chunk, strict=True)
            found = dict(zip(names, columns, strict=True))
            files += _checked(_files, "file", found["file"], lines, name_of_part)
            statuses.append(_checked(_statuses, "status", found["status"], lines, name_of_part))
            methods.update(map(str, filter(None, found.get("method", ()))))
            for name in wanted:
                if name in found:
                    numbers = _checked(_numbers, name, found[name], lines, name_of_part)
                    parts.setdefault(name, []).append(numbers)
    return ResultColumns(
        path,
        files,
        np.concatenate(statuses) if statuses else np.empty(0, np.uint8),
        {name: np.concatenate(part) for name, part in parts.items()},
        frozenset(methods),
        None if path == STDIN else read_run(path),
    )


def _checked(
    make: Callable[[str, Sequence[Any]], Made | None],
    name: str,
    cells: Sequence[Any],
    lines: Sequence[str],
    path: str,
) -> Made:
    """Return what is made of a column's cells; where that fails, raise the error of the first bad cell."""
    with contextlib.suppress(KeyError, ValueError, TypeError, OverflowError):
        if (made := make(name, cells)) is not None:
            return made
    for cell, line in zip(cells, lines, strict=True):
        value_of(name, cell, f"{path}: {line}")
    raise InputError(f"{path}: its column {name} cannot be read")


def _files(_: str, cells: Sequence[Any]) -> list[str] | None:
    names = list(map(str, cells))
    return names if all(cells) and is_text("".join(names)) else None  # a name that a file can have


def _statuses(_: str, cells: Sequence[Any]) -> NDArray[np.uint8]:
    return np.fromiter(map(_PLACES.__getitem__, cells), np.uint8, len(cells))


def _numbers(name: str, cells: Sequence[Any]) -> NDArray[np.float64] | None:
    if "_" in "".join(map(str, cells)) or bool in set(map(type, cells)):  # no notation of numbers
        return None
    low, high = BOUNDS.get(name, (-np.inf, np.inf))
    if not any(cells) and 0 not in cells:  # a million empty cells are told at once
        return np.full(len(cells), np.nan)
    empty = np.array([cell is None or cell == "" for cell in cells])
    pairs = zip(empty.tolist(), cells, strict=True)
    numbers = np.array([np.nan if none else float(cell) for none, cell in pairs])
    fits = np.isfinite(numbers) & (numbers >= low) & (numbers <= high)
    return numbers if (fits | empty).all() else None
