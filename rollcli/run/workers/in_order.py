"""Give tasks to an executor and yield their results in the tasks' order, with few tasks in flight."""

import contextlib
from collections import deque
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

from rollcli.run.workers.chunks import Chunks, Done, Result, Span, Task, Work
from rollcli.run.workers.interrupt import Stop


@dataclass(frozen=True)
class Workers:
    """Which workers run the tasks.

    Attributes
    ----------
    jobs : int or None
        Processes on this machine; None: one for each usable processor.
    scheduler : str or None
        The address of a Dask scheduler, whose workers are used instead.
    files : tuple of str
        A sample of the files that the tasks read, which the workers of a cluster must see as this process
        does; those that do not exist are ignored.
    folders : tuple of str
        Where the tasks write; the same holds for them.
    keep_open : int or None
        A file descriptor that processes on this machine inherit and keep open until they end.
    threads : int
        Tasks that each worker has in hand at once: more than one where they wait for the network. One of
        them computes at a time.
    started : list of pool.Worker
        Processes that were started before the tasks were known; those that are used are taken out.
    """

    jobs: int | None = None
    scheduler: str | None = None
    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    keep_open: int | None = None
    threads: int = 1
    started: list[Any] = field(default_factory=list)


_Task = TypeVar("_Task", contravariant=True)
# chunks that are not done: a worker's own, one that waits there, and one for whichever worker is fast
_IN_FLIGHT = 3
# and with those that are done, a few rows each, while the oldest is not: its worker may be slow, or its tasks
_AHEAD = 12


class Future(Protocol[Result]):
    """A chunk that was submitted."""

    def done(self) -> bool:
        """Tell whether its result is there."""

    def result(self) -> Done[Result]:
        """Return what was done of it; raise an error that says that its worker died, once it is there."""


class Executor(Protocol[_Task, Result]):
    """Workers, wherever they run.

    Attributes
    ----------
    workers : int
        How many there are now.
    threads : int
        Tasks that each of them has in hand at once.
    worker_died : tuple of exception types
        What `Future.result` raises when the worker of the chunk has died.
    """

    threads: int
    worker_died: tuple[type[BaseException], ...]

    @property
    def workers(self) -> int:
        """The number may change while they work."""

    def submit(self, chunk: Sequence[_Task], *, first: bool = False) -> Future[Result]:
        """Queue a chunk; `first`: before those that wait."""

    def wait(self, future: Future[Result]) -> None:
        """Wait until a chunk is done, or for a fifth of a second."""

    def retry(self, chunk: Sequence[_Task]) -> Done[Result]:
        """Run a single task again that kills workers; if this one dies too, return that of a lost task."""

    def stop(self) -> None:
        """Let workers begin no further task."""

    def close(self, *, at_once: bool) -> None:
        """End the workers: after their current task, or at once."""


def in_order(
    tasks: Iterable[Task], work: Work[Task, Result], executor: Executor[Task, Result], stop: Stop
) -> Generator[Any, None, None]:
    """Yield what `Work.join` made of the results of some tasks and of those after them, in the tasks' order.

    A chunk whose worker died is done again in halves: what kills workers is alone in the end. Once `stop` is
    requested, no further task begins; results are yielded up to the first task that was not begun.
    """
    chunks = Chunks(tasks, executor.threads, work.unit, work.prepare)
    ahead = _AHEAD if work.prepare is None else _IN_FLIGHT
    in_flight = deque[tuple[Span[Task], Future[Result]]]()
    undone: list[Future[Result]] = []

    def submit(chunk: Span[Task], *, first: bool = False) -> tuple[Span[Task], Future[Result]]:
        undone.append(executor.submit(chunk, first=first))
        return chunk, undone[-1]

    def submit_first(*some: Span[Task]) -> None:
        for each in reversed(some):
            in_flight.appendleft(submit(each, first=True))

    while True:
        undone[:] = [each for each in undone if not each.done()]
        workers = executor.workers
        most = workers * (_IN_FLIGHT if chunks.measured else 1)
        while not stop.asked and len(undone) < most and len(in_flight) < ahead * workers:
            chunk = chunks.take(workers, work.tell())
            if not chunk:
                break
            in_flight.append(submit(chunk))
        if not in_flight:
            return
        if stop.asked:
            executor.stop()
        chunk, future = in_flight[0]
        if not future.done():
            executor.wait(future)
            if not chunks.measured:  # one slow first task must not keep the other workers waiting
                _measure_any(chunks, [each for _, each in in_flight], executor)
            continue
        in_flight.popleft()
        try:
            done = future.result()
        except executor.worker_died:
            if stop.asked:
                return  # whoever asked has ended the workers too
            if len(chunk) > 1:
                submit_first(chunk[: len(chunk) // 2], chunk[len(chunk) // 2 :])
                continue
            done = executor.retry(chunk)
        chunks.measure(done, executor.workers)
        if done.results:
            yield done.results
        if done.error is not None:
            raise done.error
        if rest := chunk[len(done.results) :]:
            if stop.asked:
                return
            submit_first(*chunks.cut(rest, executor.workers))


def _measure_any(
    chunks: Chunks[Task], futures: Iterable[Future[Result]], executor: Executor[Task, Result]
) -> None:
    """Learn what a task costs from the first chunk that is done, whichever it is."""
    for future in futures:
        if future.done():
            with contextlib.suppress(*executor.worker_died):
                chunks.measure(future.result(), executor.workers)
                return
