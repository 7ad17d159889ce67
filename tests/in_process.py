"""The program in this process: what it does at a fifth of what a process costs, and leaves no trace in it."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import _lru_cache_wrapper, cache
from pathlib import Path
from threading import Thread
from typing import NamedTuple, TextIO

import cv2

from rollcli.cli.main import main
from rollcli.files.codecs import png as mute_stderr
from rollcli.files.stores import locations as turns
from rollcli.messages import let_stderr_fail
from rollcli.run.workers.interrupt import stop_signals


class Finished(NamedTuple):
    """What a run of the program left."""

    status: int
    out: str
    err: str

    def refused(self) -> str:
        """The one line of a run that a usage error ended before it wrote anything."""
        assert (self.status, self.out, self.err.count("\n")) == (2, "", 1), self
        return self.err


def run_here(arguments: Sequence[str], cwd: Path, stdin: str, environment: Mapping[str, str]) -> Finished:
    """Run the program to its end; an error that nobody expected is raised, and so are warnings."""
    status = 0
    with _process_state(cwd, environment), _streams(stdin) as end_streams:
        let_stderr_fail()
        sys.argv = ["rollcli", *arguments]
        try:
            main(prog_name="rollcli")
        except SystemExit as end:
            status = int(end.code or 0)
        out, err = end_streams()
    return Finished(status, out, err)


@contextlib.contextmanager
def _process_state(cwd: Path, environment: Mapping[str, str]) -> Iterator[None]:
    """Give the program what a process of its own would have, and take back what it changes."""
    _forget()
    folder, variables, line = Path.cwd(), dict(os.environ), sys.argv
    threads, sink, in_hand = cv2.getNumThreads(), mute_stderr._sink, turns._IN_HAND
    handlers = {number: signal.getsignal(number) for number in stop_signals()}
    mute_stderr._sink = None
    turns._IN_HAND = 1  # more, which URLs ask for, are the matter of a worker
    os.chdir(cwd)
    _set_environment(environment)
    try:
        yield
    finally:
        _forget()
        _set_environment(variables)
        os.chdir(folder)
        sys.argv = line
        cv2.setNumThreads(threads)
        if mute_stderr._sink is not None:
            os.close(mute_stderr._sink)
        mute_stderr._sink, turns._IN_HAND = sink, in_hand
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _set_environment(variables: Mapping[str, str]) -> None:
    os.environ.clear()
    os.environ.update(variables)


def _forget() -> None:
    """Empty the program's caches: a relative path means another file in another folder."""
    for name in [each for each in sys.modules if each.startswith("rollcli.")]:
        for cached in _cached_functions(name):
            cached.cache_clear()


@cache
def _cached_functions(module: str) -> list[_lru_cache_wrapper]:
    return [each for each in vars(sys.modules[module]).values() if isinstance(each, _lru_cache_wrapper)]


@contextlib.contextmanager
def _streams(stdin: str) -> Iterator[Callable[[], tuple[str, str]]]:
    """Put pipes in the place of the standard streams; yields what ends them and returns what was written."""
    saved, before = [os.dup(number) for number in range(3)], (sys.stdin, sys.stdout, sys.stderr)
    pipes = [os.pipe() for _ in range(3)]
    for number, end in ((0, 0), (1, 1), (2, 1)):
        os.dup2(pipes[number][end], number)
        os.close(pipes[number][end])
    written = {1: b"", 2: b""}

    def feed() -> None:
        with contextlib.suppress(BrokenPipeError), os.fdopen(pipes[0][1], "wb") as file:
            file.write(stdin.encode("utf-8", "surrogateescape"))

    def take(number: int) -> None:
        with os.fdopen(pipes[number][0], "rb") as file:
            written[number] = file.read()

    threads = [Thread(target=feed), *(Thread(target=take, args=(number,)) for number in written)]
    for thread in threads:
        thread.start()
    opened = (_stream(0, "r"), _stream(1, "w"), _stream(2, "w"))
    sys.stdin, sys.stdout, sys.stderr = opened

    def end() -> tuple[str, str]:
        if saved:
            for each in opened:
                each.close()
            for number, descriptor in enumerate(saved):  # a reader sees the end when the last writer has gone
                os.dup2(descriptor, number)
                os.close(descriptor)
            saved.clear()
            for thread in threads:
                thread.join()
        out, err = (text.decode("utf-8", "surrogateescape") for text in written.values())
        return out, err

    try:
        yield end
    finally:
        sys.stdin, sys.stdout, sys.stderr = before
        end()


def _stream(descriptor: int, mode: str) -> TextIO:
    """Open a standard stream as Python does; newlines stay as they are."""
    errors = "backslashreplace" if descriptor == 2 else "surrogateescape"
    return open(descriptor, mode, encoding="utf-8", errors=errors, newline="", closefd=False)
