"""A result as a file: rows that reach the disk, locked against a second run."""

import contextlib
import errno
import io
import os
import stat
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import atomic_file, look_at, output_error, sync_files, write_atomic, writing
from rollcli.files.locking import locked, take_lock
from rollcli.files.results import FURTHER, Format, format_header

_HEADERS = tuple(
    format_header("csv", further)
    for count in range(len(FURTHER) + 1)
    for further in combinations(FURTHER, count)
)
_STARTS = (*_HEADERS, b'{"file": "')  # of the files that `rollcli estimate` writes
_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
_ON_WINDOWS = os.name == "nt"
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
        """Read the whole file.

        Raises
        ------
        OutputError
            The disk does not give it.
        """
        with writing(self._name):
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
        with writing(self._name):
            os.ftruncate(self.descriptor, size)
            os.lseek(self.descriptor, 0, os.SEEK_END)

    def append(self, lines: bytes) -> None:
        """Write lines, all of them or none.

        Raises
        ------
        OutputError
            The disk is full, or the file was moved or removed.
        """
        if not self.is_there():
            raise OutputError(f"{self._name}: was moved or removed while this run was writing it")
        try:
            before = os.lseek(self.descriptor, 0, os.SEEK_CUR)
            _write_all(self.descriptor, lines)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self.descriptor, before)
                os.lseek(self.descriptor, before, os.SEEK_SET)
            raise output_error(self._name, error) from error

    def replace(self, rows: Mapping[int, bytes], form: Format) -> None:
        """Write rows in the place of those at these positions, from 0, all in one step.

        The new file is locked before it takes the name. A run that is killed leaves the old one or the new.

        Raises
        ------
        OutputError
            The disk does not take the new file; the old one is as it was.
        """
        first = -1 if form == "csv" else 0  # the header
        rest = enumerate(row_lines(self._old_lines(), form), first)
        self.rewrite(rows.get(position, line) for position, line in rest)

    def rewrite(self, lines: Iterable[bytes]) -> None:
        """Write the file anew, all in one step, and continue behind these lines; see `replace`."""
        target = os.path.realpath(self._name)  # a link stays one
        if _ON_WINDOWS:
            self._replace_closed(target, b"".join(lines))
            return
        with contextlib.ExitStack() as held, writing(self._name):
            with atomic_file(target, durable=True) as new:
                if hasattr(os, "fchmod"):
                    os.fchmod(new.fileno(), stat.S_IMODE(os.fstat(self.descriptor).st_mode))
                new.writelines(lines)
                locked_file = os.dup(new.fileno())  # the lock is the open file's, and stays with it
                held.callback(os.close, locked_file)
            os.dup2(locked_file, self.descriptor, inheritable=False)

    def _old_lines(self) -> Iterator[bytes]:
        if _ON_WINDOWS:  # it renames onto no open file
            yield from io.BytesIO(self.read())
            return
        with Path(os.path.realpath(self._name)).open("rb") as old:
            yield from old

    def _replace_closed(self, target: str, data: bytes) -> None:
        """Write the file anew while it is closed: Windows renames onto no open file.

        Another run may take it in this moment; then this one ends, and has lost nothing.
        """
        with writing(self._name):
            _reopen(self.descriptor, os.devnull, os.O_RDONLY)
            try:
                write_atomic(target, data, durable=True)
            finally:
                _reopen(self.descriptor, target, _FLAGS)
        take_lock(self.descriptor, self._name)
        os.lseek(self.descriptor, 0, os.SEEK_END)

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
    while True:
        with writing(name):
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(name, _FLAGS, 0o666)
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
    return data_of(name, _MORE_THAN_A_HEADER) not in (b"", *_HEADERS)


def data_of(path: str, most: int = -1) -> bytes:
    """Read a file of a result, or its beginning; empty where there is none."""
    try:
        with Path(path).open("rb") as file:
            return file.read(most)
    except OSError:  # it does not exist, or opening it for writing will say what is wrong
        return b""


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


def row_lines(file: Iterable[bytes], form: Format) -> Iterator[bytes]:
    """Yield the header and the rows of a whole result; a row of CSV may hold newlines in quotes."""
    line = b""
    for piece in file:
        line += piece
        if form == "jsonl" or line.count(b'"') % 2 == 0:
            yield line
            line = b""


def _reopen(descriptor: int, path: str, flags: int) -> None:
    """Let an open descriptor be that of another file."""
    opened = os.open(path, flags)
    try:
        os.dup2(opened, descriptor, inheritable=False)
    finally:
        os.close(opened)


def _write_all(descriptor: int, data: bytes) -> None:
    while data:  # a full disk takes a part of it, and reports the error at the next call
        data = data[os.write(descriptor, data) :]


_MOST_IMAGES = 512
_LONGEST_S = 1.0  # a row waits no longer for the others of its group
_SHARE = 100  # a group lasts so many times as long as the last one took to sync: 1 % of the time at most


class DurableRows:
    """Collects rows, forces their images to the disk, then writes them and forces them too.

    Rows without images are written at once; a killed run loses none of them. What a row was made from is
    written before it (see `inputs`), and counts without it for nothing.

    Attributes
    ----------
    written : int
        The number of rows in the file that this object wrote.
    """

    def __init__(self, file: ResultFile, inputs: ResultFile) -> None:
        self.written = 0
        self._file, self._inputs = file, inputs
        self._rows: list[bytes] = []
        self._images: list[str] = []
        self._folders: set[Path] = set()  # whose names are on the disk
        self._unsynced = False
        self._last, self._wait_s = time.monotonic(), 0.0

    def append(self, rows: Sequence[bytes], inputs: Sequence[bytes], images: Iterable[str]) -> None:
        """Add rows, the lines of their inputs, and the images that must be on the disk before them.

        Raises
        ------
        OutputError
            The disk does not take an image or a row.
        """
        self._inputs.append(b"".join(inputs))
        self._images.extend(images)
        if self._rows or self._images:
            self._rows.extend(rows)
        else:
            self._write(rows)
        self._commit_in_time()

    def restore(self, images: Iterable[str]) -> None:
        """Add images whose row is in the result already.

        Raises
        ------
        OutputError
            The disk does not take an image or a row.
        """
        self._images.extend(images)
        self._commit_in_time()

    def commit(self) -> None:
        """Force everything to the disk that was added.

        Raises
        ------
        OutputError
            The disk does not take it.
        """
        start = time.monotonic()
        if self._images:
            sync_files(self._images, self._folders)
            self._images.clear()
        rows, self._rows = self._rows, []  # first: a commit after an interrupt must not write one again
        self._write(rows)
        if self._unsynced:
            self._inputs.sync()
            self._file.sync()
            self._unsynced = False
        self._last = time.monotonic()
        self._wait_s = min(_SHARE * (self._last - start), _LONGEST_S)

    def _commit_in_time(self) -> None:
        if time.monotonic() - self._last >= self._wait_s or len(self._images) >= _MOST_IMAGES:
            self.commit()

    def _write(self, rows: Sequence[bytes]) -> None:
        if not rows:
            return
        self._unsynced = True
        try:
            self._file.append(b"".join(rows))
            self.written += len(rows)
        except OutputError:
            if len(rows) == 1:
                raise
            for row in rows:  # those that the disk still takes
                self._write([row])
