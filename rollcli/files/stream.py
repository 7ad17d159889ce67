"""Write bytes to standard output, pipes and devices."""

import contextlib
import os
import stat
import sys
import uuid
from collections.abc import Callable, Iterator
from functools import partial

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import mode_of, output_error, remove_leftovers, writing
from rollcli.files.storage import create, write_bytes

STDOUT = "-"  # how the command line names it
_STDOUT_NAME = "standard output"


def is_stream(name: str) -> bool:
    """Tell whether a name is standard output, a device or a pipe, which no file can replace."""
    mode = mode_of(name)
    return name == STDOUT or not (mode == 0 or stat.S_ISREG(mode) or stat.S_ISDIR(mode))


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
        remove_leftovers([name])
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
    if name == STDOUT:
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
