"""Tasks for worker processes, which import them by name."""

import os
import signal
from itertools import chain
from pathlib import Path

import cv2

from rollcli.errors import InputError
from rollcli.run.workers import tasks as ordered
from rollcli.run.workers.chunks import Work
from tests.run_cli import wait_until


def run(task):
    """Do what the task's first word says; the others are paths or values."""
    kind, *arguments = task
    return {
        "give": _give,
        "wait": _wait,
        "touch": _touch,
        "die": _die,
        "die_once": _die_once,
        "hold": _hold,
        "append": _append,
        "signals": _signals,
        "raise": _raise,
        "threads": cv2.getNumThreads,
    }[kind](*arguments)


def in_order(tasks, executor, stop, **of_work):
    """The results one by one."""
    return chain.from_iterable(ordered.in_order(tasks, Work(run, lost, **of_work), executor, stop))


def lost(task, reason):
    """The result of a task whose worker died."""
    return ("lost", task, reason)


def _give(value):
    return value


def _wait(path):
    wait_until(Path(path).exists)
    return "waited"


def _touch(path):
    Path(path).touch()
    return "touched"


def _die():
    os.kill(os.getpid(), signal.SIGKILL)


def _die_once(path):
    if Path(path).exists():
        return "survived"
    Path(path).touch()
    return _die()


def _hold(path, event):
    """Have a file there until the event."""
    Path(path).touch()
    _wait(event)
    Path(path).unlink()
    return "held"


def _append(path, text):
    with Path(path).open("a") as file:
        file.write(text)


def _signals():
    """The process, the signals that it ignores, and those that never reach it."""
    ignored = {each for each in signal.valid_signals() if signal.getsignal(each) is signal.SIG_IGN}
    return os.getpid(), ignored, signal.pthread_sigmask(signal.SIG_BLOCK, ())


def _raise(name):
    raise {"input": InputError("a.png: is no map"), "key": KeyError("key")}[name]
