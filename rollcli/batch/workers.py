"""Tasks to workers and what they give back in order, with a bounded number of tasks in flight."""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from rollcli.batch.signals import Stop

Task = TypeVar("Task", contravariant=True)
Done = TypeVar("Done")


@dataclass(frozen=True)
class Work(Generic[Task, Done]):
    """What is done with each task. Both functions go to the workers: small, and of a module.

    Attributes
    ----------
    do : callable
        Takes a task; what is wrong with the task is said by what it gives.
    lost : callable
        What a task gives whose worker died, from the task and the reason.
    """

    do: Callable[[Task], Done]
    lost: Callable[[Task, str], Done]


class Crew(Protocol[Task, Done]):
    """Workers, wherever they are.

    Attributes
    ----------
    window : int
        How many tasks may be in flight: enough that nobody waits, few enough that memory stays bounded.
    deaths : tuple of exception types
        How the future of a lost task ends.
    broken : bool
        A worker has died, and with it every task in flight is lost.
    """

    window: int
    deaths: tuple[type[BaseException], ...]
    broken: bool

    def submit(self, task: Task) -> "Future[Done]":
        """Start a task; if its worker dies, the future ends with one of `deaths`."""

    def again(self, task: Task) -> Done:
        """Do a lost task once more, alone; if that kills its worker too, it is lost for good."""

    def renew(self) -> None:
        """Replace workers that have died."""


def in_order(tasks: Iterable[Task], crew: Crew[Task, Done], stop: Stop) -> Generator[Done, None, None]:
    """What each task gives, in the tasks' order.

    Takes no new tasks when asked to stop, nor while lost ones are done once more: what died for want of
    memory gets all of it.
    """
    source, flying = iter(tasks), deque[tuple[Task, "Future[Done]"]]()
    while True:
        if crew.broken and not flying:
            crew.renew()
        while len(flying) < crew.window and not (stop.asked or crew.broken):
            task = next(source, None)
            if task is None:
                break
            flying.append((task, crew.submit(task)))
        if not flying:
            return
        task, future = flying.popleft()
        try:
            done = future.result()
        except crew.deaths:
            if stop.asked:
                return  # whoever asked has ended the workers too
            done = crew.again(task)
        yield done
