"""Runs of consecutive tasks: how many a worker gets at once, and how it does them.

A task of a batch is often a few milliseconds long, and handing it over costs a tenth of that in a pool and as
much again on a cluster. Workers therefore get chunks that take about a second. Results stay those of single
tasks: in their order, and the same for any chunks.
"""

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from rollcli.errors import RollcliError, raised_at
from rollcli.files.stores.locations import computing

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

Task = TypeVar("Task")
Result = TypeVar("Result")

# of a chunk: handing it over costs a hundredth of the work, and a lost worker costs a second
_CHUNK_S = 1.0
# all workers together, which bounds the CPU time of whoever hands chunks over: a chunk costs Dask's scheduler
# and its client 3 ms each; from so many workers on, chunks are longer
_CHUNKS_A_SECOND = 100
_MOST_S = 8.0
# a worker gives back what it has not begun by then: tasks may be slower than those before
_LONGEST_S = 2.0
_LONGEST_OF_PARTS_S = 2 * _MOST_S  # of those that belong together, and on a cluster
_SHARES = 2  # a chunk is at most this part of what each worker still has to do, so that all end together,
_LEAST_S = 0.05  # unless that is less than this, or than half of what _CHUNKS_A_SECOND allows
_DOUBT_S = 0.02  # added to what the first tasks took: one that fails at once says nothing of the others


class Span(list[Task]):
    """Consecutive tasks that a worker gets at once.

    Parameters
    ----------
    tasks : iterable
    first : int
        The position of the first one among all tasks, from 0.
    told : object
        What `Work.tell` said when they were taken.
    """

    def __init__(self, tasks: Iterable[Task], first: int = 0, told: Any = None) -> None:
        super().__init__(tasks)
        self.first, self.told = first, told

    def part(self, start: int, end: int | None = None) -> "Span[Task]":
        """Return some of the tasks as a span of their own."""
        return Span(self[start:end], self.first + start, self.told)


def _as_they_are(chunk: Sequence[Task], results: list[Result]) -> Sequence[Result]:
    return results


class Job(NamedTuple):
    """What a worker is told of `Work`; it is pickled.

    Attributes
    ----------
    do, join : callable
        See `Work`.
    longest_s : float
        No further task of a chunk begins so many seconds after the first.
    threads : int
        See `Workers`.
    """

    do: Callable[[Any], Any]
    join: Callable[[Any, list[Any]], Sized]
    longest_s: float
    threads: int


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
        Removes the half-written files that a worker left which died amid one of these tasks.
    join : callable
        Makes of a chunk and the results of its first tasks what the worker hands back of it, as long as there
        are results; pickled as `do` is.
    tell : callable
        Returns what `join` is told as `chunk.told`: what was known when the tasks were taken.
    unit : int
        Tasks that belong together, counted from the first of all. A chunk is some whole units, or a piece of
        one where that is worth too much time.
    prepare : callable or None
        Reads for a task what must be read in the tasks' order, just before another process of this machine
        gets it. Such a task is large: a chunk is one of them, and few wait. The workers of a cluster read for
        themselves, for all that they are handed passes through its scheduler.
    """

    do: Callable[[Task], Result]
    lost: Callable[[Task, str], Result]
    clear: Callable[[Iterable[Task]], None] = lambda tasks: None  # the tasks write no files
    join: Callable[[Any, list[Result]], Sized] = _as_they_are
    tell: Callable[[], Any] = lambda: None
    unit: int = 1
    prepare: Callable[[Task], Task] | None = None

    def job(self, threads: int, *, cluster: bool = False) -> Job:
        """Return what workers of this machine, or of a cluster, are told."""
        longest_s = _LONGEST_S if self.unit == 1 and not cluster else _LONGEST_OF_PARTS_S
        return Job(self.do, self.join, longest_s, threads)


@dataclass(frozen=True)
class Done(Generic[Result]):
    """What a worker did of a chunk.

    Attributes
    ----------
    results : sized
        What `Work.join` made of the results of its first tasks, in order; the others were not begun.
    seconds : float
        The time that this took of the worker.
    error : Exception or None
        What the next task raised: it ends the run.
    """

    results: Any
    seconds: float
    error: Exception | None = None


class Chunks(Generic[Task]):
    """Cuts tasks into chunks, by the time that the last ones took.

    Parameters
    ----------
    tasks : sequence
        Chunks get smaller towards the end.
    first : int
        The size of the first ones.
    work : Work
        Which tasks belong together, and whether they are prepared one by one.
    """

    def __init__(self, tasks: Sequence[Task], first: int, work: Work[Task, Any]) -> None:
        self._count = len(tasks)
        self._tasks = iter(tasks) if work.prepare is None else map(work.prepare, tasks)
        self._first, self._unit, self._one_by_one = first, work.unit, work.prepare is not None
        self._seconds, self._done, self._taken = _DOUBT_S, 0.0, 0

    def take(self, workers: int, told: Any = None) -> Span[Task]:
        """Take the next chunk, for one of so many workers; empty when there are no more tasks."""
        size = self._size(self._taken, self._count - self._taken, workers)
        chunk = Span(itertools.islice(self._tasks, size), self._taken, told)
        self._taken += len(chunk)
        return chunk

    def cut(self, rest: Span[Task], workers: int) -> Iterator[Span[Task]]:
        """Cut what a worker has not begun in time: its tasks are slower than those before."""
        least = -(-len(rest) // (_SHARES * workers))
        while rest:
            size = max(self._size(rest.first, len(rest), workers), least)
            yield rest.part(0, size)
            rest = rest.part(size)

    def _size(self, first: int, left: int, workers: int) -> int:
        """Choose the size of a chunk from the position of its first task and the number of tasks to come."""
        if self._one_by_one:
            return 1
        size = self._first
        worth = self._done / self._seconds if self.measured else 0.0  # tasks that a second is worth
        if self.measured:
            size = int(worth * min(max(_CHUNK_S, workers / _CHUNKS_A_SECOND), _MOST_S))
        least_s = max(_LEAST_S, workers / _CHUNKS_A_SECOND / 2)
        most = max(left // (_SHARES * workers), int(worth * least_s))
        size, begun = max(min(size, most), 1), first % self._unit
        if begun == 0 and size >= self._unit:
            return size - size % self._unit
        if begun == 0 and self._unit <= min(most, int(worth * _MOST_S)):
            return self._unit
        return min(size, self._unit - begun)

    @property
    def measured(self) -> bool:
        """Whether a chunk was measured."""
        return self._done > 0

    def measure(self, done: Done[Any], workers: int) -> None:
        """Learn from a chunk what a task takes: the mean over tasks, of each worker's last chunks.

        Each task counts once: if each chunk did, a few tasks that fail at once would make the next chunks a
        hundred times as long, and the results of all others wait for those.
        """
        if done.results:
            kept = 1 - 1 / (2 * workers)
            self._seconds = kept * self._seconds + max(done.seconds, 1e-6)
            self._done = kept * self._done + len(done.results)


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
    threads : int
        Tasks that each worker has in hand at once: more than one where they wait for the network. One of
        them computes at a time.
    """

    jobs: int | None = None
    scheduler: str | None = None
    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    threads: int = 1


