"""The executor for several workers: processes on this machine."""

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from multiprocessing import connection, reduction
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, Generic

from rollcli.errors import RollcliError, WorkerError
from rollcli.files.stores.locations import computing
from rollcli.run.workers.in_order import Result, Task, Work
from rollcli.run.workers.interrupt import ignore_signals, stop_signals

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
_MIB = 2**20


def limit_blas_threads() -> None:
    """Limit NumPy's linear algebra to one thread, here and in child processes; call it before NumPy loads."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")


def prepare_worker() -> None:
    """Set up this process to run tasks: one thread, silent decoders, memory that is kept between tasks."""
    import cv2

    from rollcli.files.codecs.png import silence_decoders

    cv2.setNumThreads(1)  # tasks run in parallel, not the loops inside of one
    silence_decoders()
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Let glibc keep the arrays of a task for the next one: returning them costs a fifth of the time."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library, which has no such function
    mallopt(_M_MMAP_THRESHOLD, 32 * _MIB)
    mallopt(_M_TRIM_THRESHOLD, 256 * _MIB)


_POLL_S = 0.002  # a task that waits for the network takes ten times as long


class Worker:
    """The parent's end of a worker process.

    The process is spawned, not forked: a fork copies locks that other threads hold.

    Parameters
    ----------
    do : callable
        Turns a task into its result.
    keep_open : int or None
        A file descriptor that the process inherits and keeps open until it ends.
    threads : int
        Tasks that it runs at once; their answers come in the order of the tasks.

    Raises
    ------
    WorkerError
        The system starts no further process.

    Attributes
    ----------
    pipe : Connection
        Tasks go in, (result, error) comes out.
    pending : deque
        The futures of the tasks that were sent and not answered, oldest first: the first one is running.
    """

    def __init__(self, do: Callable[[Any], Any], keep_open: int | None, threads: int) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.pending: deque[Any] = deque()
        try:
            self.pipe, far_end = spawn.Pipe()
            inherited = _InheritedFile(keep_open)
            arguments = (far_end, do, inherited, threads)
            self._process = spawn.Process(target=_serve, args=arguments, daemon=True)
            with _stop_signals_blocked():  # the child inherits this: only the parent decides when work ends
                self._process.start()
        except OSError as error:
            raise _cannot_start(error) from error
        far_end.close()

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def close(self) -> None:
        """End the process after its current task, and wait for that."""
        self.pipe.close()
        self._process.join()


def _serve(
    pipe: "Connection[Any, Any]", do: Callable[[Any], Any], inherited: "_InheritedFile", threads: int
) -> None:
    """Run tasks until the pipe is closed; `inherited` is an argument so that its file stays open."""
    ignore_signals()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    start_error = _prepare()

    def answer(task: Any) -> tuple[Any, Exception | None]:
        with _Answer() as answer:
            if start_error is not None:
                raise start_error
            answer.value = do(task)
        return answer.value, answer.error

    with contextlib.suppress(EOFError, OSError):  # the parent has closed its end: all is done
        if threads == 1:
            while True:
                pipe.send(answer(pipe.recv()))
        _serve_in_threads(pipe, answer, threads)
    os._exit(0)  # there is nothing to clean up, and unloading NumPy and OpenCV takes longer than two frames


def _serve_in_threads(pipe: "Connection[Any, Any]", answer: Callable[[Any], Any], threads: int) -> None:
    """Answer tasks in their order, while those after them run, too; one computes at a time."""
    from concurrent.futures import ThreadPoolExecutor  # only where tasks wait for the network

    def in_turn(task: Any) -> Any:
        with computing():
            return answer(task)

    pool, running = ThreadPoolExecutor(threads), deque[Any]()
    while True:
        if not running or pipe.poll():
            running.append(pool.submit(in_turn, pipe.recv()))
        elif running[0].done():
            pipe.send(running.popleft().result())
        else:
            connection.wait([pipe], timeout=_POLL_S)


def _prepare() -> WorkerError | None:
    """Set up this process; return the error that keeps it from working, since no task is to blame for it."""
    try:
        prepare_worker()
    except (ImportError, OSError, MemoryError) as error:  # no memory left for NumPy or OpenCV
        return _cannot_start(error)
    return None


def _cannot_start(error: Exception) -> WorkerError:
    return WorkerError(f"a worker process cannot start: {error}; try fewer of them, with --jobs")


def _end_with_parent() -> None:
    """Exit when the parent has died: a killed run must leave no workers that go on writing."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


class _Answer:
    """The result of a task, or the error that it raised, which the parent raises again."""

    value: Any = None
    error: Exception | None = None

    def __enter__(self) -> "_Answer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> bool:
        if isinstance(error, RollcliError):
            self.error = error
        elif isinstance(error, Exception):
            while at is not None and at.tb_next is not None:
                at = at.tb_next
            where = f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}" if at else "a worker"
            self.error = RuntimeError(f"{type(error).__name__} in {where}: {error}")
        return self.error is not None


class _InheritedFile:
    """A file descriptor that is still open after this object was sent to a spawned process."""

    def __init__(self, descriptor: int | None) -> None:
        self.descriptor = descriptor

    def __reduce__(self) -> tuple[Any, ...]:
        if self.descriptor is None or sys.platform == "win32":
            return _InheritedFile, (None,)
        return _received, (reduction.DupFd(self.descriptor),)


