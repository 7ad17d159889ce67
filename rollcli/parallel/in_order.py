"""Tasks to workers and what they give back in order, with a bounded number of tasks in flight."""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Generic, Protocol, TypeVar

from rollcli.parallel.interrupt import Stop

Task = TypeVar("Task", contravariant=True)
Done = TypeVar("Done")
Result = TypeVar("Result", covariant=True)


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


class Ticket(Protocol[Result]):
    """A task that is under way: a `concurrent.futures.Future`, or what does for one."""

    def result(self) -> Result:
        """Wait for what the task gives."""

    def cancel(self) -> bool:
        """Give the task back, unless a worker has it already."""


class Crew(Protocol[Task, Result]):
    """Workers, wherever they are.

    Attributes
    ----------
    window : int
        How many tasks may be in flight: enough that nobody waits, few enough that memory stays bounded.
    deaths : tuple of exception types
        What `result` of a task raises whose worker has died.
    """

    window: int
    deaths: tuple[type[BaseException], ...]

    def submit(self, task: Task) -> Ticket[Result]:
        """Start a task."""

    def again(self, task: Task) -> Result:
        """Do a task once more whose worker has died; if that dies too, what a lost task gives."""


def in_order(tasks: Iterable[Task], crew: Crew[Task, Done], stop: Stop) -> Generator[Done, None, None]:
    """What each task gives, in the tasks' order; when asked to stop, of those that are worked on already."""
    source, flying = iter(tasks), deque[tuple[Task, Ticket[Done]]]()
    while True:
        for task in islice(source, 0 if stop.asked else crew.window - len(flying)):
            flying.append((task, crew.submit(task)))
        while stop.asked and flying and flying[-1][1].cancel():
            flying.pop()
        if not flying:
            return
        task, ticket = flying.popleft()
        try:
            done = ticket.result()
        except crew.deaths:
            if stop.asked:
                return  # whoever asked has ended the workers too
            done = crew.again(task)
        yield done
