"""Read and write the rows of a result: CSV, JSON Lines, Parquet (extra `parquet`), and folders of parts."""

import csv
import io
import json
import math
import os
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

from rollcli.errors import InputError, UsageError, about
from rollcli.extras import require_extra
from rollcli.files.bounded import as_utf8
from rollcli.files.storage import STREAM, list_names, read_bytes, read_named
from rollcli.files.stores.locations import is_url, is_web_url, public_name, within
from rollcli.files.stores.objects import NO_OBJECT
from rollcli.rig.quantities import ALIGNMENT, BOUNDS

MAGIC = b"PAR1"
_ROWS_AT_ONCE = 1000
_ROW_BYTES = 200  # of memory that a row takes, even an empty one
# real results have up to 100 bytes of values for each of the file's, and most files are small
_MOST_BYTES, _MOST_FOLD = 64 << 20, 200
_RECORD = b"rollcli"
_ARROW_TYPES = {str: "string", float: "float64", int: "int64", bool: "bool"}


def encode_parquet(
    types: Mapping[str, type], rows: Sequence[Mapping[str, Any]], record: Mapping[str, Any]
) -> bytes:
    """Encode a table.

    Parameters
    ----------
    types : mapping of str to type
        The columns in their order: str, float, int or bool. Any of them may hold None.
    rows : sequence of mapping
        The values by the names of their columns.
    record : mapping
        It stands as JSON under the key `rollcli` of the schema's metadata.

    Raises
    ------
    UsageError
        A text is not UTF-8, as a file name need not be; Parquet cannot hold it.
    """
    import pyarrow
    import pyarrow.parquet

    columns = [(name, _ARROW_TYPES[kind]) for name, kind in types.items()]
    schema = pyarrow.schema(columns, metadata={_RECORD: json.dumps(record).encode()})
    require_utf8(value for row in rows for value in row.values() if isinstance(value, str))
    table, target = pyarrow.Table.from_pylist(list(rows), schema=schema), io.BytesIO()
    pyarrow.parquet.write_table(table, target, compression="zstd", version="2.6", write_page_checksum=True)
    return target.getvalue()


def require_utf8(texts: Iterable[str]) -> None:
    """Refuse what Parquet cannot hold.

    Raises
    ------
    UsageError
        A text is not UTF-8, as a file name need not be.
    """
    for text in texts:
        try:
            text.encode()
        except UnicodeEncodeError as error:
            name = text.encode("utf-8", "backslashreplace").decode()
            raise UsageError(f"{name}: this name is not UTF-8, which Parquet cannot hold; use CSV") from error


