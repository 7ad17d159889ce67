"""Worker processes on this machine.

Processes, not threads: decoding leaves the interpreter alone but the estimator's many small NumPy calls do
not, and a worker that dies takes no other with it. Spawned, never forked: a fork copies locks that other
threads hold.
"""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from multiprocessing import active_children, connection, context, parent_process, reduction
from typing import Any, Generic

from rollcli.batch.setup import prepare_worker
from rollcli.batch.signals import Stop
from rollcli.batch.workers import Done, Task, Work, in_order

_IN_FLIGHT_PER_WORKER = 4
_DIED = "its worker died each time: killed for memory, perhaps, or crashed"


def done_by_pool(
    tasks: Iterable[Task], work: Work[Task, Done], jobs: int, held: int | None, stop: Stop
) -> Generator[Done, None, None]:
    """What each task gives, in order, from `jobs` processes; `held` is a file that they keep open."""
    crew = PoolCrew(jobs, work, held)
    try:
        yield from in_order(tasks, crew, stop)
    except KeyboardInterrupt:  # asked twice
        crew.close(at_once=True)
        raise
    finally:
        crew.close()


class PoolCrew(Generic[Task, Done]):
    """A pool of `jobs` processes; `held` is an open file that they hold as long as they live."""

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, jobs: int, work: Work[Task, Done], held: int | None) -> None:
        self.window = _IN_FLIGHT_PER_WORKER * jobs
        self.broken = False
        self._jobs, self._work, self._held = jobs, work, _Held(held)
        self._pool = self._start(jobs)

    def submit(self, task: Task) -> "Future[Done]":
        """Start a task; if a worker has died, the future says so."""
        try:
            future = self._pool.submit(self._work.do, task)
        except BrokenExecutor as error:
            future = Future()
            future.set_exception(error)
            self.broken = True
        return future

    def again(self, task: Task) -> Done:
        """Do a lost task in a process of its own.

        Which task in flight took the worker with it is not known: one that dies alone, for certain for
        the first time, is tried once more.
        """
        self.broken = True
        for _ in range(2):
            with self._start(1) as pool, contextlib.suppress(BrokenExecutor):
                return pool.submit(self._work.do, task).result()
        return self._work.lost(task, _DIED)

    def renew(self) -> None:
        """A new pool in place of the broken one."""
        self._pool.shutdown()
        self._pool = self._start(self._jobs)
        self.broken = False

    def close(self, at_once: bool = False) -> None:
        """End the workers, after the tasks that they are at or at once."""
        for process in active_children() if at_once else ():
            process.kill()
        self._pool.shutdown(cancel_futures=True)

    def _start(self, jobs: int) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(jobs, _Context(), _prepare, (self._held,))


class _Process(context.SpawnProcess):
    """A process that Ctrl-C does not reach: only the run decides when work ends."""

    def start(self) -> None:
        with _signals_blocked():  # a child inherits what is blocked, from its first instruction
            super().start()


class _Context(context.SpawnContext):
    Process = _Process


@contextlib.contextmanager
def _signals_blocked() -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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


def _prepare(held: _Held) -> None:
    """What a worker does before its first task."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    prepare_worker()


def _end_with_parent() -> None:
    """A killed run leaves no workers that go on writing."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
