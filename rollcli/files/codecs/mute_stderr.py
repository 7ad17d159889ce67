"""What C libraries print about a file they decode: kept from the terminal, and read as their verdict.

libjpeg fills a damaged image up and tells so on stderr alone.
"""

import contextlib
import os
import tempfile
from collections.abc import Iterator

_MOST = 4000  # bytes of it that are looked at
_sink: int | None = None


class Printed:
    """What was printed while a file was decoded; known once that is over.

    Attributes
    ----------
    text : str
        Empty when nothing was printed, or when `silence_decoders` was not called.
    """

    def __init__(self) -> None:
        self.text = ""


def silence_decoders() -> None:
    """Let nothing that `decoding` surrounds reach the terminal, from now on.

    For processes that work on frames and on nothing else: what another thread says meanwhile is taken too.
    """
    global _sink
    if _sink is None:
        try:
            with tempfile.TemporaryFile() as file:
                _sink = os.dup(file.fileno())
        except OSError:  # no room for temporary files: the verdict is lost, and the terminal stays clean
            _sink = os.open(os.devnull, os.O_RDWR)


@contextlib.contextmanager
def decoding() -> Iterator[Printed]:
    """Turn stderr, as C libraries know it, away for a moment; nothing at all where nobody asked for it."""
    printed = Printed()
    try:
        terminal = None if _sink is None else os.dup(2)
    except OSError:  # stderr is closed: nothing can be printed
        terminal = None
    if _sink is None or terminal is None:
        yield printed
        return
    os.dup2(_sink, 2)
    try:
        yield printed
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)
        printed.text = _taken(_sink)


def _taken(sink: int) -> str:
    """Return what was printed into the file, which is empty again after that."""
    if not os.lseek(sink, 0, os.SEEK_CUR):
        return ""
    os.lseek(sink, 0, os.SEEK_SET)
    text = os.read(sink, _MOST).decode("utf-8", "replace")
    os.lseek(sink, 0, os.SEEK_SET)
    os.truncate(sink, 0)
    return text
