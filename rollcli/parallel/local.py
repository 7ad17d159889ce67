"""The executor for one worker: this process."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

from rollcli.parallel.in_order import Result, Task, Work
from rollcli.parallel.process_setup import prepare_worker


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
