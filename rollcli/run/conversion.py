"""Convert each frame into files of its own: checks, workers, exit status."""

import contextlib
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from rollcli.errors import ExitStatus
from rollcli.files.atomic import remove_leftovers
from rollcli.files.containers import file_of
from rollcli.files.results import Row
from rollcli.files.stores.locations import tasks_in_hand
from rollcli.run.frame import Frame, FrameResult, failed_frame
from rollcli.run.options import EncodingOptions, RunningOptions
from rollcli.run.outputs import write_outputs
from rollcli.run.progress import Progress
from rollcli.run.reads_and_writes import check_one_owner, check_places, check_writes, list_files
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.in_order import SharedPaths, Workers
from rollcli.run.workers.interrupt import Stop, stop_on_signals
from rollcli.run.workers.tasks import require_scheduler, run_tasks


@dataclass(frozen=True, slots=True)
class Conversion:
    """The task of converting one frame.

    Attributes
    ----------
    frame : Frame
        What is read.
    writes : tuple of str
        The files that are written.
    roll : float
        Angle to rotate by, radians.
    row : Row or None
        Of the frame in a result.
    refused : str
        Why this frame cannot be converted; empty when it can.
    keeps_numbers : bool
        What is stored stays as it is: how it is read does not matter.
    """

    frame: Frame
    writes: tuple[str, ...]
    roll: float = 0.0
    row: Row | None = None
    refused: str = ""
    keeps_numbers: bool = False


def convert(
    conversions: Sequence[Conversion],
    do: Callable[[Conversion], FrameResult],
    folder: str,
    running: RunningOptions,
    encoding: EncodingOptions,
) -> ExitStatus:
    """Run every conversion.

    Parameters
    ----------
    conversions : sequence of Conversion
        In the order to run them.
    do : callable
        Runs one; it is pickled and sent to the workers.
    folder : str
        What they write lies below it.
    running : RunningOptions
        How to run.
    encoding : EncodingOptions
        How maps are read: an encoding that "auto" found is named once.

    Raises
    ------
    UsageError, OutputError, ClusterError, WorkerError
        The run cannot start or cannot go on.
    """
    conversions = [each if each.frame.relative else replace(each, writes=()) for each in conversions]
    _check(conversions, folder, overwrite=running.overwrite)
    if running.dry_run:
        list_files((each.frame.reads(), each.writes) for each in conversions)
        return ExitStatus.DONE
    require_scheduler(running.scheduler)
    remove_leftovers(path for each in conversions for path in each.writes)
    progress = Progress(len(conversions), running, encoding, statuses=("ok",))
    with (
        stop_on_signals() as stop,
        progress,
        contextlib.closing(_results(conversions, do, folder, running, stop)) as results,
    ):
        for result in results:
            progress.add(result)
    progress.tell_end()
    if stop.asked and progress.done < progress.total:
        progress.say("interrupted; what is written is whole, and --overwrite starts anew")
        return ExitStatus.INTERRUPTED
    return progress.summary.status


def _results(
    conversions: Sequence[Conversion],
    do: Callable[[Conversion], FrameResult],
    folder: str,
    running: RunningOptions,
    stop: Stop,
) -> Generator[FrameResult, None, None]:
    """Yield the result of each conversion from whichever workers were asked for."""
    sample = (*conversions[:1], *conversions[-1:])
    files = tuple(file_of(path) for each in sample for path in each.frame.reads())
    shared = SharedPaths(files, (folder,))
    workers = Workers(running.jobs, running.scheduler, shared, threads=tasks_in_hand((*files, folder)))
    work = Work(do, partial(_lost, replaces=running.overwrite), lambda each: remove_leftovers(each.writes))
    try:
        yield from run_tasks(conversions, work, stop, workers)
    finally:
        if workers.scheduler is not None:  # a worker that died elsewhere cannot be waited for
            remove_leftovers(path for each in conversions for path in each.writes)


def _check(conversions: Sequence[Conversion], folder: str, *, overwrite: bool) -> None:
    writes = [path for each in conversions for path in each.writes]
    check_one_owner((each.frame, each.writes) for each in conversions)
    reads = [path for each in conversions for path in each.frame.reads()]
    check_places([each.frame for each in conversions], [folder])
    check_writes(reads, writes, overwrite=overwrite)


def _lost(conversion: Conversion, reason: str, replaces: bool) -> FrameResult:
    write_outputs({}, conversion.writes, replaces=replaces)
    return failed_frame(conversion.frame, reason)
