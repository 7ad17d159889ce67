"""Tasks for worker processes, which import them by name."""

import os
import signal
import time
from pathlib import Path

import cv2

from rollcli.errors import InputError


def run(task):
    """Do what the task's first word says; the others are paths or values."""
    kind, *arguments = task
    return {
        "give": _give,
        "wait": _wait,
        "touch": _touch,
        "die": _die,
        "die_once": _die_once,
        "raise": _raise,
        "threads": cv2.getNumThreads,
    }[kind](*arguments)


def lost(task, reason):
    """The result of a task whose worker died."""
    return ("lost", task, reason)


def _give(value):
    return value


def _wait(path):
    while not Path(path).exists():
        time.sleep(0.002)
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


def _raise(name):
    raise {"input": InputError("a.png: is no map"), "key": KeyError("key")}[name]
