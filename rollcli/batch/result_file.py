"""The file of a result: whole rows, locked against a second run."""

import contextlib
import errno
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import atomic_file, output_error
from rollcli.files.existence import look_at
from rollcli.files.locking import locked
from rollcli.files.results import Format, format_header

_HEADERS = (format_header("csv"), format_header("csv", timing=True))
_STARTS = (*_HEADERS, b'{"file": "')  # of the files that `rollcli estimate` writes
_MORE_THAN_A_HEADER = 1000  # bytes


class ResultFile:
    """A regular file that is open, locked, and grows by whole rows.

    Attributes
    ----------
    descriptor : int
        The open file. Workers inherit it, so that the lock outlasts a killed run until they have ended.
    """

    def __init__(self, descriptor: int, name: str) -> None:
        self.descriptor, self._name = descriptor, name

    def read(self) -> bytes:
        """Read the whole file."""
        os.lseek(self.descriptor, 0, os.SEEK_SET)  # locking moves the position on Windows
        with open(self.descriptor, "rb", closefd=False) as file:
            return file.read()

    def truncate(self, size: int) -> None:
        """Keep the first `size` bytes, and continue after them.

        Raises
        ------
        OutputError
            The file system refuses.
        """
        try:
            os.ftruncate(self.descriptor, size)
            os.lseek(self.descriptor, 0, os.SEEK_END)
        except OSError as error:
            raise output_error(self._name, error) from error

    def append(self, line: bytes) -> None:
        """Write one line, whole or not at all.

        Raises
        ------
        OutputError
            The disk is full, or the file was moved or removed.
        """
        if not self.is_there():
            raise OutputError(f"{self._name}: was moved or removed while this run was writing it")
        try:
            before = os.lseek(self.descriptor, 0, os.SEEK_CUR)
            _write_all(self.descriptor, line)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self.descriptor, before)
            raise output_error(self._name, error) from error

    def replace(self, rows: Mapping[int, bytes], form: Format) -> None:
        """Write rows in the place of those at these positions, from 0, all in one step.

        The new file is locked before it takes the name. A run that is killed leaves the old one or the new.

        Raises
        ------
        OutputError
            The disk does not take the new file; the old one is as it was.
        """
        target = os.path.realpath(self._name)  # a link stays one
        first = -1 if form == "csv" else 0  # the header
        with contextlib.ExitStack() as held:
            try:
                with Path(target).open("rb") as old, atomic_file(target, durable=True) as new:
                    if hasattr(os, "fchmod"):
                        os.fchmod(new.fileno(), stat.S_IMODE(os.fstat(self.descriptor).st_mode))
                    for position, line in enumerate(_lines(old, form), first):
                        new.write(rows.get(position, line))
                    locked_file = os.dup(new.fileno())  # the lock is the open file's, and stays with it
                    held.callback(os.close, locked_file)
                os.dup2(locked_file, self.descriptor, inheritable=False)
            except OSError as error:
                raise output_error(self._name, error) from error

    def sync(self) -> None:
        """Force the rows to the disk, where its file system can.

        Raises
        ------
        OutputError
            The disk fails to take them.
        """
        try:
            os.fsync(self.descriptor)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise output_error(self._name, error) from error

    def is_there(self) -> bool:
        """Tell whether the open file still has its name."""
        try:
            return os.path.samestat(look_at(self._name), os.fstat(self.descriptor))
        except OSError:
            return False


@contextlib.contextmanager
def open_result(name: str) -> Iterator[ResultFile]:
    """Open and lock the file of a result; it is made if it does not exist, and not changed if it does.

    Raises
    ------
    UsageError
        Another run is writing it.
    OutputError
        It cannot be written.
    """
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    while True:
        try:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(name, flags, 0o666)
        except OSError as error:
            raise output_error(name, error) from error
        try:
            with locked(descriptor, name):
                file = ResultFile(descriptor, name)
                if file.is_there():  # the run that held it may have replaced it
                    yield file
                    return
        finally:
            with contextlib.suppress(OSError):  # what it would report, `sync` has reported
                os.close(descriptor)


def has_rows(name: str) -> bool:
    """Tell whether a file holds more than the header of a run that wrote no row."""
    try:
        with Path(name).open("rb") as file:
            start = file.read(_MORE_THAN_A_HEADER)
    except OSError:
        return False  # it does not exist, or opening it for writing will say what is wrong
    return start not in (b"", *_HEADERS)


def kept_rows(data: bytes, name: str, form: Format) -> bytes:
    """Cut what an interrupted run has left after its last whole row.

    Raises
    ------
    UsageError
        It is not a result: another program's file must not be emptied.
    """
    if not any(data.startswith(start) or start.startswith(data) for start in _STARTS):
        raise UsageError(
            f"{name}: is not a result as rollcli estimate writes it; "
            "give another --output, or --overwrite to replace it"
        )
    return whole_rows(data, form)


def whole_rows(data: bytes, form: Format) -> bytes:
    """Cut the data after the last row that is whole.

    A row of CSV ends at a newline outside quotes: a file name may hold newlines.
    """
    end = data.rfind(b"\n") + 1
    if form == "jsonl":
        return data[:end]
    quotes = data.count(b'"', 0, end)
    while end and quotes % 2:
        before = data.rfind(b"\n", 0, end - 1) + 1
        quotes -= data.count(b'"', before, end)
        end = before
    return data[:end]


def _lines(file: Iterable[bytes], form: Format) -> Iterator[bytes]:
    """Yield the header and the rows of a whole result; a row of CSV may hold newlines in quotes."""
    line = b""
    for piece in file:
        line += piece
        if form == "jsonl" or line.count(b'"') % 2 == 0:
            yield line
            line = b""


def _write_all(descriptor: int, data: bytes) -> None:
    while data:  # a full disk takes a part of it, and reports the error at the next call
        data = data[os.write(descriptor, data) :]
