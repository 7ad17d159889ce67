"""Bytes wherever they lie: on local disk, in an object store, on a web server; and streams that take them.

Import-light: obstore is loaded when the first URL of an object store is read or written.
"""

import contextlib
import hashlib
import os
import stat
import sys
import uuid
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rollcli.errors import InputError, OutputError, UsageError, output_error, reading, writing
from rollcli.files import atomic, bounded
from rollcli.files.bounded import MOST_BYTES
from rollcli.files.containers import file_of, read_member
from rollcli.files.stores import objects
from rollcli.files.stores.locations import is_url, is_web_url, public_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

Beginning = Callable[[bytes, int, str], None] | None
_HEAD = 2**16  # bytes: the header of an array
_READ_ONLY = "web servers are read from, not written to"
STREAM = "-"  # how the command line names standard input and output
_STDOUT, _STDOUT_NAME = (STREAM, "/dev/stdout"), "standard output"  # which is a file behind `>`


class Note(NamedTuple):
    """What was read: the state of its file (see `state_of`), and the size and CRC-32 of the bytes.

    A cryptographic digest of an uncompressed map takes 15 % of the time of its frame, this one 6 %.
    """

    state: str
    size: int
    crc: int


_notes: ContextVar[dict[str, Note] | None] = ContextVar("notes", default=None)


@contextlib.contextmanager
def noting(wanted: bool = True) -> Iterator[dict[str, Note]]:
    """Take a note, if wanted, of each location that this thread reads in the block by `read_frame`."""
    notes: dict[str, Note] = {}
    token = _notes.set(notes if wanted else None)
    try:
        yield notes
    finally:
        _notes.reset(token)


def state_of(location: str) -> str:
    """Return size and time of a file, or of the file that a frame lies in; empty where nothing tells them.

    Of an object, `read_frame` notes the entity tag, which listings have too (`objects.list_objects`).
    """
    if is_url(location):
        return ""
    try:
        _, size, time_ns, _ = bounded.state_of(file_of(location))
    except (InputError, ValueError):
        return ""
    return f"{size} {time_ns}"


def read_bytes(location: str | Path, name: str | None = None, *, most: int = MOST_BYTES) -> bytes:
    """Return the bytes of a file or an object; see `read_frame`.

    Raises
    ------
    InputError
        Also where it is a frame of a recording, which is in no file.
    """
    data = read_frame(location, name, most=most)
    if not isinstance(data, bytes):
        raise InputError(f"{name or public_name(str(location))}: is a frame of a recording, and no file")
    return data


def read_frame(
    location: str | Path, name: str | None = None, *, most: int = MOST_BYTES, begins: Beginning = None
) -> "bytes | NDArray[Any]":
    """Return the bytes of a file or an object, or the pixels of a recording's frame.

    Parameters
    ----------
    location : str or Path
        A path, a frame inside of a file (see `containers`), or a URL of s3, gs, az, http or https.
    name : str, optional
        What errors call it; by default the location, without secrets.
    most : int
        Bytes that are read; a larger file is refused before it is read.
    begins : callable, optional
        Refuses a file on disk by its first bytes, its size and its name, before the rest is read.

    Raises
    ------
    InputError
        It does not exist, has more bytes than `most`, may not be read, is empty, is no regular file, or its
        store does not answer.
    UsageError
        The scheme of its URL is not supported, or an extra is missing.
    """
    location = str(location)
    name = name or public_name(location)
    notes = _notes.get()
    state = "" if notes is None else state_of(location)  # before the bytes: a change amid them shows
    data: bytes | NDArray[Any]
    if is_web_url(location):
        from rollcli.files.stores.web import read_web_file  # urllib takes longer to load than all of this

        data = read_web_file(location, most)
    elif is_url(location):
        data, state = objects.read_object(location, most)  # the tag is noted
    else:
        inside = read_member(location, name, most)
        data = inside if inside is not None else _read_file(location, name, most, begins)
    if len(data) == 0:
        raise InputError(f"{name}: is empty")
    if notes is not None:
        content: Any = data
        notes[location] = Note(state, memoryview(content).nbytes, zlib.crc32(content))
    return data


