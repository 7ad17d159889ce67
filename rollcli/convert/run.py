"""A run that turns each frame into files of its own: checks, workers, exit status."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rollcli.files.atomic import remove_leftovers
from rollcli.frames.checks import check_one_owner, check_writes
from rollcli.frames.dry_run import list_files
from rollcli.frames.frame import Frame, Outcome, failed
from rollcli.frames.options import EncodingOptions, RunningOptions
from rollcli.frames.outputs import remove_outputs
from rollcli.frames.progress import INTERRUPTED, Report
from rollcli.parallel.in_order import Work
from rollcli.parallel.interrupt import stop_on_signals
from rollcli.parallel.local import done_locally
from rollcli.parallel.process_setup import limit_blas_threads


@dataclass(frozen=True, slots=True)
class Conversion:
    """What becomes of one frame.

    Attributes
    ----------
    frame : Frame
        What is read.
    writes : tuple of str
        The files that come of it.
    roll : float
        To rotate by, radians.
    refused : str
        Why this frame cannot be done; empty if it can.
    """

    frame: Frame
    writes: tuple[str, ...]
    roll: float = 0.0
    refused: str = ""


def convert(
    conversions: Sequence[Conversion],
    do: Callable[[Conversion], Outcome],
    running: RunningOptions,
    encoding: EncodingOptions,
) -> int:
    """Do every conversion.

    Parameters
    ----------
    conversions : sequence of Conversion
        In the order to do them.
    do : callable
        Does one; goes to the workers.
    running : RunningOptions
        How to run.
    encoding : EncodingOptions
        How maps are read: what "auto" has found is said.

    Returns
    -------
    int
        The exit status: 0 all are written, 3 some are not, 130 interrupted.

    Raises
    ------
    UsageError, OutputError
        Exit statuses 2 and 1.
    """
    _check(conversions, overwrite=running.overwrite)
    if running.dry_run:
        list_files((each.frame.reads(), each.writes) for each in conversions)
        return 0
    remove_leftovers(path for each in conversions for path in each.writes)
    limit_blas_threads()
    report = Report(len(conversions), running, encoding, statuses=("ok",))
    with stop_on_signals() as stop, report:
        done = done_locally(conversions, Work(do, _lost), running.jobs, stop)
        with contextlib.closing(done) as outcomes:
            for outcome in outcomes:
                report.add(outcome)
    report.note(report.summary())
    if stop.asked and report.done < report.total:
        report.say("interrupted; what is written is whole, and --overwrite starts anew")
        return INTERRUPTED
    return report.status


def _check(conversions: Sequence[Conversion], *, overwrite: bool) -> None:
    writes = [path for each in conversions for path in each.writes]
    check_one_owner((each.frame, each.writes) for each in conversions)
    reads = [path for each in conversions for path in each.frame.reads()]
    check_writes(reads, writes, overwrite=overwrite)


def _lost(conversion: Conversion, reason: str) -> Outcome:
    remove_outputs(conversion.writes)
    remove_leftovers(conversion.writes)
    return failed(conversion.frame, reason)
