"""A run: the plan, the workers, the rows in order, and the exit status."""

import contextlib
from collections.abc import Generator, Mapping, Sequence
from functools import partial
from typing import Any

from rollcli.batch.options import EstimateOptions
from rollcli.batch.plan import Plan, make_plan
from rollcli.batch.result_file import ResultFile, RowSink, check_result, kept_rows, open_sink
from rollcli.batch.run_record import RunRecord, check_resumable, not_resumable
from rollcli.errors import ClusterError, InputError, OutputError, WorkerError
from rollcli.files.atomic import remove_leftovers
from rollcli.files.results import Row, parse_rows, read_run, run_path
from rollcli.files.stream import STDOUT
from rollcli.frames.dry_run import list_files
from rollcli.frames.frame import Frame, Outcome, do, lost
from rollcli.frames.outputs import image_paths, remove_image_leftovers
from rollcli.frames.progress import INTERRUPTED, Report
from rollcli.parallel.in_order import Work
from rollcli.parallel.interrupt import Stop, stop_on_signals
from rollcli.parallel.local import done_locally
from rollcli.parallel.process_setup import limit_blas_threads


def run(options: EstimateOptions, resume_command: str = "") -> int:
    """Do what was asked.

    Parameters
    ----------
    options : EstimateOptions
    resume_command : str
        What to type to continue this run, for the message when it is interrupted.

    Returns
    -------
    int
        The exit status: 0 all frames have an angle, 3 some have not, 130 interrupted.

    Raises
    ------
    UsageError, OutputError
        Exit statuses 2 and 1.
    """
    plan = make_plan(options)
    if options.running.dry_run:
        _list(plan, options)
        return 0
    limit_blas_threads()
    if options.result.scheduler is not None:
        from rollcli.parallel.cluster import check_scheduler

        check_scheduler(options.result.scheduler)
    given, report = options.result, Report(len(plan.frames), options.running, options.encoding)
    with open_sink(
        plan.output,
        plan.format,
        resume=given.resume,
        overwrite=options.running.overwrite,
        timing=given.timing,
    ) as sink:
        record, done = _take_up(sink, plan, options, report)
        try:
            with stop_on_signals() as stop, report:
                _work(plan.frames[done:], options, sink, record, report, stop)
        except KeyboardInterrupt:  # asked twice: without waiting for the frames in flight
            report.stopped_early = True
        except (OutputError, ClusterError, WorkerError) as error:
            raise type(error)(f"{error}{_hint(sink, report)}") from error
        return _end(record, report, stop, resume_command)


def _take_up(
    sink: RowSink, plan: Plan, options: EstimateOptions, report: Report
) -> tuple[RunRecord | None, int]:
    """Begin the result, or continue it; the record of the run, and how many rows are there already."""
    if not isinstance(sink, ResultFile):
        sink.begin()
        return None, 0
    record = RunRecord(plan, options)
    rows, earlier = _kept(sink, plan)
    if rows:
        record.continue_from(check_resumable(rows, earlier, record, plan))
        report.keep(rows)
    if options.result.resume or options.running.overwrite:
        remove_image_leftovers(plan.frames[len(rows) :], options.images)
    remove_leftovers([run_path(plan.output)])
    # in this order a run that is killed in between can be resumed: an empty file is taken for a new one
    sink.empty(keep=bool(rows))
    record.write({})
    sink.begin()
    return record, len(rows)


def _kept(sink: ResultFile, plan: Plan) -> tuple[tuple[Row, ...], Mapping[str, Any] | None]:
    """The rows of an interrupted run and its record."""
    if not sink.kept:
        return (), None
    try:
        rows = parse_rows(sink.kept, plan.output)
        return rows, read_run(plan.output) if rows else None
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error


def _hint(sink: RowSink, report: Report) -> str:
    if not isinstance(sink, ResultFile) or not report.done or not sink.is_there():
        return ""
    return f"; {report.done} rows are kept, continue with --resume"


def _work(
    frames: Sequence[Frame],
    options: EstimateOptions,
    sink: RowSink,
    record: RunRecord | None,
    report: Report,
    stop: Stop,
) -> None:
    """Each frame's row, once its images are written."""
    held = sink.descriptor if isinstance(sink, ResultFile) else None
    with contextlib.closing(_outcomes(frames, options, held, stop)) as outcomes:
        for outcome in outcomes:
            if record is not None:
                record.saw(outcome.encoding, outcome.searched)
            sink.append(outcome.row)
            report.add(outcome)
            if options.result.fail_fast and outcome.row.status == "error":
                report.stopped_early = True
                return
    report.stopped_early = stop.asked and report.done < report.total


def _outcomes(
    frames: Sequence[Frame], options: EstimateOptions, held: int | None, stop: Stop
) -> Generator[Outcome, None, None]:
    """Outcomes in order, from this process, from a pool of processes, or from a cluster."""
    if options.result.scheduler is not None:
        from rollcli.parallel.cluster import cluster_outcomes

        return cluster_outcomes(frames, options.frame, options.result.scheduler, stop)
    work = Work(partial(do, options=options.frame), partial(lost, images=options.images))
    return done_locally(frames, work, options.running.jobs, stop, held)


def _end(record: RunRecord | None, report: Report, stop: Stop, resume_command: str) -> int:
    if not report.stopped_early and record is not None:
        record.write(report.totals)
    report.note(report.summary())
    if stop.asked and report.stopped_early:
        report.say(f"interrupted; continue with: {resume_command}" if record else "interrupted")
        return INTERRUPTED
    return report.status


def _list(plan: Plan, options: EstimateOptions) -> None:
    """Say what would be read and written, a line each."""
    given = options.result
    check_result(plan.output, resume=given.resume, overwrite=options.running.overwrite)
    done = (
        len(parse_rows(kept, plan.output))
        if given.resume and (kept := kept_rows(plan.output, plan.format))
        else 0
    )
    frames = plan.frames[done:]
    list_files((frame.reads(), (path for _, path in image_paths(frame, options.images))) for frame in frames)
    if plan.output != STDOUT:
        list_files([((), (plan.output, str(run_path(plan.output))))])
