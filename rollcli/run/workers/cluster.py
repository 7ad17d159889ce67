"""The executor for workers elsewhere: a Dask cluster (extra `cluster`)."""

import asyncio
import contextlib
import logging
import os
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, wait
from concurrent.futures import Future as ConcurrentFuture
from functools import partial
from pathlib import Path
from typing import Any, Generic

from rollcli import __version__
from rollcli.errors import ClusterError, OutputError, UsageError
from rollcli.files.atomic import is_file, is_there, write_atomic
from rollcli.files.storage import remove
from rollcli.files.stores.locations import computing, is_url
from rollcli.run.workers.in_order import Result, SharedPaths, Task, Work
from rollcli.run.workers.pool import prepare_worker

_CONNECT_S, _GREETING_S, _FIRST_WORKER_S, _POLL_S = 6, 2, 5, 2
_IN_FLIGHT_PER_THREAD = 4
_DIED = "every worker that tried it died: killed for memory, perhaps, or crashed"


def check_scheduler(address: str) -> None:
    """Check that a scheduler answers, before anything is written.

    Dask's own client would take longer to give up, and end with a traceback.

    Raises
    ------
    UsageError
        That is no address, or the extra `cluster` is not installed.
    ClusterError
        No scheduler answers there.
    """
    _require_extra()
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
    """Runs tasks on the workers of a scheduler; Dask itself gives the task of a dead worker to another.

    Parameters
    ----------
    address : str
        Of the scheduler.
    work : Work
        What the workers do.
    shared : SharedPaths
        What each of them must see.
    threads : int
        Tasks that each thread of a worker has in hand at once; see `files.stores.turns`.

    Raises
    ------
    ClusterError
        No scheduler or no worker answers, a worker has another rollcli, or does not see the files.
    """

    def __init__(self, address: str, work: Work[Task, Result], shared: SharedPaths, threads: int) -> None:
        _require_extra()
        from distributed import KilledWorker

        self.worker_died: tuple[type[BaseException], ...] = (KilledWorker,)
        self._address, self._work = address, work
        self._resources = contextlib.ExitStack()
        self._resources.enter_context(_silenced_logging())
        try:
            self._client = _connect(address)
            self._resources.callback(self._client.close, timeout=2)
            _check_workers(self._client, shared)
            self._client.register_plugin(_worker_plugin())
        except BaseException:
            self._resources.close()
            raise
        self._do = partial(_in_turn, work.do) if threads > 1 else work.do
        self.window = max(_IN_FLIGHT_PER_THREAD, threads) * sum(self._client.nthreads().values())
        self._executor = self._client.get_executor(pure=False)

    def submit(self, task: Task) -> "ClusterFuture[Result]":
        """Queue a task for whichever worker is free."""
        if self._client.status == "closed":
            raise _connection_lost(self._address)
        return ClusterFuture(self._executor.submit(self._do, task), self._client, self._address)

    def retry(self, task: Task) -> Result:
        """Return the result of a lost task: several workers have tried it already."""
        return self._work.lost(task, _DIED)

    def close(self, *, at_once: bool) -> None:
        """Disconnect; the workers belong to the cluster and go on."""
        self._resources.close()


class ClusterFuture(Generic[Result]):
    """A future that does not outlive its client: a task that is sent while a connection breaks has no end.

    Raises
    ------
    ClusterError
        When its result is asked for and the scheduler is lost.
    """

    def __init__(self, future: "ConcurrentFuture[Result]", client: Any, address: str) -> None:
        self._future, self._client, self._address = future, client, address

    def result(self) -> Result:
        """Wait for the result."""
        while not wait([self._future], timeout=_POLL_S).done:
            if self._client.status == "closed":
                raise _connection_lost(self._address)
        try:
            return self._future.result()
        except CancelledError as error:
            raise _connection_lost(self._address) from error

    def cancel(self) -> bool:
        """Withdraw the task, unless it is done."""
        return self._future.cancel()


def _in_turn(do: Callable[[Task], Result], task: Task) -> Result:
    """Run a task that waits for the network; the worker takes others meanwhile, and one computes."""
    from distributed import secede

    secede()
    with computing():
        return do(task)


def _connection_lost(address: str) -> ClusterError:
    return ClusterError(f"{address}: the connection to the scheduler is lost")


def _no_scheduler(address: str) -> ClusterError:
    return ClusterError(f"{address}: no Dask scheduler answers there")


def _require_extra() -> None:
    try:
        import distributed  # noqa: F401 (it sets up its logging when it is loaded)
    except ImportError as error:
        raise UsageError("--scheduler needs the extra cluster: pip install 'rollcli[cluster]'") from error


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
        raise ClusterError(f"{address}: has no workers; start some: dask worker {address}") from error
    return client


def _worker_plugin() -> Any:
    from distributed import WorkerPlugin

    class PrepareWorker(WorkerPlugin):
        """Sets up every worker process, also those that join later."""

        name = "rollcli"

        def setup(self, worker: Any) -> None:
            """Set up the process that this worker runs in."""
            prepare_worker()

    return PrepareWorker()


def _check_workers(client: Any, shared: SharedPaths) -> None:
    """Ask every worker whether it has this rollcli and sees the files and folders that this process sees."""
    files = {path.absolute() for path in map(Path, shared.files) if is_file(path)}
    sizes = {str(path): path.stat().st_size for path in files}
    name = f".rollcli-check-{uuid.uuid4().hex}"  # of this run's own: another one may be asking now
    marks = [Path(folder).absolute() / name for folder in shared.folders if not is_url(folder)]
    made: list[Path] = []
    try:
        for mark in marks:
            made.append(mark)
            write_atomic(mark, b"")
        answers = client.run(probe, __version__, sizes, [str(mark) for mark in marks], on_error="return")
    finally:
        for mark in made:
            with contextlib.suppress(OutputError):  # the one that could not be made
                remove(str(mark))
    for worker, answer in answers.items():
        problem = answer if isinstance(answer, str) else f"cannot run rollcli {__version__}: {answer}"
        if problem:
            raise ClusterError(f"worker {worker}: {problem}")


def probe(version: str, sizes: dict[str, int], marks: list[str]) -> str:
    """Say what keeps this worker from running tasks; empty when nothing does. Runs on the worker."""
    if version != __version__:
        return f"has rollcli {__version__}, this is {version}"
    for path, size in sizes.items():
        if not is_file(path) or Path(path).stat().st_size != size:
            return f"does not see {path}; inputs must lie on storage that the workers share"
    for mark in marks:
        folder = Path(mark).parent
        if not is_there(mark):
            return f"does not see {folder}; image folders must lie on storage that the workers share"
        if not os.access(folder, os.W_OK):
            return f"cannot write to {folder}"
    return ""
