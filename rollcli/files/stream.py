"""Write bytes to standard output, pipes and devices."""

import os
import stat
import sys
import uuid
from pathlib import Path

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import output_error, remove_leftovers, writing
from rollcli.files.storage import create, write_bytes

STDOUT = "-"  # how the command line names it
STDOUT_NAME = "standard output"


def is_stream(name: str) -> bool:
    """Tell whether a name is standard output, a device or a pipe, which no file can replace."""
    if name == STDOUT:
        return True
    try:
        mode = Path(name).stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


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
    if name == STDOUT:
        write_stdout(data)
    elif is_stream(name):
        descriptor = open_stream(name)
        try:
            write_stream(descriptor, data, name)
        finally:
            os.close(descriptor)
    else:
        remove_leftovers([name])
        if overwrite:
            write_bytes(name, data)
        elif not create(name, data, uuid.uuid4().hex):
            raise UsageError(f"{name}: exists already; give --overwrite to replace it")


def open_stream(name: str) -> int:
    """Open a device or pipe to write to.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with writing(name):
        return os.open(name, os.O_WRONLY)


def write_stdout(data: bytes) -> None:
    """Write to standard output; see `write_stream`."""
    write_stream(stdout_descriptor(), data, STDOUT_NAME)


def stdout_descriptor() -> int:
    """Find the descriptor of standard output.

    Raises
    ------
    OutputError
        It is closed.
    """
    if sys.stdout is None:  # Python's word for a closed one; its number may be another file's by now
        raise OutputError(f"{STDOUT_NAME}: is closed")
    return 1


def write_stream(descriptor: int, data: bytes, name: str = STDOUT_NAME) -> None:
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
