"""Lines on standard error: how every command says something to its user."""

import contextlib
import io
import os
import sys
from pathlib import Path
from typing import Any


def say(message: str) -> None:
    """Write one line to standard error, after the program's name.

    Control characters are escaped: a file name must neither forge a line nor command the terminal.
    """
    sys.stderr.write(f"rollcli: {printable(message)}\n")


def printable(text: str) -> str:
    r"""Escape what a terminal would obey or hide: ESC becomes ``\x1b``, a newline ``\n``."""
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode("ascii") for char in text
    )


def let_stderr_fail() -> None:
    """Replace standard error by a stream that never raises: a message that nobody reads is lost.

    A run must not end because its messages cannot be written: their reader has left, the log's disk is full,
    the terminal is gone.
    """
    if sys.stderr is None:  # it was closed before the program started
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 (open as long as the program runs)
        return
    descriptor, encoding = sys.stderr.fileno(), sys.stderr.encoding
    sys.stderr = io.TextIOWrapper(
        _LossyWriter(descriptor), encoding, errors="backslashreplace", write_through=True
    )


class _LossyWriter(io.RawIOBase):
    """Bytes to a descriptor; those that it does not take are dropped."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def write(self, data: Any) -> int:
        """Write what can be written; all of it counts as written."""
        rest = bytes(data)
        with contextlib.suppress(OSError):
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        return len(data)

    def writable(self) -> bool:
        """Say that it takes bytes."""
        return True

    def fileno(self) -> int:
        """Give the descriptor: a terminal is asked for its size by it."""
        return self._descriptor

    def isatty(self) -> bool:
        """Tell whether a person reads this."""
        return os.isatty(self._descriptor)
