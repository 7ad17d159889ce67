"""The one entry of this package: run tasks on the workers that were asked for."""

import contextlib
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from dataclasses import replace
from typing import Any

from rollcli.run.workers.chunks import Result, Span, Task, Work
from rollcli.run.workers.in_order import Workers, in_order
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.pool import prepare_worker

_MOST_EARLY = 4  # of the workers: there may be fewer tasks, and those of a longer run need not hurry


def run_tasks(
    tasks: Iterable[Task], work: Work[Task, Result], stop: Stop, workers: Workers
) -> Generator[Result, None, None]:
    """Yield the result of each task, in the tasks' order; see `run_joined`."""
    with contextlib.closing(run_joined(tasks, work, stop, workers)) as chunks:
        for results in chunks:
            yield from results


def run_joined(
    tasks: Iterable[Task], work: Work[Task, Result], stop: Stop, workers: Workers
) -> Generator[Any, None, None]:
    """Yield what `Work.join` makes of the results of the first tasks, and then of those after them.

    Raises
    ------
    WorkerError
        This machine starts no further process; or the cluster cannot do the work, or its scheduler is lost.
    """
    count = len(tasks) if isinstance(tasks, Sized) else None
    if workers.scheduler is not None:
        work = replace(work, prepare=None)
    executor = _executor(count, work, workers)
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


@contextlib.contextmanager
def started_early(jobs: int | None, load: Callable[[], None]) -> Iterator[list[Any]]:
    """Start a few worker processes while the tasks are still looked for; those that nobody takes end.

    Parameters
    ----------
    jobs : int or None
        The workers that were asked for; None: one for each usable processor.
    load : callable
        What a worker loads, apart from what all of them load.

    Raises
    ------
    WorkerError
        This machine starts no further process.
    """
    from rollcli.run.workers.pool import Worker

    most = min(jobs or _usable_processors(), _MOST_EARLY)
    started: list[Worker[Any, Any]] = []
    try:
        for _ in range(most if most > 1 else 0):
            started.append(Worker(load))
        yield started
    finally:
        for worker in started:
            worker.kill()
            worker.join()


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


def _run_here(tasks: Iterable[Task], work: Work[Task, Result], stop: Stop) -> Generator[Any, None, None]:
    """Do each task in this process, when its result is asked for."""
    prepare_worker()
    for position, task in enumerate(tasks):
        if stop.asked:
            return
        yield work.join(Span([task], position, work.tell()), [work.do(task)])


def _executor(count: int | None, work: Work[Any, Any], workers: Workers) -> Any:
    """Make the executor; None: this process does the tasks. Modules load only when they are used."""
    if workers.scheduler is not None:
        from rollcli.run.workers.cluster import ClusterExecutor

        return ClusterExecutor(workers.scheduler, work, workers)
    jobs = workers.jobs or _usable_processors()
    if count is not None:
        jobs = min(jobs, count)
    if jobs > 1 or (jobs and workers.threads > 1):
        from rollcli.run.workers.pool import PoolExecutor

        return PoolExecutor(jobs, work, workers)
    return None


def _usable_processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
