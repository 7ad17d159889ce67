"""Where rows go: to a stream, or row by row to a file that a later run can take up again."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import output_error
from rollcli.files.locking import lock
from rollcli.files.results import Format, Row, format_header, format_row
from rollcli.files.stream import (
    STDOUT,
    STDOUT_NAME,
    is_stream,
    open_stream,
    stdout_descriptor,
    write_stream,
)

_MORE_THAN_A_HEADER = 1000  # bytes
_HEADERS = (format_header("csv"), format_header("csv", timing=True))
_STARTS = (*_HEADERS, b'{"file": "')


class RowSink(Protocol):
    """Takes rows in order; a row that was appended has left this process."""

    def begin(self) -> None: ...

    def append(self, row: Row) -> None: ...


class RowStream:
    """Rows to stdout, a pipe or a device: there is nothing to resume."""

    def __init__(self, descriptor: int, name: str, form: Format, timing: bool) -> None:
        self._descriptor, self._name = descriptor, name
        self._form, self._timing = form, timing

    def begin(self) -> None:
        """Write the header."""
        self._write(format_header(self._form, self._timing))

    def append(self, row: Row) -> None:
        """Write one row."""
        self._write(format_row(row, self._form, self._timing))

    def _write(self, data: bytes) -> None:
        write_stream(self._descriptor, data, self._name)


class ResultFile:
    """Rows to a regular file, locked against a second run.

    Attributes
    ----------
    kept : bytes
        The whole rows of an interrupted run, header included; empty unless resumed.
    descriptor : int
        The locked file: workers hold it too, so that the lock outlasts a killed run until they have ended.
    """

    def __init__(self, descriptor: int, name: str, form: Format, timing: bool, kept: bytes) -> None:
        self.descriptor, self.kept = descriptor, kept
        self._name, self._form, self._timing = name, form, timing

    def empty(self, *, keep: bool) -> None:
        """Leave nothing but the rows that are kept, if they are."""
        self.kept = self.kept if keep else b""
        try:
            os.ftruncate(self.descriptor, len(self.kept))
            os.lseek(self.descriptor, 0, os.SEEK_END)
        except OSError as error:
            raise output_error(self._name, error) from error

    def begin(self) -> None:
        """Write the header, unless it is among what was kept."""
        if not self.kept:
            self._append(format_header(self._form, self._timing))

    def append(self, row: Row) -> None:
        """Write one row, whole or not at all."""
        self._append(format_row(row, self._form, self._timing))

    def is_there(self) -> bool:
        """Whether the rows still go to the file of this name."""
        try:
            return os.path.samestat(Path(self._name).stat(), os.fstat(self.descriptor))
        except OSError:
            return False

    def _append(self, line: bytes) -> None:
        if not self.is_there():
            raise OutputError(f"{self._name}: was moved or removed while this run was writing it")
        try:
            before = os.lseek(self.descriptor, 0, os.SEEK_CUR)
            _write_all(self.descriptor, line)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self.descriptor, before)
            raise output_error(self._name, error) from error


def _write_all(descriptor: int, data: bytes) -> None:
    while data:  # a full disk takes a part first, and says so the next time
        data = data[os.write(descriptor, data) :]


@contextlib.contextmanager
def open_sink(name: str, form: Format, *, resume: bool, overwrite: bool, timing: bool) -> Iterator[RowSink]:
    """Open the place for the rows; nothing that is there is touched yet.

    Raises
    ------
    UsageError
        A result exists and neither resume nor overwrite is given, or another run is writing it.
    OutputError
        It cannot be written.
    """
    check_result(name, resume=resume, overwrite=overwrite)
    if is_stream(name):
        yield from _open_stream(name, form, timing)
        return
    descriptor = _open_file(name)
    try:
        lock(descriptor, name)
        check_result(name, resume=resume, overwrite=overwrite)  # now that no one else can write it
        kept = _taken_up(_read_all(descriptor), name, form) if resume else b""
        yield ResultFile(descriptor, name, form, timing, kept)
    finally:
        os.close(descriptor)


def check_result(name: str, *, resume: bool, overwrite: bool) -> None:
    """Refuse to touch a result that is there, unless told how."""
    if resume and overwrite:
        raise UsageError("give either --resume or --overwrite")
    if is_stream(name):
        if resume:
            raise UsageError("--resume needs a result file: name it with --output")
        return
    if not (resume or overwrite) and _has_rows(name):
        raise UsageError(f"{name}: exists already; give --resume to continue it or --overwrite to replace it")


def _has_rows(name: str) -> bool:
    """A file that holds more than the header of a run that came to nothing."""
    try:
        with Path(name).open("rb") as file:
            start = file.read(_MORE_THAN_A_HEADER)
    except OSError:
        return False  # not there, or what is wrong with it is said when it is to be written
    return start not in (b"", *_HEADERS)


def _open_stream(name: str, form: Format, timing: bool) -> Iterator[RowSink]:
    if name == STDOUT:
        yield RowStream(stdout_descriptor(), STDOUT_NAME, form, timing)
        return
    descriptor = open_stream(name)
    try:
        yield RowStream(descriptor, name, form, timing)
    finally:
        os.close(descriptor)


def _open_file(name: str) -> int:
    try:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        return os.open(
            name, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0), 0o666
        )
    except OSError as error:
        raise output_error(name, error) from error


def _read_all(descriptor: int) -> bytes:
    with open(descriptor, "rb", closefd=False) as file:
        return file.read()


def kept_rows(name: str, form: Format) -> bytes:
    """The whole rows of a result that is there, without taking it."""
    try:
        data = Path(name).read_bytes()
    except OSError:
        return b""
    return _taken_up(data, name, form)


def _taken_up(data: bytes, name: str, form: Format) -> bytes:
    """The whole rows of what a run has left; what is no such thing must not be emptied."""
    if not any(data.startswith(start) or start.startswith(data) for start in _STARTS):
        raise UsageError(
            f"{name}: is not a result as rollcli estimate writes it; "
            "give another --output, or --overwrite to replace it"
        )
    return whole_rows(data, form)


def whole_rows(data: bytes, form: Format) -> bytes:
    """The data up to the end of the last row that is whole.

    A row of CSV ends at a newline outside quotes: a file name may hold newlines.
    """
    end = data.rfind(b"\n") + 1
    if form == "jsonl":
        return data[:end]
    while end and data.count(b'"', 0, end) % 2:
        end = data.rfind(b"\n", 0, end - 1) + 1
    return data[:end]