def read_named(location: str | Path, most: int = MOST_BYTES, subject: str = "") -> bytes:
    """Return the bytes of a file, a pipe, a URL or standard input ("-") that a user named.

    Errors of the system call it `subject`, where its name alone does not tell what it is.

    Raises
    ------
    InputError
        It cannot be read, or has more bytes than `most`.
    """
    name = str(location)
    if is_url(name):
        return read_bytes(name, most=most)
    if name == STREAM and sys.stdin is None:
        raise InputError(f"{name}: stdin is closed; nothing can be read from it")
    with reading(name, subject):
        if name == STREAM:
            return bounded.read_stream(sys.stdin.buffer, name, most)
        return bounded.read_given(name, most)


def fetch_all(locations: Iterable[str], most: int = MOST_BYTES) -> dict[str, bytes]:
    """Read many small objects at once, each of so many bytes at most.

    Raises
    ------
    InputError
        One of them cannot be read.
    """
    every = list(locations)
    return dict(zip(every, atomic.in_threads(partial(read_bytes, most=most), every), strict=True))


def read_problem(url: str) -> str:
    """Say what keeps an object or a web file from being read, and probably others; empty where nothing does.

    Raises
    ------
    UsageError
        The scheme is not supported, or an extra is missing.
    """
    if is_web_url(url):
        from rollcli.files.stores.web import web_problem

        return web_problem(url)
    return objects.problem_of(url, writes=False)


def write_problem(folder: str) -> str:
    """Say what keeps everything below a URL from being written; empty where nothing is known to.

    Raises
    ------
    UsageError
        The scheme is not supported, or an extra is missing.
    """
    return _READ_ONLY if is_web_url(folder) else objects.problem_of(folder, writes=True)


def write_bytes(location: str, data: bytes, *, durable: bool = False, owner: str = "") -> None:
    """Write a file or an object, whole or not at all; what is there is replaced.

    Parameters
    ----------
    location : str
        A path, or a URL of an object store.
    data : bytes
    durable : bool
        Whether a file survives a power cut once this returns, as an object always does.
    owner : str
        Names who writes an object; `objects.object_owner` returns it. A file has a lock instead.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    if _is_object(location):
        objects.write_object(location, data, owner)
    else:
        atomic.write_atomic(location, data, durable=durable)


def create(location: str, data: bytes, owner: str = "", *, durable: bool = True) -> bool:
    """Write a file or an object unless there is one of this name; return whether this owner wrote it.

    A file that holds these very bytes counts as this owner's; and where files need not be durable, one that
    holds as many of them as a power cut left of an earlier write: the first ones, and zeros where the rest
    should be.

    Parameters
    ----------
    location : str
        A path, or a URL of an object store.
    data : bytes
    owner : str
        Names who writes an object, by default whoever writes these bytes. A store may have taken a request
        whose answer was lost; when the request is repeated, this name tells our own object from another's.
    durable : bool
        Whether a file survives a power cut once this returns, as an object always does.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    if _is_object(location):
        return objects.create_object(location, data, owner or hashlib.sha256(data).hexdigest())
    try:
        atomic.write_atomic(location, data, durable=durable, replaces=False)
    except atomic.NameTakenError:
        try:
            there = _read_file(location, location, len(data))
        except InputError:  # no regular file of at most so many bytes
            return False
        if there == data:  # by a worker that died before it could say so, perhaps
            return True
        if durable or not data.startswith(there.rstrip(b"\0")):
            return False
        atomic.write_atomic(location, data)
    return True


def list_names(folder: str) -> list[str]:
    """Return the names of the files in a folder, or of the objects below a prefix; none if it is absent."""
    if is_url(folder):
        if is_web_url(folder):
            return []  # a web server cannot be asked
        base = folder.rstrip("/") + "/"
        return [url.removeprefix(base) for url, *_ in objects.list_objects(base)]
    with reading(folder), contextlib.suppress(FileNotFoundError, NotADirectoryError):
        return [path.name for path in Path(folder).iterdir()]
    return []


