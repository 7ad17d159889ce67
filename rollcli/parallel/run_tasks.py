"""The one entry of this package: run tasks on the workers that were asked for."""

import os
from collections.abc import Generator, Sequence
from typing import Any

from rollcli.parallel.in_order import Executor, Result, Task, Work, in_order
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.workers import Workers


def run_tasks(
    tasks: Sequence[Task], work: Work[Task, Result], stop: Stop, workers: Workers
) -> Generator[Result, None, None]:
    """Yield the result of each task, in the tasks' order.

    Raises
    ------
    WorkerError
        This machine starts no further process.
    ClusterError
        The cluster cannot do the work, or its scheduler is lost.
    """
    executor: Executor[Task, Result] = _executor(len(tasks), work, workers)
    try:
        yield from in_order(tasks, executor, stop)
    finally:
        executor.close(at_once=stop.at_once)


def require_scheduler(address: str | None) -> None:
    """Check that a scheduler answers, where one was named, before anything is written.

    Raises
    ------
    UsageError
        That is no address, or the extra `cluster` is not installed.
    ClusterError
        No scheduler answers there.
    """
    if address is not None:
        from rollcli.parallel.cluster import check_scheduler  # the extra `cluster`

        check_scheduler(address)


def _executor(count: int, work: Work[Any, Any], workers: Workers) -> Any:
    """Make the executor for so many tasks; each one's module is loaded only when it is used."""
    if workers.scheduler is not None:
        from rollcli.parallel.cluster import ClusterExecutor

        return ClusterExecutor(workers.scheduler, work, workers.shared, workers.threads)
    jobs = min(workers.jobs or _usable_processors(), count)
    if jobs > 1 or (count and workers.threads > 1):
        from rollcli.parallel.pool import PoolExecutor

        return PoolExecutor(jobs, work, workers.keep_open, workers.threads)
    from rollcli.parallel.local import LocalExecutor

    return LocalExecutor(work)


def _usable_processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