def decode_parquet(data: bytes) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the number (from 1) and the values of each row.

    Raises
    ------
    InputError
        It is damaged, or made to fill the memory.
    UsageError
        The extra `parquet` is not installed.
    """
    require_extra("parquet", "Parquet")
    import pyarrow
    import pyarrow.parquet

    number, allowed = 0, max(_MOST_BYTES, _MOST_FOLD * len(data))
    try:
        file = pyarrow.parquet.ParquetFile(io.BytesIO(data), page_checksum_verification=True)
        claimed = sum(file.metadata.row_group(group).total_byte_size for group in range(file.num_row_groups))
        if claimed > allowed:
            raise InputError(f"claims {claimed} bytes of values in {len(data)}; no result has so many")
        for column in file.schema_arrow:
            if pyarrow.types.is_dictionary(column.type):  # a few bytes of it can stand for gigabytes
                raise InputError(f"its column {column.name} is a dictionary; write plain values")
        for batch in file.iter_batches(_ROWS_AT_ONCE):
            allowed -= max(batch.nbytes, _ROW_BYTES * batch.num_rows)
            if allowed < 0:
                raise InputError(f"its {len(data)} bytes hold more values than any result")
            for values in batch.to_pylist():
                number += 1
                yield number, values
        if number != file.metadata.num_rows:
            raise InputError(f"is damaged: it has {number} of {file.metadata.num_rows} rows")
    except (pyarrow.ArrowException, OSError, ValueError, OverflowError) as error:
        raise InputError(f"is damaged: {' '.join(str(error).split())[:200]}") from error


REQUIRED = ("file", "status", "roll_deg")  # columns that every result has


def _csv_rows(stream: Iterable[str]) -> Iterator[tuple[int, list[str]]]:
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
            raise InputError(f"is not a result of rollcli estimate: it has no column {', '.join(missing)}")
        yield lines.line_num, header
        width = len(header)
        for line in lines:
            if len(line) == width:
                yield lines.line_num, line
            elif line:
                raise InputError(f"line {lines.line_num}: {len(line)} values for {width} columns")
    except csv.Error as error:
        raise InputError(f"line {lines.line_num}: is not CSV: {error}") from error


def _json_rows(lines: Iterable[str]) -> Iterator[tuple[int, dict[str, Any]]]:
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
            raise InputError(f"line {number}: is not JSON: {error}") from error
        yield number, _row_of(values, f"line {number}")


def _row_of(values: Any, place: str) -> Any:
    """Return the values of a row; refuse those without what every row has."""
    missing = [name for name in REQUIRED if not isinstance(values, dict) or name not in values]
    if missing:
        raise InputError(f"{place}: is no row of rollcli estimate: no {', '.join(missing)}")
    return values


_PART = re.compile(r"part-(\d{5,})\.(csv|jsonl|parquet)")


def part_name(number: int, ending: str) -> str:
    """Return the name of a file that belongs to a part."""
    return f"part-{number:05d}.{ending}"


def part_names(names: Iterable[str]) -> list[str]:
    """Return those of the names that are parts, in the order of their rows."""
    numbered = sorted((int(match[1]), name) for name in names if (match := _PART.fullmatch(name)))
    return [name for _, name in numbered]


def read_parts(folder: str, names: Iterable[str], header: bytes = b"") -> Iterator[tuple[str, bytes]]:
    """Yield the location and the bytes of each part; a part of CSV gets the header that only the first has.

    Where the first is not among them, `header` is given.

    Raises
    ------
    InputError
        A part cannot be read.
    """
    for name in names:
        place = within(folder, name)
        part = read_bytes(place)
        yield place, header + part
        if name.endswith(".csv") and not header:
            header, end, _ = part.partition(b"\n")
            if not end:
                raise InputError(f"{public_name(folder)}/{name}: is damaged: it has no whole line")
            header += end


Format = Literal["csv", "jsonl", "parquet"]
# file names are bytes: those that are not UTF-8 come back as the bytes they were
TEXT = {"encoding": "utf-8", "errors": "surrogateescape"}


@dataclass(frozen=True, slots=True)
class Row:
    """What is known of one frame; None where a value is missing. The fields are the columns, in order."""

    file: str
    right_file: str = ""
    status: str = "error"
    roll_deg: float | None = None
    roll_ci95_deg: float | None = None
    pitch_deg: float | None = None
    pitch_ci95_deg: float | None = None
    height_m: float | None = None
    height_ci95_m: float | None = None
    camber: float | None = None
    method: str = ""
    iterations: int | None = None
    converged: bool | None = None
    global_minimum: bool | None = None
    rmse_px: float | None = None
    alpha0: float | None = None
    alpha1: float | None = None
    alpha2: float | None = None
    valid_fraction: float | None = None
    road_fraction: float | None = None
    width: int | None = None
    height: int | None = None
    right_lower_px: float | None = None
    right_clockwise_deg: float | None = None
    right_larger_percent: float | None = None
    right_twist_px: float | None = None
    message: str = ""
    image_roll_deg: float | None = None
    elapsed_ms: float | None = None

    @property
    def map_roll_deg(self) -> float | None:
        """The angle that turns the map upright; the rig's where other programs have that alone."""
        return self.roll_deg if self.image_roll_deg is None else self.image_roll_deg

    @property
    def alpha(self) -> tuple[float, float, float] | None:
        """The road's parabola, px; None where the row has none."""
        if self.alpha0 is None or self.alpha1 is None or self.alpha2 is None:
            return None
        return self.alpha0, self.alpha1, self.alpha2


