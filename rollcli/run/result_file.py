"""A result as a file of whole rows, locked against a second run; and FILE.inputs beside it.

FILE.inputs says what each row was made from, so that a later run knows what has changed since. Of a result
in parts it is a folder, with a file for each part. A line of fixed length stands for each row, in their
order: hashes of the frame's name, of the state of its files (size and time; the entity tag of an object),
and of what they hold; its calibration counts as both. Import-light.
"""

import contextlib
import errno
import io
import os
import re
import stat
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from hashlib import blake2b
from pathlib import Path

from rollcli.errors import InputError, OutputError, RollcliError, UsageError, output_error, writing
from rollcli.files.atomic import atomic_file, is_file, look_at, write_atomic
from rollcli.files.locking import locked, take_lock
from rollcli.files.results import FURTHER, Format, format_header, part_name
from rollcli.files.storage import Note, noting, read_frame, state_of
from rollcli.files.stores.locations import is_object_url, is_url
from rollcli.files.stores.objects import list_objects
from rollcli.run.frame import Frame
from rollcli.run.options import FramesOptions

_HEADERS = [format_header("csv", further) for further in ((), FURTHER[:1], FURTHER[1:], FURTHER)]
_STARTS = (*_HEADERS, b'{"file": "')  # of the files that `rollcli estimate` writes
_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
_ON_WINDOWS = os.name == "nt"
_MORE_THAN_A_HEADER = 1000  # bytes


class ResultFile:
    """A regular file that is open, locked, and grows by whole rows."""

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self._name = descriptor, name

    def read(self, most: int = -1) -> bytes:
        """Read the whole file, or its first bytes.

        Raises
        ------
        OutputError
            The disk does not give it.
        """
        with writing(self._name):
            os.lseek(self._descriptor, 0, os.SEEK_SET)  # locking moves the position on Windows
            with open(self._descriptor, "rb", closefd=False) as file:
                return file.read(most)

    def keep(self, data: bytes) -> None:
        """Let the file hold these bytes alone, and continue after them; written anew where it must be.

        Raises
        ------
        OutputError
            The file system refuses.
        """
        if self.read(len(data)) != data:
            self.rewrite([data])
        with writing(self._name):
            os.ftruncate(self._descriptor, len(data))
            os.lseek(self._descriptor, 0, os.SEEK_END)

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
            before = os.lseek(self._descriptor, 0, os.SEEK_CUR)
            while lines:  # a full disk takes a part of it, and reports the error at the next call
                lines = lines[os.write(self._descriptor, lines) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, before)
                os.lseek(self._descriptor, before, os.SEEK_SET)
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
        with writing(self._name):
            old = io.BytesIO(Path(self._name).read_bytes())
        self.rewrite(rows.get(at, line) for at, line in enumerate(row_lines(old, form), first))

    def rewrite(self, lines: Iterable[bytes]) -> None:
        """Write the file anew, all in one step, and continue behind these lines; see `replace`."""
        target = os.path.realpath(self._name)  # a link stays one
        if _ON_WINDOWS:
            self._replace_closed(target, b"".join(lines))
            return
        with contextlib.ExitStack() as held, writing(self._name):
            with atomic_file(target, durable=True) as new:
                if hasattr(os, "fchmod"):
                    os.fchmod(new.fileno(), stat.S_IMODE(os.fstat(self._descriptor).st_mode))
                new.writelines(lines)
                locked_file = os.dup(new.fileno())  # the lock is the open file's, and stays with it
                held.callback(os.close, locked_file)
            os.dup2(locked_file, self._descriptor, inheritable=False)

    def _replace_closed(self, target: str, data: bytes) -> None:
        """Write the file anew while it is closed: Windows renames onto no open file.

        Another run may take it in this moment; then this one ends, and has lost nothing.
        """
        with writing(self._name):
            _reopen(self._descriptor, os.devnull, os.O_RDONLY)
            try:
                write_atomic(target, data, durable=True)
            finally:
                _reopen(self._descriptor, target, _FLAGS)
        take_lock(self._descriptor, self._name)
        os.lseek(self._descriptor, 0, os.SEEK_END)

    def sync(self) -> None:
        """Force the rows to the disk, where its file system can.

        Raises
        ------
        OutputError
            The disk fails to take them.
        """
        try:
            os.fsync(self._descriptor)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise output_error(self._name, error) from error

    def is_there(self) -> bool:
        """Tell whether the open file still has its name."""
        try:
            return os.path.samestat(look_at(self._name), os.fstat(self._descriptor))
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
    with contextlib.suppress(OSError):  # opening it for writing will say what is wrong
        if is_file(path):  # a pipe would wait for its writer
            with Path(path).open("rb") as file:
                return file.read(most)
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
    return b"".join(line for line in row_lines(io.BytesIO(data), form) if line.endswith(b"\n"))


def row_lines(file: Iterable[bytes], form: Format) -> Iterator[bytes]:
    """Yield the header and the rows of a whole result; a row of CSV may hold newlines in quotes."""
    pieces, quotes = list[bytes](), 0
    for piece in file:
        pieces.append(piece)
        quotes += piece.count(b'"')
        if form == "jsonl" or quotes % 2 == 0:
            yield b"".join(pieces)
            pieces.clear()


def _reopen(descriptor: int, path: str, flags: int) -> None:
    """Let an open descriptor be that of another file."""
    opened = os.open(path, flags)
    try:
        os.dup2(opened, descriptor, inheritable=False)
    finally:
        os.close(opened)


