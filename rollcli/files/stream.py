"""Bytes to standard output, pipes and devices."""

import os
import sys

from rollcli.errors import OutputError
from rollcli.files.atomic import output_error

STDOUT = "-"  # how the command line names it
STDOUT_NAME = "standard output"


def write_stdout(data: bytes) -> None:
    """Write to standard output; see `write_stream`."""
    write_stream(stdout_descriptor(), data, STDOUT_NAME)


def stdout_descriptor() -> int:
    """The open file that is standard output.

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
        The reader has had enough.
    """
    try:
        while data:
            data = data[os.write(descriptor, data) :]
    except BrokenPipeError:
        raise
    except OSError as error:
        raise output_error(name, error) from error
