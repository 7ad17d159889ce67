"""The executor for workers elsewhere: a Dask cluster (extra `cluster`)."""

import asyncio
import contextlib
import json
import logging
import os
import pickle
import threading
import time
import uuid
import weakref
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeoutError  # before Python 3.11 not the built-in one
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic

from rollcli import __version__
from rollcli.errors import OutputError, UsageError, WorkerDiedError, WorkerError, reading
from rollcli.extras import require_extra
from rollcli.files.atomic import is_file, is_there, write_atomic
from rollcli.files.storage import remove
from rollcli.files.stores.locations import is_url
from rollcli.messages import one_line, say
from rollcli.run.workers.chunks import Chunk, Done, Result, Task, Work, Workers
from rollcli.run.workers.pool import prepare_worker

_CONNECT_S, _GREETING_S, _FIRST_WORKER_S = 6, 2, 5
_POLL_S, _LOOK_S = 0.2, 1.0
_ASKED_S = 10  # a worker that joins is asked within a second
_MOST_TRIES = 5  # of a chunk, with workers that cannot do it
_DIED = "every worker that tried it died: killed for memory, perhaps, or crashed"


def check_scheduler(given: str) -> None:
    """Check that a scheduler, named by its address or its file, answers, before anything is written.

    Dask's own client would take longer to give up, and end with a traceback.

    Raises
    ------
    UsageError
        That is no address and no scheduler's file, or the extra `cluster` is not installed.
    WorkerError
        No scheduler answers there.
    """
    require_extra("cluster", "--scheduler")
    address = scheduler_address(given)
    try:
        with _silenced_logging():
            asyncio.run(asyncio.wait_for(_open_and_close(address), _CONNECT_S + _GREETING_S))
    except (ValueError, TypeError) as error:  # the latter for TLS that is not set up
        raise UsageError(
            f"--scheduler {address!r}: {error}; an address looks like tcp://host:8786"
        ) from error
    # MemoryError comes from servers of another kind: their first bytes are taken for a size
    except (OSError, asyncio.TimeoutError, MemoryError) as error:
        raise _no_scheduler(address) from error


async def _open_and_close(address: str) -> None:
    from distributed.comm.core import connect
    from distributed.security import Security

    comm = await connect(address, timeout=_CONNECT_S, **Security().get_connection_args("client"))
    await comm.close()


class ClusterExecutor(Generic[Task, Result]):
    """Runs chunks on the workers of a scheduler; Dask itself gives the chunk of a dead worker to another.

    Workers that join are used at once, unless they cannot take part: a line says so then. Dask may give them
    chunks before they are asked; these wait for the answer.

    Parameters
    ----------
    given : str
        The address of the scheduler, or its file.
    work : Work
        What the workers do.
    asked : Workers
        What each of them must see, and how many tasks each of its threads has in hand.

    Raises
    ------
    WorkerError
        No scheduler or no worker answers, a worker has another rollcli, or does not see the files.
    """

    def __init__(self, given: str, work: Work[Task, Result], asked: Workers) -> None:
        self.threads, self.address = asked.threads, scheduler_address(given)
        self._work, self._asked, self._stopped = work, asked, False
        self._run, self._looked = uuid.uuid4().hex, time.monotonic()
        self._threads_of: dict[str, int] = {}  # by the addresses of the workers that take part
        self._refused: set[str] = set()
        self._in_flight: weakref.WeakSet[ClusterFuture[Task, Result]] = weakref.WeakSet()
        with contextlib.ExitStack() as resources:
            resources.enter_context(_silenced_logging())
            self._client = _connect(self.address)
            resources.callback(self._client.close, timeout=2)
            for worker, problem in self._look_for_workers().items():
                raise WorkerError(f"worker {worker}: {problem}")
            self._resources = resources.pop_all()  # until it is closed

    @property
    def workers(self) -> int:
        """The number of threads of the workers that take part; it is asked for once a second."""
        self._look()
        return max(sum(self._threads_of.values()), 1)

    def _look(self) -> None:
        """Take in workers that have joined, once a second."""
        if time.monotonic() - self._looked > _LOOK_S:
            self.take_in_workers()
            self._looked = time.monotonic()

    def take_in_workers(self, *, anew: bool = False) -> None:
        """Take in workers that have joined, and say which of them cannot take part; anew: ask all again."""
        if anew:
            self._threads_of = {}
        with contextlib.suppress(OSError):  # the scheduler is lost, which is said once Dask gives it up
            for worker, problem in self._look_for_workers().items():
                say(f"worker {worker}: {problem}; it gets no work")

    def submit(self, chunk: Sequence[Task], *, first: bool = False) -> "ClusterFuture[Task, Result]":
        """Queue a chunk for whichever worker is free."""
        future: ClusterFuture[Task, Result] = ClusterFuture(self, chunk, priority=int(first))
        self._in_flight.add(future)
        return future

    def send(self, chunk: Sequence[Task], priority: int) -> tuple[Any, set[str]]:
        """Give a chunk to Dask; return its future, and the workers that may do it, if not all may."""
        self.check_connection()
        chosen = set(self._threads_of) if self._refused else set()
        # bytes: the scheduler would make objects of all else, and pickle them again
        told = pickle.dumps((self._work.job(self.threads, cluster=True), chunk), pickle.HIGHEST_PROTOCOL)
        sent = self._client.submit(
            *(_do_chunk, self._run, told),
            pure=False,
            priority=priority,
            workers=sorted(chosen) or None,
        )
        return sent, chosen

    def check_connection(self) -> None:
        """Raise WorkerError where the scheduler is lost."""
        if self._client.status == "closed":
            raise _connection_lost(self.address)

    def wait(self, future: "ClusterFuture[Task, Result]") -> None:
        """Wait until a chunk is done, or for a fifth of a second."""
        self.check_connection()
        self._look()  # the chunk may wait until its worker is asked
        future.settled.wait(_POLL_S)

    def retry(self, chunk: Sequence[Task]) -> Done[Result]:
        """Run a task again whose workers died: Dask blames all that were theirs, the next in line, too."""
        future = self.submit(chunk, first=True)
        while not future.done():
            self.wait(future)
        return future.result()

    def stop(self) -> None:
        """Let workers begin no further task."""
        if not self._stopped and self._client.status == "running":
            with contextlib.suppress(OSError):  # the scheduler is lost
                self._client.run(_stop_run, self._run, self.threads, on_error="ignore")
        self._stopped = True

    def close(self, *, at_once: bool) -> None:
        """Disconnect; the workers belong to the cluster and go on."""
        try:
            if not at_once:
                self.stop()
        finally:
            self._resources.close()

    def _look_for_workers(self) -> dict[str, str]:
        """Take in workers that have joined, and leave out those that have gone; return problems by worker."""
        there = self._client.nthreads()
        new = [worker for worker in there if worker not in self._threads_of and worker not in self._refused]
        problems, silent = _problems(self._client, self._run, self._asked, new) if new else ({}, set())
        self._refused.update(problems)
        left_out = self._refused | silent  # those that did not answer are asked again
        self._threads_of = {worker: n for worker, n in there.items() if worker not in left_out}
        for future in self._in_flight if self._threads_of else ():
            if future.chosen and future.chosen.isdisjoint(self._threads_of):
                future.send_again()  # all who might do it have gone
        return problems