def remove(location: str) -> None:
    """Remove a file or an object; none of this name is no error.

    Raises
    ------
    OutputError
        It cannot be removed.
    """
    if _is_object(location):
        objects.remove_object(location)
        return
    with writing(location):
        Path(location).unlink(missing_ok=True)


def remove_all(locations: Iterable[str]) -> None:
    """Remove many files or objects at once; see `remove`."""
    atomic.in_threads(remove, list(locations))


def _read_file(path: str, name: str, most: int = MOST_BYTES, begins: Beginning = None) -> bytes:
    """Return the bytes of a regular file; pipes and devices could be read for ever."""
    try:
        # not blocking: a named pipe would otherwise wait for its writer for ever
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(descriptor, "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f"{name}: is not a regular file")
            if begins is not None and _HEAD < status.st_size <= most:
                begins(file.read(_HEAD), status.st_size, name)
                file.seek(0)
            return bounded.read_stream(file, name, most)
    except IsADirectoryError:
        raise InputError(f"{name}: is a folder, not a file") from None
    except FileNotFoundError:
        dangling = os.path.lexists(path)
        raise InputError(f"{name}: {'is a link to nothing' if dangling else 'no such file'}") from None
    except (OSError, ValueError) as error:
        reason = str(getattr(error, "strerror", None) or error).lower()
        raise InputError(f"{name}: cannot be read: {reason}", reason) from None


def _is_object(location: str) -> bool:
    """Tell whether what is written here is an object and no file; refuse what is on a web server."""
    if is_web_url(location):
        raise OutputError(f"{public_name(location)}: {_READ_ONLY}")
    return is_url(location)


def is_stream(name: str) -> bool:
    """Tell whether a name is standard output, a device or a pipe, which no file can replace."""
    mode = atomic.mode_of(name)
    return name in _STDOUT or not (mode == 0 or stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def write_output(name: str, data: bytes, *, overwrite: bool) -> None:
    """Write to standard output, into a device or pipe, or as a file or object that is whole or not there.

    Parameters
    ----------
    name : str
        A path, a URL of an object store, or "-".
    data : bytes
    overwrite : bool
        Whether a file or object is replaced; otherwise it stays, also where another program has written it
        since this one looked.

    Raises
    ------
    UsageError
        There is one, and it is not replaced.
    OutputError
        It cannot be written.
    BrokenPipeError
        The reader has closed its end.
    """
    if is_stream(name):
        with open_stream(name) as write:
            write(data)
    else:
        atomic.remove_leftovers([name])
        if overwrite:
            write_bytes(name, data)
        elif not create(name, data, uuid.uuid4().hex):
            raise UsageError(f"{name}: exists already; give --overwrite to replace it")


@contextlib.contextmanager
def open_stream(name: str) -> Iterator[Callable[[bytes], None]]:
    """Open standard output, a device or a pipe; yield what writes all of some bytes to it.

    Raises
    ------
    OutputError
        It cannot be written, or standard output is closed.
    BrokenPipeError
        The reader has closed its end.
    """
    if name in _STDOUT:
        if sys.stdout is None:  # Python's word for a closed one; its number may be another file's by now
            raise OutputError(f"{_STDOUT_NAME}: is closed")
        yield partial(write_stream, 1, name=_STDOUT_NAME)
        return
    with writing(name):
        descriptor = os.open(name, os.O_WRONLY)
    try:
        yield partial(write_stream, descriptor, name=name)
    finally:
        os.close(descriptor)


def write_stream(descriptor: int, data: bytes, name: str) -> None:
    """Write all of the data; errors call the stream `name`.

    Raises
    ------
    OutputError
        It cannot be written.
    BrokenPipeError
        The reader has closed its end.
    """
    try:
        while data:
            data = data[os.write(descriptor, data) :]
    except BrokenPipeError:
        raise
    except OSError as error:
        raise output_error(name, error) from error
