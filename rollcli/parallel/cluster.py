"""Workers on a Dask cluster: the same frames, sent to an executor elsewhere (extra `cluster`)."""

import asyncio
import logging
import os
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError, Future, wait
from dataclasses import replace
from pathlib import Path
from typing import Any

from rollcli import __version__
from rollcli.errors import ClusterError, UsageError
from rollcli.files.atomic import write_atomic
from rollcli.frames.frame import Frame, Outcome, do, lost
from rollcli.frames.options import FrameOptions
from rollcli.frames.outputs import remove_image_leftovers
from rollcli.parallel.in_order import in_order
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.process_setup import prepare_worker

_CONNECT_S, _FIRST_WORKER_S, _LOOK_EVERY_S = 6, 5, 2
_IN_FLIGHT_PER_THREAD = 4
_LOST = "every worker that tried it died: killed for memory, perhaps, or crashed"


def check_scheduler(address: str) -> None:
    """See that a scheduler answers, before anything is touched.

    Not left to Dask's client: one that cannot connect takes its time, and ends with a traceback.

    Raises
    ------
    UsageError
        That is no address, or the extra `cluster` is not installed.
    ClusterError
        Nobody answers there, or nobody who speaks as a scheduler does.
    """
    _silence_dask()
    try:
        asyncio.run(asyncio.wait_for(_open_and_close(address), _CONNECT_S + 2))
    except (ValueError, TypeError) as error:  # the latter for TLS that is not set up
        raise UsageError(
            f"--scheduler {address!r}: {error}; an address looks like tcp://host:8786"
        ) from error
    # the last for servers of another kind: their first bytes are taken for a size
    except (OSError, asyncio.TimeoutError, MemoryError) as error:
        raise ClusterError(f"{address}: no Dask scheduler answers there") from error


async def _open_and_close(address: str) -> None:
    from distributed.comm.core import connect
    from distributed.security import Security

    comm = await connect(address, timeout=_CONNECT_S, **Security().get_connection_args("client"))
    await comm.close()


def cluster_outcomes(
    frames: Sequence[Frame], options: FrameOptions, address: str, stop: Stop
) -> Generator[Outcome, None, None]:
    """The outcome of each frame, in order, from the workers of the scheduler at `address`.

    Raises
    ------
    ClusterError
        No scheduler or no worker answers, a worker has not this rollcli or does not see the files, or the
        scheduler is lost.
    """
    options = replace(options, root=str(Path.cwd()))
    client = _connect(address)
    try:
        _check_workers(client, frames, options)
        client.register_plugin(_worker_plugin())
        yield from in_order(frames, ClusterCrew(client, options), stop)
    except CancelledError as error:
        raise ClusterError(f"{address}: the connection to the scheduler is lost") from error
    finally:
        client.close(timeout=2)
        remove_image_leftovers(frames, options.images)  # of workers that died


class ClusterCrew:
    """The cluster's own executor; Dask itself gives a lost frame to another worker."""

    def __init__(self, client: Any, options: FrameOptions) -> None:
        from distributed import KilledWorker

        self.deaths: tuple[type[BaseException], ...] = (KilledWorker,)
        self.window = _IN_FLIGHT_PER_THREAD * sum(client.nthreads().values())
        self._client, self._options = client, options
        self._executor = client.get_executor(pure=False)

    def submit(self, frame: Frame) -> "ClusterTicket":
        """Start a frame on whichever worker is free."""
        if self._client.status == "closed":
            raise CancelledError
        return ClusterTicket(self._executor.submit(do, frame, self._options), self._client)

    def again(self, frame: Frame) -> Outcome:
        """Several workers have tried it already."""
        return lost(frame, _LOST, self._options.images)


def _silence_dask() -> None:
    """No lines of Dask's own: what goes wrong ends as one of ours."""
    try:
        import distributed  # noqa: F401 (it sets up its logging when it is loaded)
    except ImportError as error:
        raise UsageError("--scheduler needs the extra cluster: pip install 'rollcli[cluster]'") from error
    logging.disable()


class ClusterTicket:
    """A future that does not outlive its client: what is sent while a connection breaks is never answered."""

    def __init__(self, future: "Future[Outcome]", client: Any) -> None:
        self._future, self._client = future, client

    def result(self) -> Outcome:
        """Wait for the outcome; CancelledError when the scheduler is lost."""
        while not wait([self._future], timeout=_LOOK_EVERY_S).done:
            if self._client.status == "closed":
                raise CancelledError
        return self._future.result()

    def cancel(self) -> bool:
        """Give the frame back, unless it is done."""
        return self._future.cancel()


def _connect(address: str) -> Any:
    from distributed import Client
    from distributed import TimeoutError as DaskTimeoutError  # before Python 3.11 not the built-in one

    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except OSError as error:
        raise ClusterError(f"{address}: no Dask scheduler answers there") from error
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
    except DaskTimeoutError as error:
        client.close(timeout=1)
        raise ClusterError(f"{address}: has no workers; start some: dask worker {address}") from error
    return client


def _worker_plugin() -> Any:
    from distributed import WorkerPlugin

    class PrepareWorker(WorkerPlugin):
        """Sets up every worker process, also of workers that come later."""

        name = "rollcli"

        def setup(self, worker: Any) -> None:
            prepare_worker()

    return PrepareWorker()


def _check_workers(client: Any, frames: Sequence[Frame], options: FrameOptions) -> None:
    """Ask every worker whether it is this rollcli and sees the files and folders that this process sees."""
    sample = {path for frame in (*frames[:1], *frames[-1:]) for path in frame.reads() if Path(path).exists()}
    sizes = {options.at(path): Path(path).stat().st_size for path in sample}
    marks = [Path(options.at(folder), ".rollcli-check") for _, folder in options.images.folders()]
    try:
        for mark in marks:
            write_atomic(mark, b"")
        answers = client.run(probe, __version__, sizes, [str(mark) for mark in marks], on_error="return")
    finally:
        for mark in marks:
            mark.unlink(missing_ok=True)
    for worker, answer in answers.items():
        problem = answer if isinstance(answer, str) else f"cannot run rollcli {__version__}: {answer}"
        if problem:
            raise ClusterError(f"worker {worker}: {problem}")


def probe(version: str, sizes: dict[str, int], marks: list[str]) -> str:
    """What keeps this worker from doing frames; empty if nothing does. Runs on the worker."""
    if version != __version__:
        return f"has rollcli {__version__}, this is {version}"
    for path, size in sizes.items():
        if not Path(path).is_file() or Path(path).stat().st_size != size:
            return f"does not see {path}; inputs must lie on storage that the workers share"
    for mark in marks:
        folder = Path(mark).parent
        if not Path(mark).exists():
            return f"does not see {folder}; image folders must lie on storage that the workers share"
        if not os.access(folder, os.W_OK):
            return f"cannot write to {folder}"
    return ""