def _received(duplicate: Any) -> _InheritedFile:
    return _InheritedFile(duplicate.detach())


@contextlib.contextmanager
def _stop_signals_blocked() -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # not on Windows

    resource_tracker.ensure_running()  # it would start inside the block, and unblock Ctrl-C when it does
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set(stop_signals()))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_SPARE_TASKS = 1  # of a worker, beside those that it runs
_IN_FLIGHT = 2  # times the tasks that workers have: a slow one holds back the results after it
_DIED = "its worker died twice: killed for memory, perhaps, or crashed"


class WorkerDiedError(Exception):
    """The process that ran a task has ended."""


class PoolExecutor(Generic[Task, Result]):
    """A fixed number of processes; tasks are sent and results received while someone waits for a result.

    Parameters
    ----------
    jobs : int
        The number of processes.
    work : Work
        What they do.
    keep_open : int or None
        A file descriptor that they inherit and keep open until they end.
    threads : int
        Tasks that each runs at once; see `files.stores.turns`.

    Raises
    ------
    WorkerError
        The system starts no further process.
    """

    worker_died: tuple[type[BaseException], ...] = (WorkerDiedError,)

    def __init__(
        self, jobs: int, work: Work[Task, Result], keep_open: int | None = None, threads: int = 1
    ) -> None:
        self._tasks_per_worker = threads + _SPARE_TASKS
        self.window = _IN_FLIGHT * self._tasks_per_worker * jobs
        self._work, self._keep_open, self._threads = work, keep_open, threads
        self._workers: list[Worker] = []
        self._queue: deque[PoolFuture[Task, Result]] = deque()
        try:
            for _ in range(jobs):
                self._workers.append(Worker(work.do, keep_open, threads))
        except BaseException:
            self.close(at_once=True)
            raise

    def submit(self, task: Task) -> "PoolFuture[Task, Result]":
        """Queue a task, and send it when a worker is free."""
        future = PoolFuture(self, task)
        self._queue.append(future)
        self._send_tasks()
        return future

    def retry(self, task: Task) -> Result:
        """Run a task again whose worker died, alone, so that it has all the memory."""
        waiting, self._queue = self._queue, deque()
        while any(worker.pending for worker in self._workers):
            self.make_progress()
        try:
            return self.submit(task).result()
        except WorkerDiedError:
            return self._work.lost(task, _DIED)
        finally:
            self._queue.extend(waiting)

    def cancel(self, future: "PoolFuture[Task, Result]") -> bool:
        """Remove a task from the queue, if it still is there."""
        if future not in self._queue:
            return False
        self._queue.remove(future)
        return True

    def make_progress(self) -> None:
        """Wait until a worker answers or dies, and send further tasks."""
        asked = [worker.pipe for worker in self._workers if worker.pending]
        ready = connection.wait(asked) if asked else []  # of nobody, it would wait for ever
        for index, worker in enumerate(self._workers):
            if worker.pipe in ready:
                self._receive(index, worker)
        self._send_tasks()

    def close(self, *, at_once: bool) -> None:
        """End the workers: after their current task, or at once."""
        for worker in self._workers if at_once else ():
            worker.kill()
        for worker in self._workers:
            worker.close()

    def _send_tasks(self) -> None:
        for most in range(self._tasks_per_worker):  # nobody gets a spare task while another has none
            for index, worker in enumerate(self._workers):
                if self._queue and len(worker.pending) <= most:
                    self._send(index, worker, self._queue.popleft())

    def _send(self, index: int, worker: Worker, future: "PoolFuture[Task, Result]") -> None:
        worker.pending.append(future)
        try:
            worker.pipe.send(future.task)
        except OSError:  # it died while it was idle: no task is to blame
            if len(worker.pending) == 1:
                self._replace(index, worker)

    def _receive(self, index: int, worker: Worker) -> None:
        try:
            answer = worker.pipe.recv()
        except (EOFError, OSError):
            begun = [future.task for future in worker.pending]  # all of them, perhaps, in its threads
            worker.pending.popleft().settle(None, WorkerDiedError())
            self._replace(index, worker)
            for task in begun:
                self._work.clear(task)
        else:
            worker.pending.popleft().settle(*answer)

    def _replace(self, index: int, worker: Worker) -> None:
        """Start a new worker in place of a dead one, and requeue the tasks that it had not begun."""
        self._queue.extendleft(reversed(worker.pending))
        worker.close()
        self._workers[index] = Worker(self._work.do, self._keep_open, self._threads)


class PoolFuture(Generic[Task, Result]):
    """A task that was submitted to a pool."""

    def __init__(self, executor: PoolExecutor[Task, Result], task: Task) -> None:
        self.task = task
        self._executor = executor
        self._answer: tuple[Result, Exception | None] | None = None

    def settle(self, value: Result, error: Exception | None) -> None:
        """Store the result of the task, or the error that it raised."""
        self._answer = value, error

    def result(self) -> Result:
        """Wait for the result; raise what the task raised, or WorkerDiedError."""
        while self._answer is None:
            self._executor.make_progress()
        value, error = self._answer
        if error is not None:
            raise error
        return value

    def cancel(self) -> bool:
        """Withdraw the task; return False when a worker has it."""
        return self._executor.cancel(self)