STATUSES = ("ok", "suspect", "error")
# columns that a result has only where they say something: where fx and fy differ, and with --timing
IMAGE_ROLL, TIMING = FURTHER = ("image_roll_deg", "elapsed_ms")
COLUMNS = tuple(field.name for field in fields(Row) if field.name not in FURTHER)
_MOST_SPACE = 1000  # bytes before what tells the format
ALIGNMENT_COLUMNS = tuple(each.column for each in ALIGNMENT)
_SPECIAL = re.compile(r'[,"\r\n]')  # what a field of CSV holds in quotes only
# a millionth of a degree is far below any map's noise; nine digits keep alpha2, which is small, whole
_DIGITS = {
    **{name: ".6f" for name, kind in get_type_hints(Row).items() if kind == float | None},
    **dict.fromkeys(("alpha0", "alpha1", "alpha2"), ".9g"),
    **dict.fromkeys(ALIGNMENT_COLUMNS, ".4f"),
    "rmse_px": ".6g",
    "elapsed_ms": ".3f",
}
_ROLLS = ("roll_deg", "image_roll_deg")


@dataclass(frozen=True)
class Result:
    """A result file: its rows in order, its path, and the run (FILE.run.json) where that is there."""

    rows: tuple[Row, ...]
    run: Mapping[str, Any] | None
    path: str = ""

    @property
    def files(self) -> list[str]:
        """The column `file`."""
        return [row.file for row in self.rows]


def columns(further: Sequence[str] = ()) -> tuple[str, ...]:
    """List the names of the columns, in order; `further` are those of `FURTHER` that a result has."""
    return (*COLUMNS, *further)


def column_types(further: Sequence[str] = ()) -> dict[str, type]:
    """Return the type of each column's values, in the columns' order."""
    hints = get_type_hints(Row)
    return {name: next(kind for kind in (*get_args(hints[name]), hints[name])) for name in columns(further)}


def format_header(form: Format, further: Sequence[str] = ()) -> bytes:
    """Format what stands before the first row."""
    return ",".join(columns(further)).encode() + b"\n" if form == "csv" else b""


def format_row(row: Row, form: Format, further: Sequence[str] = ()) -> bytes:
    """Format one line; the same row gives the same bytes."""
    if form == "csv":
        texts = (_text(name, getattr(row, name)) for name in columns(further))
        return (",".join(map(_quoted, texts)) + "\n").encode(**TEXT)
    return json.dumps(plain_values(row, further)).encode() + b"\n"


def plain_values(row: Row, further: Sequence[str] = ()) -> dict[str, Any]:
    """Return the values as the CSV shows them, so that every form says the same; None for an empty one."""
    return {name: _plain(name, getattr(row, name)) for name in columns(further)}


def csv_table(rows: Iterable[Iterable[Any]]) -> bytes:
    """Format a table of another kind as CSV, its header first."""
    lines = (",".join("" if each is None else _quoted(str(each)) for each in row) for row in rows)
    return "".join(f"{line}\n" for line in lines).encode(**TEXT)


def _quoted(text: str) -> str:
    """Quote a field of CSV; the csv module quotes a carriage return only from Python 3.13 on."""
    if not _SPECIAL.search(text):
        return text
    return '"' + text.replace('"', '""') + '"'


def _text(name: str, value: Any) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    text = format(value, _DIGITS[name]) if name in _DIGITS else str(value)
    if name in _DIGITS and float(text) == 0:
        return text.lstrip("-")
    # rounding must not leave the half-open range (-90, 90]
    return "90.000000" if name in _ROLLS and text == "-90.000000" else text


def _plain(name: str, value: Any) -> Any:
    if name not in _DIGITS:
        return value
    text = _text(name, value)
    return float(text) if text else None


