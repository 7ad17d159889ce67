"""Let Ctrl-C and SIGTERM stop a run after the tasks that have begun; the second one stops it at once."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType


class Stop:
    """Whether the run was asked to stop, and whether at once."""

    asked = False
    at_once = False


@contextlib.contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Set `Stop` instead of ending the process, as long as the block lasts.

    The second signal raises KeyboardInterrupt. Later ones are ignored, also after the block: the run is
    about to end, and must not be disturbed while it says how to continue.
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
        yield stop  # Python lets only the main thread handle signals
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.asked else handler)
