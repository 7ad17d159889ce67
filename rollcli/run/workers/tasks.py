"""The one entry of this package: run tasks on the workers that were asked for, and yield results in order."""

import contextlib
import os
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rollcli.errors import WorkerDiedError
from rollcli.run.workers.chunks import Chunks, Done, Result, Span, Task, Work, Workers
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.pool import PoolExecutor, prepare_worker

if TYPE_CHECKING:
    from rollcli.run.workers.cluster import ClusterExecutor  # the extra `cluster`

    Executor = PoolExecutor[Task, Result] | ClusterExecutor[Task, Result]

# chunks that are not done: a worker's own, one that waits there, and one for whichever worker is fast
_IN_FLIGHT = 3
# and with those that are done, a few rows each, while the oldest is not: its worker may be slow, or its tasks
_AHEAD = 12


def in_order(
    tasks: Sequence[Task], work: Work[Task, Result], executor: "Executor[Task, Result]", stop: Stop
) -> Generator[Any, None, None]:
    """Yield what `Work.join` made of the results of some tasks and of those after them, in the tasks' order.

    A chunk whose worker died is done again in halves: what kills workers is alone in the end. Once `stop` is
    requested, no further task begins; results are yielded up to the first task that was not begun.
    """
    chunks = Chunks(tasks, executor.threads, work)
    ahead = _AHEAD if work.prepare is None else _IN_FLIGHT
    in_flight = deque[tuple[Span[Task], Any]]()  # each with its future
    undone: list[Any] = []

    def submit(chunk: Span[Task], *, first: bool = False) -> tuple[Span[Task], Any]:
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
                with contextlib.suppress(WorkerDiedError):
                    for early in [each for _, each in in_flight if each.done()][:1]:
                        chunks.measure(early.result(), workers)
            continue
        in_flight.popleft()
        try:
            done = future.result()
        except WorkerDiedError:
            if stop.asked:
                return  # whoever asked has ended the workers too
            if len(chunk) > 1:
                half = len(chunk) // 2
                submit_first(chunk.part(0, half), chunk.part(half))
                continue
            try:
                done = executor.retry(chunk)
            except WorkerDiedError as error:
                done = Done(work.join(chunk, [work.lost(chunk[0], str(error))]), 0.0)
        chunks.measure(done, executor.workers)
        if done.results:
            yield done.results
        if done.error is not None:
            raise done.error
        if rest := chunk.part(len(done.results)):
            if stop.asked:
                return
            submit_first(*chunks.cut(rest, executor.workers))


def run_tasks(
    tasks: Sequence[Task], work: Work[Task, Result], stop: Stop, workers: Workers
) -> Generator[Result, None, None]:
    """Yield the result of each task, in the tasks' order; see `run_joined`."""
    with contextlib.closing(run_joined(tasks, work, stop, workers)) as chunks:
        for results in chunks:
            yield from results


def run_joined(
    tasks: Sequence[Task], work: Work[Task, Result], stop: Stop, workers: Workers
) -> Generator[Any, None, None]:
    """Yield what `Work.join` makes of the results of the first tasks, and then of those after them.

    Raises
    ------
    WorkerError
        This machine starts no further process; or the cluster cannot do the work, or its scheduler is lost.
    """
    if workers.scheduler is not None:
        work = replace(work, prepare=None)
    executor = _executor(len(tasks), work, workers)
    if executor is None:
        yield from _run_here(tasks, work, stop)
        return
    try:
        yield from in_order(tasks, work, executor, stop)
    finally:
        try:
            executor.close(at_once=stop.at_once)
        except KeyboardInterrupt:  # the second Ctrl-C, while they end
            executor.close(at_once=True)
            raise
        finally:
            if workers.scheduler is not None:  # a worker that died elsewhere cannot be waited for
                work.clear(tasks)


def require_scheduler(address: str | None) -> None:
    """Check that a scheduler answers, where one was named, before anything is written.

    Raises
    ------
    UsageError
        That is no address, or the extra `cluster` is not installed.
    WorkerError
        No scheduler answers there.
    """
    if address is not None:
        from rollcli.run.workers.cluster import check_scheduler  # the extra `cluster`

        check_scheduler(address)


def _run_here(tasks: Sequence[Task], work: Work[Task, Result], stop: Stop) -> Generator[Any, None, None]:
    """Do each task in this process, when its result is asked for."""
    prepare_worker()
    for position, task in enumerate(tasks):
        if stop.asked:
            return
        yield work.join(Span([task], position, work.tell()), [work.do(task)])


def _executor(count: int, work: Work[Task, Result], workers: Workers) -> "Executor[Task, Result] | None":
    """Make the executor; None: this process does the tasks. The cluster's loads only when it is used."""
    if workers.scheduler is not None:
        from rollcli.run.workers.cluster import ClusterExecutor

        return ClusterExecutor(workers.scheduler, work, workers)
    jobs = min(workers.jobs or _usable_processors(), count)
    if jobs > 1 or (jobs and workers.threads > 1):
        return PoolExecutor(jobs, work, workers)
    return None


def _usable_processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
