"""Give tasks to an executor and yield their results in the tasks' order, with few tasks in flight."""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Generic, Protocol, TypeVar

from rollcli.run.workers.interrupt import Stop


@dataclass(frozen=True)
class SharedPaths:
    """What workers on other machines must see as this process sees it.

    Attributes
    ----------
    files : tuple of str
        A sample of the files that the tasks read; those that do not exist are ignored.
    folders : tuple of str
        Where the tasks write.
    """

    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()


@dataclass(frozen=True)
class Workers:
    """Which workers run the tasks.

    Attributes
    ----------
    jobs : int or None
        Processes on this machine; None: one for each usable processor.
    scheduler : str or None
        The address of a Dask scheduler, whose workers are used instead.
    shared : SharedPaths
        What the workers of a cluster must see.
    keep_open : int or None
        A file descriptor that processes on this machine inherit and keep open until they end.
    threads : int
        Tasks that each worker has in hand at once: more than one where they wait for the network. One of
        them computes at a time.
    """

    jobs: int | None = None
    scheduler: str | None = None
    shared: SharedPaths = SharedPaths()
    keep_open: int | None = None
    threads: int = 1


Task = TypeVar("Task")
Result = TypeVar("Result")
_Task = TypeVar("_Task", contravariant=True)
_Result = TypeVar("_Result", covariant=True)


def _nothing(task: object) -> None:
    """Leave everything as it is: the tasks write no files."""


@dataclass(frozen=True)
class Work(Generic[Task, Result]):
    """What to do with each task.

    Attributes
    ----------
    do : callable
        Turns a task into its result. A task that cannot be done gets a result that says so. It is pickled
        and sent to workers: name it in a module.
    lost : callable
        Makes the result of a task whose worker died, from the task and the reason.
    clear : callable
        Removes the half-written files that a worker left which died amid the task.
    """

    do: Callable[[Task], Result]
    lost: Callable[[Task, str], Result]
    clear: Callable[[Task], None] = _nothing


class Future(Protocol[_Result]):
    """A task that was submitted: a `concurrent.futures.Future`, or an object with these two methods."""

    def result(self) -> _Result:
        """Wait for the result; raise what the task raised, or an error that says that its worker died."""

    def cancel(self) -> bool:
        """Withdraw the task; return False when a worker has started it."""


class Executor(Protocol[_Task, _Result]):
    """Workers, wherever they run.

    Attributes
    ----------
    window : int
        The number of tasks in flight: large enough to keep every worker busy, and bounded to bound memory.
    worker_died : tuple of exception types
        What `Future.result` raises when the task's worker has died.
    """

    window: int
    worker_died: tuple[type[BaseException], ...]

    def submit(self, task: _Task) -> Future[_Result]:
        """Queue a task."""

    def retry(self, task: _Task) -> _Result:
        """Run a task again whose worker died; if this worker dies too, return the result of a lost task."""

    def close(self, *, at_once: bool) -> None:
        """End the workers: after their current task, or at once."""


def in_order(
    tasks: Iterable[Task], executor: Executor[Task, Result], stop: Stop
) -> Generator[Result, None, None]:
    """Yield the result of each task, in the tasks' order.

    Once `stop` is requested, no task is submitted, queued tasks are cancelled, and the results of those that
    were started are still yielded.
    """
    remaining, in_flight = iter(tasks), deque[tuple[Task, Future[Result]]]()
    while True:
        for task in islice(remaining, 0 if stop.asked else executor.window - len(in_flight)):
            in_flight.append((task, executor.submit(task)))
        while stop.asked and in_flight and in_flight[-1][1].cancel():
            in_flight.pop()
        if not in_flight:
            return
        task, future = in_flight.popleft()
        try:
            result = future.result()
        except executor.worker_died:
            if stop.asked:
                return  # whoever asked has ended the workers too
            result = executor.retry(task)
        yield result
