"""Lines on standard error: how every command says something to its user."""

import contextlib
import io
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rollcli.errors import raised_at

_shows_tracebacks = False
_ADDRESS = re.compile(r"(https?://)(?:[^\s/?#]*@)?([^\s?#'\"]*)(?:[?#][^\s'\"]*(?<!:))?", re.IGNORECASE)
_NAMES = "x-amz-[a-z-]+|x-goog-[a-z-]+|sig|signature|awsaccesskeyid|googleaccessid|key-pair-id|policy|token"
_SIGNATURE = re.compile(rf"[?&](?:{_NAMES})=[^\s&'\"]*", re.IGNORECASE)  # in a URL, behind a space in that


def say(*messages: str) -> None:
    """Write a line for each message to standard error, after the program's name.

    Control characters are escaped: a file name must neither forge a line nor command the terminal.
    """
    for message in messages:
        sys.stderr.write(f"rollcli: {printable(without_secrets(message))}\n")


def show_tracebacks() -> None:
    """Show from now on where an error is from that nobody expected."""
    global _shows_tracebacks
    _shows_tracebacks = True


def say_unexpected(error: BaseException) -> None:
    """Write an error that nobody expected as one line; with --verbose, its traceback below."""
    import traceback  # only here: it takes a while to load

    last = raised_at(error)
    where = f"{last.tb_frame.f_code.co_filename}:{last.tb_lineno}" if last else "nowhere"
    say(f"internal error, please report it: {type(error).__name__}: {error} ({where})")
    if _shows_tracebacks:
        for line in "".join(traceback.format_exception(error)).splitlines():
            sys.stderr.write(f"{printable(without_secrets(line))}\n")


def one_line(text: str) -> str:
    """Return a text in one line, with single spaces."""
    return " ".join(text.split())


def counted(count: int, what: str) -> str:
    """Return how many there are, in words."""
    return f"{count:,} {what}" + ("" if count == 1 else "s")


def listed(names: Iterable[str], most: int = 3) -> str:
    """Join the first few names, and say how many more there are."""
    every = list(names)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def without_secrets(text: str) -> str:
    """Leave out the passwords and the queries of web addresses, and signatures wherever they are."""
    return _SIGNATURE.sub("", _ADDRESS.sub(r"\1\2", text))


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
    the terminal is gone. What C libraries print where a stream was closed before the program started is lost,
    too: the file that is opened next would have its number, and hold that.
    """
    while (spare := os.open(os.devnull, os.O_RDWR)) <= 2:  # standard error's number
        os.set_inheritable(spare, True)  # workers that are spawned need it, too
    os.close(spare)
    if sys.stderr is None:  # it was closed before the program started
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 (open as long as the program runs)
        return
    buffer = sys.stderr.buffer
    raw = getattr(buffer, "raw", buffer)  # Python's option -u leaves out the buffer between
    sys.stderr = io.TextIOWrapper(
        _LossyWriter(raw), sys.stderr.encoding, errors="backslashreplace", write_through=True
    )


class _LossyWriter(io.RawIOBase):
    """Bytes to another raw stream; those that it does not take are dropped."""

    def __init__(self, raw: Any) -> None:
        self._raw = raw

    def write(self, data: Any) -> int:
        """Write what can be written; all of it counts as written."""
        rest = bytes(data)
        with contextlib.suppress(OSError, ValueError):  # the latter when it is closed
            while rest and (count := self._raw.write(rest)):
                rest = rest[count:]
        return len(data)

    def writable(self) -> bool:
        """Say that it takes bytes."""
        return True

    def fileno(self) -> int:
        """Give the descriptor: a terminal is asked for its size by it."""
        return int(self._raw.fileno())

    def isatty(self) -> bool:
        """Tell whether a person reads this."""
        return bool(self._raw.isatty())