class Chunk(Generic[Task, Result]):
    """A chunk that a worker has in hand.

    Parameters
    ----------
    job : Job
    tasks : sequence
    stopped : Event
        Once it is set, no further task begins.
    threads : ThreadPoolExecutor, optional
        The tasks wait for the network: they begin at once, in these threads, and one at a time computes.
        Otherwise each begins when the one before it is done, and the first when someone asks what was done.
    """

    def __init__(
        self, job: Job, tasks: Sequence[Task], stopped: Event, threads: "ThreadPoolExecutor | None" = None
    ) -> None:
        self._job, self._tasks, self._stopped, self._over = job, tasks, stopped, 0.0
        self._errors: dict[int, Exception] = {}  # by the places of their tasks
        self._attempts: Iterable[tuple[Result, ...]] = map(self._attempt, range(len(tasks)))
        if threads is not None:
            futures = [threads.submit(self._attempt_in_turn, place) for place in range(len(tasks))]
            self._attempts = (future.result() for future in futures)

    def done(self) -> Done[Result]:
        """Wait for the end of the chunk; return what was done of it."""
        start = time.monotonic()
        every = list(self._attempts)  # all of them: none goes on when the worker ends
        results = list(itertools.chain(*itertools.takewhile(len, every)))
        seconds = time.monotonic() - start  # what else a chunk costs does not grow with its tasks
        error = self._errors.get(len(results))  # a later task may have failed before
        try:
            return Done(self._job.join(self._tasks, results) if results else [], seconds, error)
        except Exception as failed:  # noqa: BLE001 (whoever asked for the results raises it)
            return Done([], seconds, _portable(failed))

    def _attempt_in_turn(self, place: int) -> tuple[Result, ...]:
        with computing():
            return self._attempt(place)

    def _attempt(self, place: int) -> tuple[Result, ...]:
        """Do a task, and return its result; nothing where it fails, or the chunk has ended before it."""
        now = time.monotonic()
        self._over = self._over or now + self._job.longest_s
        if self._stopped.is_set() or min(self._errors, default=place) < place or now > self._over:
            return ()
        try:
            return (self._job.do(self._tasks[place]),)
        except Exception as error:  # noqa: BLE001 (whoever asked for the result raises it)
            self._errors[place] = _portable(error)
            return ()


def _portable(error: Exception) -> Exception:
    """Make of an error one that another process can raise: ours as it is, others with their place."""
    if isinstance(error, RollcliError):
        return error
    last = raised_at(error)
    where = f" in {last.tb_frame.f_code.co_filename}:{last.tb_lineno}" if last else ""
    return RuntimeError(f"{type(error).__name__}{where}: {error}")
