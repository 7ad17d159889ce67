"""The one entry of this package: run tasks on the workers that were asked for."""

import os
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Generic

from rollcli.run.workers.in_order import Executor, Result, Task, Work, Workers, in_order
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.pool import prepare_worker


class LocalExecutor(Generic[Task, Result]):
    """Runs each task in this process, when its result is asked for."""

    window = 1
    worker_died: tuple[type[BaseException], ...] = ()

    def __init__(self, work: Work[Task, Result]) -> None:
        prepare_worker()
        self._work = work

    def submit(self, task: Task) -> "LocalFuture[Task, Result]":
        """Remember the task."""
        return LocalFuture(self._work.do, task)

    def retry(self, task: Task) -> Result:
        """Run the task; nothing calls this, since this process cannot outlive its worker."""
        return self._work.do(task)

    def close(self, *, at_once: bool) -> None:
        """Do nothing: there are no workers to end."""


@dataclass(frozen=True)
class LocalFuture(Generic[Task, Result]):
    """A task that waits for someone to need its result."""

    do: Callable[[Task], Result]
    task: Task

    def result(self) -> Result:
        """Run the task."""
        return self.do(self.task)

    def cancel(self) -> bool:
        """Withdraw the task: it has not started."""
        return True


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
        from rollcli.run.workers.cluster import check_scheduler  # the extra `cluster`

        check_scheduler(address)


def _executor(count: int, work: Work[Any, Any], workers: Workers) -> Any:
    """Make the executor for so many tasks; each one's module is loaded only when it is used."""
    if workers.scheduler is not None:
        from rollcli.run.workers.cluster import ClusterExecutor

        return ClusterExecutor(workers.scheduler, work, workers.shared, workers.threads)
    jobs = min(workers.jobs or _usable_processors(), count)
    if jobs > 1 or (count and workers.threads > 1):
        from rollcli.run.workers.pool import PoolExecutor

        return PoolExecutor(jobs, work, workers.keep_open, workers.threads)

    return LocalExecutor(work)


def _usable_processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
