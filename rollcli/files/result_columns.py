"""Some columns of a result as arrays: a million rows without an object for each."""

import io
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from operator import itemgetter
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.files.atomic import is_file
from rollcli.files.bounded import UTF16_MARKS
from rollcli.files.codecs.parquet import MAGIC, decode_parquet
from rollcli.files.results import (
    BOUNDS,
    STATUSES,
    STDIN,
    TEXT,
    csv_rows,
    is_text,
    json_rows,
    part_names,
    read_parts,
    read_run,
    value_of,
)
from rollcli.files.storage import list_names, read_bytes
from rollcli.files.stores.locations import is_url

_CHUNK = 300  # rows that are held as text: twenty thousand do not fit into a cache, and take a third longer
_LONGEST_LINE = 2**20  # characters that are read of one: a file or a pipe may never end its first
_MOST_SPACE = 1000  # empty lines before what tells the format


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
    """Read columns of a result that `rollcli estimate` wrote, CSV or JSON Lines.

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
    for name_of_part, names, rows in _tables(path, wanted):
        while chunk := list(islice(rows, _CHUNK)):
            lines, *columns = zip(*chunk, strict=True)
            found = dict(zip(names, columns, strict=True))
            files += _files(found["file"], lines, name_of_part)
            statuses.append(_statuses(found["status"], lines, name_of_part))
            methods.update(map(str, filter(None, found.get("method", ()))))
            for name in wanted:
                if name in found:
                    parts.setdefault(name, []).append(_numbers(name, found[name], lines, name_of_part))
    return ResultColumns(
        path,
        files,
        np.concatenate(statuses) if statuses else np.empty(0, np.uint8),
        {name: np.concatenate(part) for name, part in parts.items()},
        frozenset(methods),
        None if path == STDIN else read_run(path),
    )


def _tables(path: str, wanted: Sequence[str]) -> Iterator[tuple[str, list[str], Iterator[tuple[Any, ...]]]]:
    """Yield the file, or each part of a folder of parts: its name, its columns, its rows with their lines."""
    parts = () if path == STDIN else part_names(list_names(path))
    if parts:
        for location, data in read_parts(path, parts):
            yield location, *_table(data, location, wanted)
    elif is_url(path) or _is_parquet(path):
        yield path, *_table(read_bytes(path), path, wanted)
    else:
        with _opened(path) as stream:
            yield path, *_cells(stream, path, wanted)


def _table(data: bytes, path: str, wanted: Sequence[str]) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
    if not data.startswith(MAGIC):
        return _cells(_text(io.BufferedReader(io.BytesIO(data))), path, wanted)
    names = ["file", "status", "method", *wanted]
    rows = ((number, *map(values.get, names)) for number, values in decode_parquet(data, path))
    return names, rows


def _is_parquet(path: str) -> bool:
    if path == STDIN or not is_file(path):  # the bytes of a pipe can be read once
        return False
    try:
        with Path(path).open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False  # opening it as text says what is wrong


@contextmanager
def _opened(path: str) -> Iterator[TextIO]:
    """Open the file as text, line ends as they are."""
    try:
        if path == STDIN:
            yield _text(sys.stdin.buffer)
            return
        with Path(path).open("rb") as file, _text(file) as stream:
            yield stream
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from error


def _text(file: Any) -> TextIO:
    """Open a buffered file as text: UTF-8, or the UTF-16 that Windows marks."""
    if file.peek(2)[:2] in UTF16_MARKS:
        return io.TextIOWrapper(file, "utf-16", "replace", newline="")
    return io.TextIOWrapper(file, TEXT["encoding"], TEXT["errors"], newline="")


def _cells(stream: TextIO, path: str, wanted: Sequence[str]) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
    """Return the names of the columns that are there, and for each row its line and their cells."""
    read_line = partial(stream.readline, _LONGEST_LINE)
    start = [read_line().removeprefix("\ufeff")]
    while start[-1].isspace() and len(start) < _MOST_SPACE:
        start.append(read_line())
    lines = chain(start, iter(read_line, ""))
    names = ["file", "status", "method", *wanted]
    if start[-1].lstrip().startswith("{"):
        return names, (
            (number, *map(values.get, names)) for number, values in json_rows(_by_newline(lines, path), path)
        )
    rows = csv_rows(lines, path)
    _, header = next(rows)
    names = [name for name in names if name in header]
    pick = itemgetter(*map(header.index, names))
    return names, ((number, *pick(row)) for number, row in rows)


def _by_newline(pieces: Iterable[str], path: str) -> Iterator[str]:
    """Join what a carriage return has cut: in JSON it is white space, and a newline alone ends a line."""
    held: list[str] = []
    for piece in pieces:
        held.append(piece)
        if len(piece) >= _LONGEST_LINE or len(held) >= _LONGEST_LINE:
            raise InputError(f"{path}: has a line of more than {_LONGEST_LINE} characters; no result has one")
        if piece.endswith("\n"):
            yield "".join(held)
            held.clear()
    if held:
        yield "".join(held)


def _files(cells: Sequence[Any], lines: Sequence[int], path: str) -> list[str]:
    names = list(map(str, cells))
    if not all(cells) or not is_text("".join(names)):  # an empty name, or one that no file can have
        _name_fault("file", cells, lines, path)
    return names


def _statuses(cells: Sequence[Any], lines: Sequence[int], path: str) -> NDArray[np.uint8]:
    places = {status: place for place, status in enumerate(STATUSES)}
    try:
        return np.fromiter(map(places.__getitem__, cells), np.uint8, len(cells))
    except (KeyError, TypeError):
        _name_fault("status", cells, lines, path)
        raise


def _numbers(name: str, cells: Sequence[Any], lines: Sequence[int], path: str) -> NDArray[np.float64]:
    low, high = BOUNDS.get(name, (-np.inf, np.inf))
    try:
        if all(cells):
            empty, numbers = np.zeros(len(cells), bool), np.array(list(map(float, cells)))
        elif not any(cells) and 0 not in cells:  # a million empty cells are told at once
            return np.full(len(cells), np.nan)
        else:
            empty = np.array([cell is None or cell == "" for cell in cells])
            pairs = zip(empty.tolist(), cells, strict=True)
            numbers = np.array([np.nan if none else float(cell) for none, cell in pairs])
    except (ValueError, TypeError, OverflowError):
        _name_fault(name, cells, lines, path)
        raise
    fits = np.isfinite(numbers) & (numbers >= low) & (numbers <= high)
    if not (fits | empty).all():
        _name_fault(name, cells, lines, path)
    return numbers


def _name_fault(name: str, cells: Sequence[Any], lines: Sequence[int], path: str) -> None:
    """Raise the error of the first cell that is no value."""
    for cell, line in zip(cells, lines, strict=True):
        value_of(name, cell, f"{path}: line {line}")
