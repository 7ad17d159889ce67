"""Lines of CSV and of JSON Lines, with their numbers for messages."""

import csv
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rollcli.errors import InputError

REQUIRED = ("file", "status", "roll_deg")  # columns that every result has


def csv_rows(stream: Iterable[str], path: str | Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the header and then each line of a result, with its number; all have the header's length.

    Raises
    ------
    InputError
        It is not CSV, or not a result of `rollcli estimate`.
    """
    lines = csv.reader(stream, strict=True)
    try:
        header = next(lines, [])
        missing = [name for name in REQUIRED if name not in header]
        if missing:
            raise InputError(
                f"{path}: is not a result of rollcli estimate: it has no column {', '.join(missing)}"
            )
        yield lines.line_num, header
        width = len(header)
        for line in lines:
            if len(line) == width:
                yield lines.line_num, line
            elif line:
                raise InputError(f"{path}: line {lines.line_num}: {len(line)} values for {width} columns")
    except csv.Error as error:
        raise InputError(f"{path}: line {lines.line_num}: is not CSV: {error}") from error


def json_rows(lines: Iterable[str], path: str | Path) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the values of each line of a result in JSON Lines, with its number.

    Raises
    ------
    InputError
        A line is not JSON, or no row of `rollcli estimate`.
    """
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            values = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: line {number}: is not JSON: {error}") from error
        missing = [name for name in REQUIRED if not isinstance(values, dict) or name not in values]
        if missing:
            raise InputError(f"{path}: line {number}: is no row of rollcli estimate: no {', '.join(missing)}")
        yield number, values
