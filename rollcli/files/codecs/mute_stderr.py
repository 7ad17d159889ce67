"""Silence for C libraries that print on the terminal what is wrong with a file: its row says so."""

import contextlib
import os
from collections.abc import Iterator

_sink: int | None = None


def silence_decoders() -> None:
    """Let nothing that `decoding` surrounds reach the terminal, from now on.

    For processes that work on frames and on nothing else: what another thread says meanwhile is lost too.
    """
    global _sink
    if _sink is None:
        _sink = os.open(os.devnull, os.O_WRONLY)


@contextlib.contextmanager
def decoding() -> Iterator[None]:
    """Turn stderr, as C libraries know it, away for a moment; nothing at all where nobody asked for it."""
    try:
        terminal = None if _sink is None else os.dup(2)
    except OSError:  # stderr is closed: nothing can be printed
        terminal = None
    if _sink is None or terminal is None:
        yield
        return
    os.dup2(_sink, 2)
    try:
        yield
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)