def read_result(path: str | Path) -> Result:
    """Read a result that `rollcli estimate` wrote.

    Parameters
    ----------
    path : str or Path
        CSV, JSON Lines or Parquet, which the first bytes tell; a folder of parts; or a URL of these.

    Returns
    -------
    Result
        `run` is the content of FILE.run.json, or None where there is none. Further columns are left out;
        columns other than file, status and roll_deg may be missing and are then None.

    Raises
    ------
    InputError
        The file cannot be read, or is not a result of `rollcli estimate`; the line is named.
    """
    path = str(path)
    rows = tuple(row for name, data in pieces_of(path) for row in parse_rows(data, name))
    return Result(rows, read_run(path), path)


def pieces_of(path: str) -> Iterator[tuple[str, bytes]]:
    """Yield the name and the bytes of a result: one file, standard input ("-"), or its parts in order.

    Raises
    ------
    InputError
        It cannot be read, or is larger than any result.
    """
    parts = () if path == STREAM else part_names(list_names(path))
    if parts:
        yield from read_parts(path, parts)
    elif path == STREAM or not Path(path).is_dir():
        try:
            data = read_named(path)
        except InputError as error:
            if error.code != NO_OBJECT or read_run(path) is None:
                raise
            return
        if data or read_run(path) is None:  # JSON Lines has no header
            yield path, data
    elif read_run(path) is None:  # else a run has no rows yet, or its shard has none
        raise InputError(f"{path}: is a folder without parts of a result, such as part-00000.parquet")


def _cells_of(data: bytes, wanted: Sequence[str]) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
    """Return those of the wanted columns that are there; for each row where it stands, and their cells."""
    if data.startswith(MAGIC):
        table = ((f"row {number}", values) for number, values in decode_parquet(data))
        return list(wanted), ((place, *map(_row_of(values, place).get, wanted)) for place, values in table)
    # decoded piece by piece: as one text, a million rows would take a gigabyte more
    stream = io.BytesIO(data)
    if data[:_MOST_SPACE].lstrip().startswith(b"{"):
        rows = _json_rows(line.removesuffix(b"\n").decode(**TEXT) for line in stream)
        return list(wanted), ((f"line {number}", *map(values.get, wanted)) for number, values in rows)
    lines = _csv_rows(io.TextIOWrapper(stream, TEXT["encoding"], TEXT["errors"], newline=""))
    _, header = next(lines)
    there = [column for column in wanted if column in header]
    pick = itemgetter(*map(header.index, there))
    return there, ((f"line {number}", *pick(line)) for number, line in lines)


def parse_rows(data: bytes, name: str | Path) -> Iterator[Row]:
    """Parse the bytes of a result, row by row; errors call it `name`.

    What is wrong behind the last row that is taken raises nothing.

    Raises
    ------
    InputError
        They are no result; the line is named.
    """
    data = as_utf8(data, str(name))
    with about(name):
        names, rows = _cells_of(data, [field.name for field in fields(Row)])
        for line, *cells in rows:
            yield Row(
                **{column: _value(column, cell, line) for column, cell in zip(names, cells, strict=True)}
            )


def run_path(path: str | Path) -> str:
    """Return where the record of the run lies: FILE.run.json."""
    return f"{str(path).rstrip('/')}.run.json"


def read_run(path: str | Path) -> Mapping[str, Any] | None:
    """Read the record of the run that wrote the result `path`; None when there is none, as on the web."""
    record = run_path(path)
    if is_web_url(record) or not (is_url(record) or os.path.lexists(record)):
        return None
    try:
        data = read_bytes(record)
        if b"\\u0000" in data:  # no option holds one
            raise ValueError("it holds a NUL character")
        run = json.loads(as_utf8(data, record))
    except InputError as error:
        if error.code == NO_OBJECT:
            return None
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"{record}: is not JSON: {error}") from error
    if not isinstance(run, dict):
        raise InputError(f"{record}: is not the record of a run")
    return run


_MOST = 1e40  # more than any float32 of a map; of what is larger squares cannot be summed


def _status(value: Any) -> str:
    if value not in STATUSES:
        raise ValueError(value)
    return str(value)


def _words(value: Any) -> str:
    """Take a text that a file can hold: no NUL, and no half of a character, as JSON may have it.

    Halves that stand for bytes of names which are no UTF-8 are none.
    """
    text = "" if value is None else str(value)
    if b"\0" in text.encode(**TEXT):
        raise ValueError(value)
    return text


