"""One worker process: tasks go in through a pipe, and what they give comes out."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from multiprocessing import connection, reduction
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

from rollcli.errors import RollcliError, WorkerError
from rollcli.parallel.process_setup import prepare_worker


class Worker:
    """This side of a worker process.

    Spawned, never forked: a fork copies locks that other threads hold.

    Parameters
    ----------
    do : callable
        What is done with each task.
    held : int or None
        An open file that the process holds as long as it lives.

    Raises
    ------
    WorkerError
        The system starts no further process.

    Attributes
    ----------
    asked : deque
        What it was asked for and has not answered, oldest first: that one it is working on.
    """

    def __init__(self, do: Callable[[Any], Any], held: int | None) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.asked: deque[Any] = deque()
        try:
            self.pipe, far = spawn.Pipe()
            self._process = spawn.Process(target=_serve, args=(far, do, _Held(held)), daemon=True)
            with _no_ctrl_c():  # a child inherits what is blocked: only the run decides when work ends
                self._process.start()
        except OSError as error:
            raise _unable(error) from error
        far.close()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def close(self) -> None:
        """End it after what it is working on."""
        self.pipe.close()
        self._process.join()


def _serve(pipe: "Connection[Any, Any]", do: Callable[[Any], Any], held: "_Held") -> None:
    """What the process does; `held` is open as long as it lives."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    unable = _prepare()
    with contextlib.suppress(EOFError, OSError):  # the other side is closed: all is done
        while True:
            task = pipe.recv()
            with _Outcome() as outcome:
                if unable is not None:
                    raise unable
                outcome.value = do(task)
            pipe.send((outcome.value, outcome.error))
    os._exit(0)  # there is nothing to tidy up, and taking NumPy and OpenCV down takes longer than two frames


def _prepare() -> WorkerError | None:
    """What keeps this process from working: not the fault of any task."""
    try:
        prepare_worker()
    except (ImportError, OSError, MemoryError) as error:  # no memory left for NumPy or OpenCV
        return _unable(error)
    return None


def _unable(error: Exception) -> WorkerError:
    return WorkerError(f"a worker process cannot start: {error}; try fewer of them, with --jobs")


def _end_with_parent() -> None:
    """A killed run leaves no workers that go on writing."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


class _Outcome:
    """What a task gives, or the error that it ends with, which is raised where the answer is wanted."""

    value: Any = None
    error: Exception | None = None

    def __enter__(self) -> "_Outcome":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> bool:
        if isinstance(error, RollcliError):
            self.error = error
        elif isinstance(error, Exception):
            while at is not None and at.tb_next is not None:
                at = at.tb_next
            where = f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}" if at else "a worker"
            self.error = RuntimeError(f"{type(error).__name__} in {where}: {error}")
        return self.error is not None


class _Held:
    """An open file that a spawned process receives, open."""

    def __init__(self, descriptor: int | None) -> None:
        self.descriptor = descriptor

    def __reduce__(self) -> tuple[Any, ...]:
        if self.descriptor is None or sys.platform == "win32":
            return _Held, (None,)
        return _received, (reduction.DupFd(self.descriptor),)


def _received(duplicate: Any) -> _Held:
    return _Held(duplicate.detach())


@contextlib.contextmanager
def _no_ctrl_c() -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # not on Windows

    resource_tracker.ensure_running()  # it would be started in between, and unblocks what it finds blocked
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
