"""`rollcli estimate` from options to exit status."""

import contextlib
import os
from dataclasses import replace
from functools import partial
from itertools import chain, islice

from rollcli.errors import ExitStatus, OutputError, WorkerError
from rollcli.files.stores.locations import is_url
from rollcli.run.batch import Step, join_results, work_on, workers_for
from rollcli.run.find import calibration_files, calibration_notes
from rollcli.run.options import EstimateOptions
from rollcli.run.outputs import every_path, list_files
from rollcli.run.plan import Plan, make_plan
from rollcli.run.progress import Progress
from rollcli.run.result import Output, kept_of, open_output
from rollcli.run.workers.interrupt import Stop, stop_on_signals
from rollcli.run.workers.tasks import require_scheduler, run_joined

_NOTES = 3  # on how calibrations were read; the record of the run has those of more files


def run_estimate(options: EstimateOptions, resume_command: str = "") -> ExitStatus:
    """Estimate the roll of every frame.

    Parameters
    ----------
    options : EstimateOptions
    resume_command : str
        What to type to continue this run, for the message when it is interrupted.

    Raises
    ------
    UsageError, OutputError, WorkerError
        The run cannot start or cannot go on.
    """
    plan = make_plan(options)
    if not options.running.dry_run:
        return _run(plan, resume_command)
    frames, writes = chain.from_iterable(step.frames for step in kept_of(plan).steps()), options.writes
    of_frames = ((frame.reads(), every_path(frame, writes)) for frame in frames)
    list_files(chain([(calibration_files(options.calibration), ())], of_frames, [((), plan.files)]))
    return ExitStatus.DONE


def _run(plan: Plan, resume_command: str) -> ExitStatus:
    options = plan.options
    require_scheduler(options.running.scheduler)
    with open_output(plan) as output:
        kept = output.kept
        progress = Progress(len(plan.frames), options, ("ok", "suspect"), kept.summary)
        notes = calibration_notes(plan.frames) if options.calibration.given else []
        for note in (*notes[:_NOTES], *kept.notes()):
            progress.note(note)
        whole = False
        try:
            with stop_on_signals() as stop, progress:
                whole = all(_run_step(step, plan, output, progress, stop) for step in kept.steps())
        except KeyboardInterrupt:  # the second Ctrl-C: without waiting for the frames that have begun
            pass
        except (OutputError, WorkerError) as error:
            raise type(error)(f"{error}{output.hint()}") from error
        if whole:
            output.finish(progress.summary)
        progress.tell_end()
        if stop.asked and not whole:
            how = f"; continue with: {resume_command}" if plan.files else ""
            progress.say(f"interrupted{how}")
            return ExitStatus.INTERRUPTED
        if whole and not options.running.quiet:
            calibrated = (frame.calibration for frame in plan.frames if frame.calibration is not None)
            if note := progress.summary.pose_note(next(calibrated, None), output.record.read_as.downscale):
                progress.say(note)
            progress.say(progress.summary.rig_roll())
        return progress.summary.status


def _run_step(step: Step, plan: Plan, output: Output, progress: Progress, stop: Stop) -> bool:
    """Do the frames of a step, images before rows, and rows in their order; tell whether all are done."""
    options, record = plan.options, output.record
    # whichever folder it is resumed from
    result = plan.output if is_url(plan.output) else os.path.realpath(plan.output)
    retry_of = result if step.retries else ""
    told = replace(
        options.told, replaces=record.replaces, retry_of=retry_of, run=record.run, notes=bool(plan.files)
    )
    rows = output.rows_of(step, told)
    join, unit = partial(join_results, options=rows), options.result.part_rows if rows.output else 1
    work = work_on(step.frames, told, join=join, tell=lambda: record.read_as, unit=unit)
    workers = workers_for(step.frames, options, filter(None, [rows.output]))
    done, following = 0, iter(step.frames)
    try:
        with contextlib.closing(run_joined(step.frames, work, stop, workers)) as batches:
            for batch in batches:
                frames = list(islice(following, len(batch)))
                positions = step.positions[done : done + len(batch)]
                done += len(batch)
                if not positions:
                    output.restore(frames, batch)
                    continue
                record.saw(batch.read_as)  # before their rows are written
                add = output.replace if step.retries else output.append
                add(positions, frames, batch)
                progress.add_rows([frame.file for frame in frames], batch.figures, positions, batch.told)
                if options.result.fail_fast and any(each.row.status == "error" for each in batch.told):
                    return False
    finally:
        output.commit()
    return done == len(step.frames)