def _file(value: Any) -> str:
    if not (name := _words(value)):  # it names no file anywhere
        raise ValueError(value)
    return name


def _flag(value: Any) -> bool | None:
    if value is None or value == "":
        return None
    if not isinstance(value, bool | str | float):
        raise ValueError(value)
    # numbers: pandas makes them of a column of JSON Lines that has an empty cell
    return {"true": True, "false": False, "1.0": True, "0.0": False}[str(value).lower()]


def _number(kind: type, low: float, high: float, value: Any) -> Any:
    if value is None or value == "":
        return None
    number = value if isinstance(value, int) else float(value)
    # `1_0` is Python's notation, and a flag is no number
    is_one = "_" not in value if isinstance(value, str) else not isinstance(value, bool)
    if not (is_one and low <= number <= high and abs(number) < _MOST):
        raise ValueError(value)
    # programs that know no empty cell among whole numbers write 4 as 4.0
    if kind is int and number % 1:
        raise ValueError(value)
    return kind(number)


def _reader(name: str, kind: type) -> Callable[[Any], Any]:
    if kind in (int, float):
        return partial(_number, kind, *BOUNDS.get(name, (-math.inf, math.inf)))
    return {"file": _file, "status": _status}.get(name, _flag if kind is bool else _words)


# what makes values of cells, by column
READERS = {name: _reader(name, kind) for name, kind in column_types(FURTHER).items()}
_CHUNK = 300  # rows that are held as text: twenty thousand do not fit into a cache, and take a third longer


@dataclass(frozen=True, slots=True, eq=False)
class ResultColumns:
    """Columns of a result file, and the run that made it.

    Attributes
    ----------
    path : str
    files : list of str
        The column `file`.
    status : array of unsigned bytes
        Positions in `STATUSES`.
    numbers : mapping of str to array of float
        By column; NaN where a cell is empty. Columns that the file does not have are not in it.
    methods : frozenset of str
        The solvers of the rows that name one.
    run : mapping or None
        The content of FILE.run.json.
    """

    path: str
    files: list[str]
    status: "array[int]"
    numbers: Mapping[str, "array[float]"]
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
    numbers: dict[str, array[float]] = {}
    for part, data in pieces_of(path):
        data = as_utf8(data, part)
        with about(part):
            names, rows = _cells_of(data, ["file", "status", "method", *wanted])
            while chunk := list(islice(rows, _CHUNK)):
                lines, *cells = zip(*chunk, strict=True)
                found = {name: _values(name, each, lines) for name, each in zip(names, cells, strict=True)}
                files += found["file"]
                status.extend(map(STATUSES.index, found["status"]))
                methods.update(filter(None, found.get("method", ())))
                for name in filter(found.__contains__, wanted):
                    column = numbers.setdefault(name, array("d"))
                    column.extend([math.nan if value is None else value for value in found[name]])
    run = None if path == STREAM else read_run(path)
    return ResultColumns(path, files, status, numbers, frozenset(methods), run)


def _value(name: str, cell: Any, line: str) -> Any:
    """Convert a cell of a column, which is a text of CSV or a value of JSON."""
    try:
        return READERS[name](cell)
    except (KeyError, ValueError, TypeError, OverflowError) as error:
        what = f"status: {', '.join(STATUSES)}" if name == "status" else f"value for {name}"
        if cell == name:
            what += "; leave out this second header, or give the results one by one"
        shown = "" if cell is None else cell
        raise InputError(f"{line}: {shown!r:.80} is no {what}") from error


def _values(name: str, cells: Sequence[Any], lines: Sequence[str]) -> list[Any]:
    """Convert the cells of a column; where one cannot be, raise the error of the first."""
    if cells.count("") + cells.count(None) == len(cells):  # most columns of many results
        return [_value(name, None, lines[0])] * len(cells)
    try:
        return list(map(READERS[name], cells))
    except (KeyError, ValueError, TypeError, OverflowError):
        return [_value(name, cell, line) for cell, line in zip(cells, lines, strict=True)]
