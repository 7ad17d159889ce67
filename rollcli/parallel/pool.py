"""The executor for several workers: processes on this machine.

Processes rather than threads: decoding releases the interpreter's lock, but the estimator's many small NumPy
calls do not, and a process that dies takes no other with it. Not those of `concurrent.futures` either: its
pool breaks as a whole when one process dies and does not say which task killed it, and its threads, which
hand out the tasks, take time from the workers.

Spawned, each worker loads NumPy and OpenCV by itself: 0.23 s of CPU time. Tried: multiprocessing's fork
server that has loaded them. Two workers then start in 0.26 s of CPU time in place of 0.46, eight in 0.5 in
place of 2.9. On two busy processors, two workers were ready after 0.7 s in place of 1.2. Free processors load
at the same time, and gain less. It is not taken: the server would be the workers' parent, and what ends them
when a run is killed, stopped or short of memory would have to be shown anew, for Linux alone.

Over 1,000 maps of 1242x375 on two busy processors, one process took 14.0 and 14.6 s of CPU time, and two
workers took 15.6 s with their parent, which worked alone for 0.2 s of that: two free processors could be 1.78
to 1.84 times as fast. The parent took 0.6 ms a row.
"""

from collections import deque
from multiprocessing import connection
from typing import Generic

from rollcli.parallel.in_order import Result, Task, Work
from rollcli.parallel.worker import Worker

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