PART_INPUTS = "inputs"  # the ending of their names
_HEX = 16
_WIDTH = 3 * (_HEX + 1)
_UNKNOWN = b"-" * _HEX
_LINE = re.compile(rb"([0-9a-f]{16} )([0-9a-f]{16}|-{16}) ([0-9a-f]{16}|-{16})\n")
_HERE = FramesOptions()  # paths are those of this machine


def inputs_path(result: str) -> str:
    """Return where FILE.inputs lies."""
    return f"{result}.inputs"


def part_paths(result: str, form: Format, number: int) -> tuple[str, str]:
    """Return where a part lies, and where what its rows were made from."""
    inputs = f"{inputs_path(result)}/{part_name(number, PART_INPUTS)}"
    return f"{result}/{part_name(number, form)}", inputs


def is_inputs(path: str) -> bool:
    """Tell whether a new run may write its lines here: there is no file, an empty one, or one of a run."""
    data = data_of(path, _WIDTH)
    return _LINE.match(data) is not None if data else True


def _line(name: bytes, state: bytes = _UNKNOWN, content: bytes = _UNKNOWN) -> bytes:
    """Make a line of its fields, each `_HEX` bytes; unknown where nothing told."""
    return b" ".join((name, state, content)) + b"\n"


def inputs_line(frame: Frame, notes: Mapping[str, Note], options: FramesOptions = _HERE) -> bytes:
    """Make the line of a frame; of one whose files were not all read, it says nothing of them.

    Parameters
    ----------
    frame : Frame
    notes : mapping from str to Note
        What was read for it, by location.
    options : FramesOptions
        They locate the frame's paths on this machine, and name the run.
    """
    found = []
    for path in frame.reads():
        note = notes.get(place := options.at(path))
        if note is None and path == frame.mask:  # that of the frame before, which is not read again
            note = _mask_note(place, state_of(place) or options.run)
        if note is None:
            return _line(_name(frame))
        found.append(note)
    content = [repr(frame.calibration), *(f"{note.size} {note.crc}" for note in found)]
    return _line(_name(frame), _state(frame, (note.state for note in found)), _hash(content))


@lru_cache(maxsize=1)
def _mask_note(path: str, state: str) -> Note | None:
    return _read([path]).get(path)


def _read(paths: Iterable[str]) -> dict[str, Note]:
    """Read files for their notes; one that cannot be read has none."""
    with noting() as notes:
        for path in paths:
            try:
                read_frame(path)
            except InputError:
                break
    return notes


def _name(frame: Frame) -> bytes:
    return _hash([frame.file, frame.right_file])


def _state(frame: Frame, states: Iterable[str]) -> bytes:
    every = [repr(frame.calibration), *states]
    return _hash(every) if all(every) else _UNKNOWN


def _hash(texts: Iterable[str]) -> bytes:
    data = "\0".join(texts).encode("utf-8", "surrogateescape")
    return blake2b(data, digest_size=_HEX // 2).hexdigest().encode()


def split_lines(data: bytes) -> list[bytes]:
    """Return the lines of rows."""
    return [data[at : at + _WIDTH] for at in range(0, len(data), _WIDTH)]


class Inputs:
    """The lines of an interrupted or earlier run, and those of the rows that are kept of it.

    Parameters
    ----------
    data : bytes
        Those of the run.
    updates : bool, optional
        Whether objects are looked at too, and what could not be read counts as changed.

    Attributes
    ----------
    lines : bytearray
        Those that were taken, with the state that the files have now where they hold the same.
    """

    def __init__(self, data: bytes, *, updates: bool = False) -> None:
        self.lines = bytearray()
        self._updates = updates
        self._data = data
        self._places: dict[bytes, int] = {}
        self._tags: dict[str, dict[str, str]] = {}

    def take(self, frame: Frame) -> bool:
        """Take the line of the frame that comes next; tell whether there is one."""
        wanted = _name(frame)
        line = self._line_at(len(self.lines), wanted) or self._line_at(self._place_of(wanted), wanted)
        self.lines += line
        return bool(line)

    def take_unknown(self, frame: Frame) -> None:
        """Take a line that knows nothing of the frame that comes next."""
        self.lines += _line(_name(frame))

    def has_changed(self, frame: Frame) -> bool:
        """Tell whether the frame whose line was taken last holds something else than its row was made from.

        Its files are read where their state is not the same; the line gets the new one if they still are.
        """
        _, state_before, content = bytes(self.lines[-_WIDTH:]).split()
        if content == _UNKNOWN:
            return self._updates
        if not self._updates and any(map(is_url, frame.reads())):  # that would take as long as reading them
            return False
        state = _state(frame, map(self._state_of, frame.reads()))
        if state_before == state != _UNKNOWN:
            return False
        now = inputs_line(frame, _read(frame.reads()))
        if now.split()[-1] != content:
            return True
        self.lines[-_WIDTH:] = now
        return False

    def _line_at(self, place: int, name: bytes) -> bytes:
        """Return the line of this name at a place; empty where another, a damaged one or none is there."""
        line = self._data[place : place + _WIDTH]
        return line if line.startswith(name) and _LINE.fullmatch(line) else b""

    def _place_of(self, name: bytes) -> int:
        """Find the line of a name, where frames were added or have gone since."""
        data = self._data
        if not self._places:
            self._places = {data[at : at + _HEX]: at for at in range(0, len(data), _WIDTH)}
        return self._places.get(name, len(data))

    def _state_of(self, path: str) -> str:
        if not is_object_url(path):
            return state_of(path)
        folder = path[: path.rindex("/") + 1]
        if folder not in self._tags:
            try:
                self._tags = {folder: {url: tag for url, _, tag in list_objects(folder)}}
            except RollcliError:  # it may not be listed: then its objects are read
                self._tags = {folder: {}}
        return self._tags[folder].get(path, "")
