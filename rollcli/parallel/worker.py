"""One worker process: it receives tasks through a pipe, and sends their results back."""

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
from rollcli.files.stores.turns import computing
from rollcli.parallel.interrupt import ignore_signals, stop_signals
from rollcli.parallel.process_setup import prepare_worker

_POLL_S = 0.002  # a task that waits for the network takes ten times as long


class Worker:
    """The parent's end of a worker process.

    The process is spawned, not forked: a fork copies locks that other threads hold.

    Parameters
    ----------
    do : callable
        Turns a task into its result.
    keep_open : int or None
        A file descriptor that the process inherits and keeps open until it ends.
    threads : int
        Tasks that it runs at once; their answers come in the order of the tasks.

    Raises
    ------
    WorkerError
        The system starts no further process.

    Attributes
    ----------
    pipe : Connection
        Tasks go in, (result, error) comes out.
    pending : deque
        The futures of the tasks that were sent and not answered, oldest first: the first one is running.
    """

    def __init__(self, do: Callable[[Any], Any], keep_open: int | None, threads: int) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.pending: deque[Any] = deque()
        try:
            self.pipe, far_end = spawn.Pipe()
            inherited = _InheritedFile(keep_open)
            arguments = (far_end, do, inherited, threads)
            self._process = spawn.Process(target=_serve, args=arguments, daemon=True)
            with _stop_signals_blocked():  # the child inherits this: only the parent decides when work ends
                self._process.start()
        except OSError as error:
            raise _cannot_start(error) from error
        far_end.close()

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def close(self) -> None:
        """End the process after its current task, and wait for that."""
        self.pipe.close()
        self._process.join()


def _serve(
    pipe: "Connection[Any, Any]", do: Callable[[Any], Any], inherited: "_InheritedFile", threads: int
) -> None:
    """Run tasks until the pipe is closed; `inherited` is an argument so that its file stays open."""
    ignore_signals()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    start_error = _prepare()

    def answer(task: Any) -> tuple[Any, Exception | None]:
        with _Answer() as answer:
            if start_error is not None:
                raise start_error
            answer.value = do(task)
        return answer.value, answer.error

    with contextlib.suppress(EOFError, OSError):  # the parent has closed its end: all is done
        if threads == 1:
            while True:
                pipe.send(answer(pipe.recv()))
        _serve_in_threads(pipe, answer, threads)
    os._exit(0)  # there is nothing to clean up, and unloading NumPy and OpenCV takes longer than two frames


def _serve_in_threads(pipe: "Connection[Any, Any]", answer: Callable[[Any], Any], threads: int) -> None:
    """Answer tasks in their order, while those after them run, too; one computes at a time."""
    from concurrent.futures import ThreadPoolExecutor  # only where tasks wait for the network

    def in_turn(task: Any) -> Any:
        with computing():
            return answer(task)

    pool, running = ThreadPoolExecutor(threads), deque[Any]()
    while True:
        if not running or pipe.poll():
            running.append(pool.submit(in_turn, pipe.recv()))
        elif running[0].done():
            pipe.send(running.popleft().result())
        else:
            connection.wait([pipe], timeout=_POLL_S)


def _prepare() -> WorkerError | None:
    """Set up this process; return the error that keeps it from working, since no task is to blame for it."""
    try:
        prepare_worker()
    except (ImportError, OSError, MemoryError) as error:  # no memory left for NumPy or OpenCV
        return _cannot_start(error)
    return None


def _cannot_start(error: Exception) -> WorkerError:
    return WorkerError(f"a worker process cannot start: {error}; try fewer of them, with --jobs")


def _end_with_parent() -> None:
    """Exit when the parent has died: a killed run must leave no workers that go on writing."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


class _Answer:
    """The result of a task, or the error that it raised, which the parent raises again."""

    value: Any = None
    error: Exception | None = None

    def __enter__(self) -> "_Answer":
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


class _InheritedFile:
    """A file descriptor that is still open after this object was sent to a spawned process."""

    def __init__(self, descriptor: int | None) -> None:
        self.descriptor = descriptor

    def __reduce__(self) -> tuple[Any, ...]:
        if self.descriptor is None or sys.platform == "win32":
            return _InheritedFile, (None,)
        return _received, (reduction.DupFd(self.descriptor),)


def _received(duplicate: Any) -> _InheritedFile:
    return _InheritedFile(duplicate.detach())


@contextlib.contextmanager
def _stop_signals_blocked() -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # not on Windows

    resource_tracker.ensure_running()  # it would start inside the block, and unblock Ctrl-C when it does
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set(stop_signals()))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
