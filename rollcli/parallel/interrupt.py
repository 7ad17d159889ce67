"""Ctrl-C and SIGTERM ask a run to stop after the frames in flight; asked twice, it stops at once."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType


class Stop:
    """Whether the run was asked to stop, and whether that was at once."""

    asked = False
    at_once = False


@contextlib.contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Turn the signals into a request for as long as the block lasts.

    A run that was asked is about to end: from then on, and after the block, a third Ctrl-C changes nothing.
    """
    stop = Stop()

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.at_once:
            return
        if stop.asked:
            stop.at_once = True
            raise KeyboardInterrupt
        stop.asked = True

    if threading.current_thread() is not threading.main_thread():
        yield stop  # only the main thread may handle signals; it does then
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.asked else handler)
