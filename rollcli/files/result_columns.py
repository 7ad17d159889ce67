"""Some columns of a result as arrays: a million rows without an object for each."""

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.files.results import READERS, STATUSES, cells_of, pieces_of, read_run, value_of
from rollcli.files.storage import STREAM

_EMPTY = frozenset({"", None})
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
    files, status, methods = list[str](), array("B"), set[str]()
    numbers: dict[str, list[NDArray[np.float64]]] = {}
    for part, data in pieces_of(path):
        names, rows = cells_of(data, part, ["file", "status", "method", *wanted])
        while chunk := list(islice(rows, _CHUNK)):
            lines, *columns = zip(*chunk, strict=True)
            found = {
                name: _values(name, cells, lines, part) for name, cells in zip(names, columns, strict=True)
            }
            files += found["file"]
            status.extend(map(STATUSES.index, found["status"]))
            methods.update(filter(None, found.get("method", ())))
            for name in filter(found.__contains__, wanted):
                numbers.setdefault(name, []).append(np.array(found[name], np.float64))  # None becomes NaN
    return ResultColumns(
        path,
        files,
        np.array(status),
        {name: np.concatenate(column) for name, column in numbers.items()},
        frozenset(methods),
        None if path == STREAM else read_run(path),
    )


def _values(name: str, cells: Sequence[Any], lines: Sequence[str], path: str) -> list[Any]:
    """Return the values of a column's cells; where one has none, raise the error of the first."""
    try:
        if _EMPTY.issuperset(cells):  # most columns of many results
            return [READERS[name](None)] * len(cells)
        return list(map(READERS[name], cells))
    except (KeyError, ValueError, TypeError, OverflowError):
        return [value_of(name, cell, f"{path}: {line}") for cell, line in zip(cells, lines, strict=True)]
