"""Worker processes on this machine.

Processes, not threads: decoding leaves the interpreter alone, but the estimator's many small NumPy calls do
not, and a worker that dies takes no other with it. And not those of concurrent.futures: they break as a whole
when one dies, without a word on which task did it, and hand out with threads that take time from the workers.
"""

from collections import deque
from collections.abc import Generator, Iterable
from multiprocessing import connection
from typing import Generic

from rollcli.parallel.in_order import Done, Task, Work, in_order
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.worker import Worker

_TASKS_PER_WORKER = 2  # one that it works on, and one that it finds when that is done
_IN_FLIGHT_PER_WORKER = 4  # more, since a slow task holds back those after it
_DIED = "its worker died twice: killed for memory, perhaps, or crashed"


def done_by_pool(
    tasks: Iterable[Task], work: Work[Task, Done], jobs: int, held: int | None, stop: Stop
) -> Generator[Done, None, None]:
    """What each task gives, in order, from `jobs` processes; `held` is a file that they keep open."""
    crew = PoolCrew(jobs, work, held)
    try:
        yield from in_order(tasks, crew, stop)
    finally:
        if stop.at_once:
            crew.kill()
        crew.close()


class WorkerDiedError(Exception):
    """The process that worked on a task has ended."""


class PoolCrew(Generic[Task, Done]):
    """Processes that take tasks in turn; they make progress while someone waits for a result."""

    deaths: tuple[type[BaseException], ...] = (WorkerDiedError,)

    def __init__(self, jobs: int, work: Work[Task, Done], held: int | None) -> None:
        self.window = _IN_FLIGHT_PER_WORKER * jobs
        self._work, self._held = work, held
        self._team = [Worker(work.do, held) for _ in range(jobs)]
        self._backlog: deque[Ticket[Task, Done]] = deque()

    def submit(self, task: Task) -> "Ticket[Task, Done]":
        """Take a task; its result is waited for with the ticket."""
        ticket = Ticket(self, task)
        self._backlog.append(ticket)
        self._hand_out()
        return ticket

    def again(self, task: Task) -> Done:
        """Do a task once more whose worker has died, with all memory to itself."""
        held_back, self._backlog = self._backlog, deque()
        while any(worker.asked for worker in self._team):
            self.make_progress()
        try:
            return self.submit(task).result()
        except WorkerDiedError:
            return self._work.lost(task, _DIED)
        finally:
            self._backlog.extend(held_back)

    def cancel(self, ticket: "Ticket[Task, Done]") -> bool:
        """Give a task back that no worker has."""
        if ticket not in self._backlog:
            return False
        self._backlog.remove(ticket)
        return True

    def make_progress(self) -> None:
        """Wait until a worker has something to say, and keep all of them busy."""
        speaking = connection.wait([worker.pipe for worker in self._team if worker.asked])
        for place, worker in enumerate(self._team):
            if worker.pipe in speaking:
                self._listen(place, worker)
        self._hand_out()

    def kill(self) -> None:
        """End the workers at once."""
        for worker in self._team:
            worker.kill()

    def close(self) -> None:
        """End the workers, after what they are at."""
        for worker in self._team:
            worker.close()

    def _hand_out(self) -> None:
        for _ in range(_TASKS_PER_WORKER):
            for place, worker in enumerate(self._team):
                if self._backlog and len(worker.asked) < _TASKS_PER_WORKER:
                    self._ask(place, worker, self._backlog.popleft())

    def _ask(self, place: int, worker: Worker, ticket: "Ticket[Task, Done]") -> None:
        worker.asked.append(ticket)
        try:
            worker.pipe.send(ticket.task)
        except OSError:  # it has died meanwhile, with nothing to do: that is no task's fault
            if len(worker.asked) == 1:
                self._replace(place, worker)

    def _listen(self, place: int, worker: Worker) -> None:
        try:
            answer = worker.pipe.recv()
        except (EOFError, OSError):
            worker.asked.popleft().settle(None, WorkerDiedError())
            self._replace(place, worker)
        else:
            worker.asked.popleft().settle(*answer)

    def _replace(self, place: int, worker: Worker) -> None:
        """A new worker in place of a dead one; what that was asked for after its last task goes to others."""
        self._backlog.extendleft(reversed(worker.asked))
        worker.close()
        self._team[place] = Worker(self._work.do, self._held)


class Ticket(Generic[Task, Done]):
    """A task that is under way; what `concurrent.futures.Future` is elsewhere."""

    def __init__(self, crew: PoolCrew[Task, Done], task: Task) -> None:
        self.task = task
        self._crew = crew
        self._answer: tuple[Done, Exception | None] | None = None

    def settle(self, value: Done, error: Exception | None) -> None:
        """Say how the task ended."""
        self._answer = value, error

    def result(self) -> Done:
        """Wait for what the task gives; raises what it raised, or WorkerDiedError."""
        while self._answer is None:
            self._crew.make_progress()
        value, error = self._answer
        if error is not None:
            raise error
        return value

    def cancel(self) -> bool:
        """Give the task back, unless a worker has it."""
        return self._crew.cancel(self)
