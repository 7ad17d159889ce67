"""The executor for several workers: processes on this machine."""

import contextlib
import ctypes
import multiprocessing
import os
import queue
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from multiprocessing import connection
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Generic

from rollcli.errors import WorkerDiedError, WorkerError
from rollcli.extras import silence_matplotlib
from rollcli.run.workers.chunks import Chunk, Done, Job, Result, Task, Work, Workers
from rollcli.run.workers.interrupt import ignore_signals, stop_signals

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
# of matplotlib, where a notebook names a backend that may not be installed here, and whose figures have no
# dates; and of OpenCV, which writes its log into standard output, and has limits where we have our own
_OF_OTHERS = (
    *("MPLBACKEND", "SOURCE_DATE_EPOCH", "OPENCV_LOG_LEVEL"),
    *(f"OPENCV_IO_MAX_IMAGE_{of}" for of in ("PIXELS", "WIDTH", "HEIGHT")),
)
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
_MIB = 2**20


def limit_blas_threads() -> None:
    """Limit NumPy's linear algebra to one thread, here and in child processes; call it before NumPy loads."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")


def forget_settings() -> None:
    """Forget what is set for other programs that use our libraries; call it before these load."""
    for name in _OF_OTHERS:
        os.environ.pop(name, None)


def _load_decoders() -> None:
    import cv2  # noqa: F401 (to have loaded it)


def prepare_worker() -> None:
    """Set up this process to run tasks: one thread, silent decoders, memory that is kept between tasks."""
    import cv2

    from rollcli.files.codecs.png import silence_decoders

    cv2.setNumThreads(1)  # tasks run in parallel, not the loops inside of one
    silence_decoders()
    silence_matplotlib()
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Let glibc keep the arrays of a task for the next one: returning them costs a fifth of the time."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library, which has no such function
    mallopt(_M_MMAP_THRESHOLD, 32 * _MIB)
    mallopt(_M_TRIM_THRESHOLD, 256 * _MIB)


_Queued = tuple[Sequence[Task], Future[Done[Result]]]
_STOP = None  # what a worker is sent in place of a chunk
_POLL_S = 0.2
_CHUNKS_IN_HAND = 2  # of a worker: the next one is there when it has done one
_DIED = "its worker died twice: killed for memory, perhaps, or crashed"


class PoolExecutor(Generic[Task, Result]):
    """A fixed number of processes; chunks are sent and results received while someone waits for a result.

    Parameters
    ----------
    workers : int
        The number of processes.
    work : Work
        What they do.
    asked : Workers
        What else was asked of them.

    Raises
    ------
    WorkerError
        The system starts no further process.
    """

    def __init__(self, workers: int, work: Work[Task, Result], asked: Workers) -> None:
        self.workers, self.threads = workers, asked.threads
        self._work, self._stopped = work, False
        self._pool: list[Worker[Task, Result]] = []
        self._queue: deque[_Queued[Task, Result]] = deque()
        try:
            for _ in range(workers):
                self._pool.append(Worker(work, self.threads))
        except BaseException:
            self.close(at_once=True)
            raise

    def submit(self, chunk: Sequence[Task], *, first: bool = False) -> Future[Done[Result]]:
        """Queue a chunk, and send it when a worker is free."""
        future = Future[Done[Result]]()
        (self._queue.appendleft if first else self._queue.append)((chunk, future))
        self._send_chunks()
        return future

    def wait(self, future: Future[Done[Result]]) -> None:
        """Wait until a worker answers or dies, or for a fifth of a second."""
        self._receive(_POLL_S)

    def retry(self, chunk: Sequence[Task]) -> Done[Result]:
        """Run a single task again that kills workers, alone, so that it has all the memory."""
        waiting, self._queue = self._queue, deque()
        while any(worker.in_hand for worker in self._pool):
            self._receive(None)
        future = self.submit(chunk)
        while not future.done():
            self._receive(None)
        self._queue.extend(waiting)
        return future.result()

    def stop(self) -> None:
        """Let workers begin no further task."""
        if self._stopped:
            return
        self._stopped = True
        for _, future in self._queue:
            future.set_result(Done([], 0.0))
        self._queue.clear()
        for worker in self._pool:
            worker.stop()

    def close(self, *, at_once: bool) -> None:
        """End the workers: after their current task, or at once."""
        for worker in self._pool:
            if at_once:
                worker.kill()
            else:
                worker.stop()
        for worker in self._pool:
            worker.join()

    def _receive(self, timeout: float | None) -> None:
        """Wait until a worker answers or dies, and send further chunks."""
        asked = [worker.pipe for worker in self._pool if worker.in_hand]
        ready = connection.wait(asked, timeout) if asked else []  # of nobody, it would wait for ever
        for index, worker in enumerate(self._pool):
            if worker.pipe in ready:
                self._receive_from(index, worker)
        self._send_chunks()

    def _receive_from(self, index: int, worker: "Worker[Task, Result]") -> None:
        try:
            done = worker.pipe.recv()
        except (EOFError, OSError):
            begun = [task for chunk, _ in worker.in_hand for task in chunk]  # all of them, perhaps
            worker.in_hand.popleft()[1].set_exception(WorkerDiedError(_DIED))
            while self._stopped and worker.in_hand:
                worker.in_hand.popleft()[1].set_result(Done([], 0.0))
            self._replace(index, worker)
            self._work.clear(begun)
        else:
            worker.in_hand.popleft()[1].set_result(done)

    def _send_chunks(self) -> None:
        for most in range(_CHUNKS_IN_HAND):  # nobody gets a second chunk while another has none
            for index, worker in enumerate(self._pool):
                while self._queue and (len(worker.in_hand) <= most or worker.tasks < self.threads):
                    self._send(index, worker, self._queue.popleft())

    def _send(self, index: int, worker: "Worker[Task, Result]", queued: "_Queued[Task, Result]") -> None:
        worker.in_hand.append(queued)
        try:
            worker.pipe.send(queued[0])
        except OSError:  # it died while it had nothing to do: no task is to blame
            if len(worker.in_hand) == 1:
                self._replace(index, worker)

    def _replace(self, index: int, worker: "Worker[Task, Result]") -> None:
        """Start a new worker in place of a dead one, and requeue the chunks that it had not begun."""
        self._queue.extendleft(reversed(worker.in_hand))
        worker.join()
        if not self._stopped:
            self._pool[index] = Worker(self._work, self.threads)


class Worker(Generic[Task, Result]):
    """The parent's end of a worker process, which loads its libraries as soon as it is started.

    Linux forks it from a parent that has loaded them, which takes 3 ms where a new process takes 300. Where
    the parent has other threads, and on other systems, it is spawned: a fork copies locks that other threads
    hold. A fork shares the lock of the result, too, until it ends.

    Parameters
    ----------
    work : Work
        What it does.
    threads : int
        Tasks that it has in hand at once.

    Raises
    ------
    WorkerError
        The system starts no further process.

    Attributes
    ----------
    pipe : Connection
        Chunks go in, what was done of them comes out.
    in_hand : deque
        The chunks that were sent and not answered, oldest first, each with its future.
    """

    def __init__(self, work: Work[Task, Result], threads: int) -> None:
        # libraries may start threads when they load
        loads = _has_one_thread() and _error_of(_load_decoders) is None
        fork = hasattr(os, "fork") and loads and _has_one_thread()
        start: Any = multiprocessing.get_context("fork" if fork else "spawn")
        self.in_hand: deque[_Queued[Task, Result]] = deque()
        try:
            self.pipe, far_end = start.Pipe()
            told = (far_end, self.pipe if fork else None, work.job(threads))
            self._process = start.Process(target=_serve, args=told, daemon=True)
            with _stop_signals_blocked(fork):  # in the child, too: only the parent decides when work ends
                self._process.start()
        except OSError as error:
            raise _cannot_start(error) from error
        far_end.close()

    @property
    def tasks(self) -> int:
        """The number of tasks that it has in hand, or has done and not answered."""
        return sum(len(chunk) for chunk, _ in self.in_hand)

    def stop(self) -> None:
        """Let it begin no further task."""
        with contextlib.suppress(OSError):
            self.pipe.send(_STOP)

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def join(self) -> None:
        """Wait for the end of a process that was stopped or killed."""
        with contextlib.suppress(EOFError, OSError):
            while True:
                self.pipe.recv()  # what nobody asks for any more would keep it
        self._process.join()
        self.pipe.close()


def _has_one_thread() -> bool:
    """Tell whether this process has a single thread, where the system can tell: on Linux."""
    try:
        return sum(1 for _ in Path("/proc/self/task").iterdir()) == 1
    except OSError:
        return False


def _serve(pipe: "Connection[Any, Any]", near_end: "Connection[Any, Any] | None", job: Job) -> None:
    """Do chunks, in a worker process, until it is stopped or the parent has died.

    A fork has the parent's end of its pipe, too, which would hide that the parent has died. It also has those
    of workers begun before it; it ends at once with the parent, and so they do, one after the other.
    """
    ignore_signals()
    if near_end is not None:
        near_end.close()
    start_error = _error_of(prepare_worker)
    pool = None
    if job.threads > 1:
        from concurrent.futures import ThreadPoolExecutor  # only where tasks wait for the network

        pool = ThreadPoolExecutor(job.threads)
    chunks: queue.SimpleQueue[Chunk[Any, Any] | None] = queue.SimpleQueue()
    stopped = threading.Event()

    def receive() -> None:
        try:
            while True:
                tasks = pipe.recv()
                if tasks is _STOP:
                    stopped.set()
                chunks.put(None if tasks is _STOP else Chunk(job, tasks, stopped, pool))
        finally:  # the parent has died: a killed run must leave no workers that go on writing
            os._exit(1)

    threading.Thread(target=receive, daemon=True).start()
    while (chunk := chunks.get()) is not None:
        done = chunk.done() if start_error is None else Done([], 0.0, start_error)
        with contextlib.suppress(OSError):  # the parent has died, and `receive` ends this process
            pipe.send(done)
    os._exit(0)  # there is nothing to clean up, and unloading NumPy and OpenCV takes longer than two frames


def _error_of(load: Callable[[], None]) -> WorkerError | None:
    """Load what tasks need; return the error that keeps this process from working: no task is to blame."""
    try:
        load()
    except (ImportError, OSError, MemoryError) as error:  # no memory left for NumPy or OpenCV
        return _cannot_start(error)
    return None


def _cannot_start(error: Exception) -> WorkerError:
    return WorkerError(f"a worker process cannot start: {error}; try fewer of them, with --jobs")


@contextlib.contextmanager
def _stop_signals_blocked(fork: bool) -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    if not fork:
        from multiprocessing import resource_tracker  # not on Windows

        resource_tracker.ensure_running()  # it would start inside the block, and unblock Ctrl-C when it does
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set(stop_signals()))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
