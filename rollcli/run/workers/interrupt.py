"""Let Ctrl-C, SIGTERM and SIGHUP stop a run after the tasks that have begun; a second one, at once."""

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType


class Stop:
    """Whether the run was asked to stop, and whether at once."""

    asked = False
    at_once = False


def stop_signals() -> list[signal.Signals]:
    """List the signals that stop a run.

    SIGHUP, which says that the terminal is gone, is one of them unless it is ignored, as `nohup` does.
    """
    signals = [signal.SIGINT, signal.SIGTERM]
    hangup: signal.Signals | None = getattr(signal, "SIGHUP", None)  # not on Windows
    if hangup is not None and signal.getsignal(hangup) is not signal.SIG_IGN:
        signals.append(hangup)
    return signals


def raise_on_signals() -> None:
    """Let the first of the signals raise KeyboardInterrupt: for the time before a run and after it.

    Later ones are ignored: the program is about to end, and must not be disturbed while it says so.
    """
    stop = Stop()
    stop.asked = True
    _listen(stop)


def _listen(stop: Stop) -> None:
    """Let the first signal ask to stop, and the next one raise KeyboardInterrupt; ignore those after it.

    Where Python swallows a KeyboardInterrupt, the next signal raises one again. It does so in callbacks of
    weak references and in finalizers, and would print a traceback.
    """

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.at_once:
            return
        if stop.asked:
            stop.at_once = True
            raise KeyboardInterrupt
        stop.asked = True

    usual = sys.unraisablehook

    def hook(swallowed: "sys.UnraisableHookArgs") -> None:
        if issubclass(swallowed.exc_type, KeyboardInterrupt):
            stop.at_once = False
        else:
            usual(swallowed)

    sys.unraisablehook = hook
    for number in stop_signals():
        signal.signal(number, ask)


def came_of_interrupt(error: RuntimeError) -> bool:
    """Tell whether Python made this error of a KeyboardInterrupt.

    It does so where one comes while a lock is released, and, before 3.12, while an attribute learns its name.
    """
    before: BaseException | None = error
    while before is not None and not isinstance(before, KeyboardInterrupt):
        before = before.__cause__ or before.__context__
    return before is not None


def ignore_signals() -> None:
    """Ignore the signals: the process is ending, or another one decides when it does."""
    for number in stop_signals():
        signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Set `Stop` instead of ending the process, as long as the block lasts.

    The second signal raises KeyboardInterrupt. Later ones are ignored, also after the block: the run is
    about to end, and must not be disturbed while it says how to continue.
    """
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop  # Python lets only the main thread handle signals
        return
    usual, before = sys.unraisablehook, {number: signal.getsignal(number) for number in stop_signals()}
    _listen(stop)
    try:
        yield stop
    except RuntimeError as error:
        if came_of_interrupt(error):
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = usual
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.asked else handler)