class ClusterFuture(Generic[Task, Result]):
    """A chunk that was submitted to a cluster.

    One that came to a worker which cannot take part is sent to others.
    """

    def __init__(self, executor: ClusterExecutor[Task, Result], chunk: Sequence[Task], priority: int) -> None:
        self._executor, self._chunk, self._priority = executor, chunk, priority
        self._tries = 0
        self.send_again()

    def send_again(self) -> None:
        """Give the chunk to workers that take part."""
        self._tries += 1
        self._sent, self.chosen = self._executor.send(self._chunk, self._priority)
        settled = self.settled = threading.Event()
        self._sent.add_done_callback(lambda _: settled.set())

    def done(self) -> bool:
        """Tell whether the result is there."""
        if not self._sent.done():
            return False
        error = self._sent.exception() if self._sent.status == "error" else None  # tasks' errors are results
        if error is not None and self._tries < _MOST_TRIES and not _is_death(error):
            self._executor.take_in_workers(anew=isinstance(error, TimeoutError))
            self.send_again()
            return False
        return True

    def result(self) -> Done[Result]:
        """Return what was done.

        Raises
        ------
        WorkerDiedError
            Workers have died.
        WorkerError
            The scheduler is lost, or workers cannot do the work.
        """
        self._executor.check_connection()
        try:
            error = self._sent.exception()
            if error is None:
                found: Done[Result] = pickle.loads(self._sent.result())  # noqa: S301 (as Dask does)
                return found
        except (WorkerError, TimeoutError):  # it was lost, and came to a worker that cannot take part
            return self._executor.retry(self._chunk)
        except (CancelledError, OSError) as lost:  # the latter where it is lost amid a result
            raise _connection_lost(self._executor.address) from lost
        if _is_death(error):
            raise WorkerDiedError(_DIED) from error
        raise WorkerError(f"{self._executor.address}: workers cannot do the work: {error}")


def _is_death(error: BaseException | None) -> bool:
    from distributed import KilledWorker

    return isinstance(error, KilledWorker)


_LOCK = threading.Lock()


@lru_cache(maxsize=1000)  # the last runs
def _answer(run: str) -> "Future[str]":
    return Future()


def _answer_to(run: str) -> "Future[str]":
    """Return what this worker answers, or will, when a run asks what keeps it from taking part."""
    with _LOCK:  # or each of two threads would make its own
        return _answer(run)


@lru_cache(maxsize=8)  # the last runs
def _set_up(run: str, threads: int) -> tuple[threading.Event, ThreadPoolExecutor | None]:
    prepare_worker()
    return threading.Event(), ThreadPoolExecutor(threads) if threads > 1 else None


def _run_here(run: str, threads: int) -> tuple[threading.Event, ThreadPoolExecutor | None]:
    """Return what stops a run on this worker, and the threads of its tasks; at first, set the worker up."""
    with _LOCK:
        return _set_up(run, threads)


def _stop_run(run: str, threads: int) -> None:
    _run_here(run, threads)[0].set()


def _do_chunk(run: str, told: bytes) -> bytes:
    """Do a chunk on a worker, which begins another one while the last tasks wait for the network."""
    try:
        problem = _answer_to(run).result(_ASKED_S)
    except FutureTimeoutError:  # it was started anew under the address of another one
        raise TimeoutError("nobody asked the worker what it sees") from None
    if problem:
        raise WorkerError(problem)
    job, tasks = pickle.loads(told)  # noqa: S301 (as Dask does)
    stopped, pool = _run_here(run, job.threads)
    chunk: Chunk[Any, Any] = Chunk(job, tasks, stopped, pool)
    if pool is not None:
        from distributed import secede

        pool.submit(lambda: None).result()  # which begins after all the tasks
        secede()
    return pickle.dumps(chunk.done(), pickle.HIGHEST_PROTOCOL)


def scheduler_address(given: str) -> str:
    """Return the address of a scheduler, from its file where that is given.

    Raises
    ------
    UsageError
        There is no such file, or it is no scheduler's.
    """
    if "://" in given or not (given.endswith(".json") or os.sep in given):
        return given
    try:
        with reading(f"--scheduler {given}", "the scheduler file", UsageError):
            return str(json.loads(Path(given).read_bytes())["address"])
    except (ValueError, RecursionError, KeyError, TypeError) as error:
        raise UsageError(f"--scheduler {given}: is not a file that dask scheduler wrote") from error


def _connection_lost(address: str) -> WorkerError:
    return WorkerError(f"{address}: the connection to the scheduler is lost")


def _no_scheduler(address: str) -> WorkerError:
    return WorkerError(f"{address}: no Dask scheduler answers there")


@contextlib.contextmanager
def _silenced_logging() -> Iterator[None]:
    """Silence Dask, which logs every lost connection: a failure ends as one line of ours."""
    before = logging.root.manager.disable
    logging.disable()
    try:
        yield
    finally:
        logging.disable(before)


def _connect(address: str) -> Any:
    from distributed import Client
    from distributed import TimeoutError as DaskTimeoutError  # before Python 3.11 not the built-in one

    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except OSError as error:
        raise _no_scheduler(address) from error
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
    except DaskTimeoutError as error:
        client.close(timeout=1)
        raise WorkerError(f"{address}: has no workers; start some: dask worker {address}") from error
    return client


def _problems(
    client: Any, run: str, asked: Workers, workers: Collection[str]
) -> tuple[dict[str, str], set[str]]:
    """Ask workers whether they have this rollcli and see the files and folders that this process sees.

    Returns
    -------
    problems : dict of str
        What keeps a worker from taking part, by its address; those that can are left out.
    silent : set of str
        Those that did not answer: they may have died.
    """
    files = {path.absolute() for path in map(Path, asked.files) if is_file(path)}
    sizes = {str(path): path.stat().st_size for path in files}
    name = f".rollcli-check-{uuid.uuid4().hex}"  # of this run's own: another one may be asking now
    marks = [str(Path(folder).absolute() / name) for folder in asked.folders if not is_url(folder)]
    try:
        for mark in marks:
            write_atomic(mark, b"")
        question = (probe, __version__, sizes, marks, run)
        answers = client.run(*question, workers=list(workers), on_error="return")
    finally:
        for mark in marks:
            with contextlib.suppress(OutputError):  # the one that could not be made
                remove(mark)
    unable = f"cannot run rollcli {__version__}: "
    silent = {worker for worker, answer in answers.items() if isinstance(answer, OSError)}
    problems = {
        worker: answer if isinstance(answer, str) else unable + one_line(str(answer))
        for worker, answer in answers.items()
        if answer and worker not in silent
    }
    return problems, silent


def probe(version: str, sizes: dict[str, int], marks: list[str], run: str) -> str:
    """Say what keeps this worker from running the tasks of a run; empty when nothing does.

    Runs on the worker, whose chunks wait for the answer.
    """
    problem = _problem(version, sizes, marks)
    if not (answer := _answer_to(run)).done():
        answer.set_result(problem)
    return problem


def _problem(version: str, sizes: dict[str, int], marks: list[str]) -> str:
    if version != __version__:
        return f"has rollcli {__version__}, this is {version}"
    for path, size in sizes.items():
        if not is_file(path) or Path(path).stat().st_size != size:
            return f"does not see {path}; inputs must lie on storage that the workers share"
    for mark in marks:
        folder = Path(mark).parent
        if not is_there(mark):
            return f"does not see {folder}; what they write must lie on storage that the workers share"
        if not os.access(folder, os.W_OK):
            return f"cannot write to {folder}"
    return ""
