"""`derotate`, `vdisparity`, `heights` and `disparity`: each frame becomes files of its own."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial

from rollcli.errors import ExitStatus, UsageError
from rollcli.extras import require_extra
from rollcli.files.atomic import remove_leftovers
from rollcli.files.results import Row
from rollcli.messages import say
from rollcli.run import outputs
from rollcli.run.find import Named, check_depth, check_first_size, map_frames, pair_frames
from rollcli.run.frame import Frame, FrameResult, failed_frame
from rollcli.run.options import (
    ConvertOptions,
    DerotateOptions,
    DisparityOptions,
    FrameOptions,
    HeightsOptions,
    InputOptions,
    VDisparityOptions,
)
from rollcli.run.plan import decoder_for, workers_for
from rollcli.run.progress import Progress
from rollcli.run.result_rows import rows_of
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import require_scheduler, run_tasks


def run_conversion(options: ConvertOptions) -> ExitStatus:
    """Make the files of every frame.

    Raises
    ------
    UsageError, OutputError, WorkerError
        The run cannot start or cannot go on.
    """
    running = options.running
    frames = _plan(options)
    if running.dry_run:
        outputs.list_files((each.reads(), outputs.paths_of(each, options)) for each in frames)
        return ExitStatus.DONE
    require_scheduler(running.scheduler)
    progress = Progress(len(frames), running, options.encoding, statuses=("ok",))
    told = replace(options, inputs=InputOptions())  # which may be long
    work = Work(
        partial(_convert, options=told, read=options.frame),  # made here, where relative paths start
        partial(_lost, options=told),
        partial(_remove_leftovers, options=told),
        prepare=decoder_for(frames, options.frame),
    )
    work.clear(frames)
    workers = workers_for(frames, running, [options.output])
    with stop_on_signals() as stop, progress, closing(run_tasks(frames, work, stop, workers)) as results:
        for result in results:
            progress.add(result)
    progress.tell_end()
    if stop.asked and progress.done < progress.total:
        progress.say("interrupted; what is written is whole, and --overwrite starts anew")
        return ExitStatus.INTERRUPTED
    return progress.summary.status


def _plan(options: ConvertOptions) -> list[Frame]:
    """Find the frames, give each its row, and check what would be read and written."""
    _check_options(options)
    frames = _find_frames(options)
    rows = _find_rows(frames, options)
    say(*check_first_size(frames, options.frame)[0])
    wanted = [
        replace(frame, row=row)
        for frame, row in zip(frames, rows, strict=True)
        if row is None or row.status != "suspect" or not options.skip_suspect
    ]
    outputs.check_one_owner((each, outputs.paths_of(each, options)) for each in wanted)
    outputs.check_places(wanted, [options.output])
    outputs.check_writes(
        [path for each in wanted for path in each.reads()],
        [path for each in wanted for path in outputs.paths_of(each, options)],
        overwrite=options.running.overwrite,
    )
    return wanted


def _check_options(options: ConvertOptions) -> None:
    if isinstance(options, DerotateOptions):
        if (options.roll_deg is None) == (options.result is None):
            raise UsageError(
                "give either --roll, one angle for all maps, or --from, a result with one for each"
            )
        if options.skip_suspect and options.result is None:
            raise UsageError("--skip-suspect needs --from: one angle for all maps is not doubted")
    if isinstance(options, VDisparityOptions):
        if options.figure is not None:
            require_extra("report", "--figure")
            if options.counts:
                raise UsageError("--counts goes with the picture: give it without --figure")
        elif options.result is not None:
            raise UsageError("--from is for --figure: a picture shows the map as it is")


def _find_frames(options: ConvertOptions) -> Sequence[Frame]:
    skip, quiet = [folder for folder, _ in options.writes], options.running.quiet
    named = Named(options.inputs, quiet, calibration=options.calibration, skip=skip)
    if isinstance(options, DisparityOptions):
        return pair_frames(named._replace(pairs=options.pairs, topics=options.topics))
    frames = map_frames(named)
    if not isinstance(options, DerotateOptions):
        check_depth(frames, options.encoding)
    return frames


def _find_rows(frames: Sequence[Frame], options: ConvertOptions) -> Sequence[Row | None]:
    if options.result is None:
        return [None] * len(frames)
    quiet, skip_suspect = options.running.quiet, options.skip_suspect
    every_row = not isinstance(options, VDisparityOptions)
    rows = rows_of(frames, options.result, quiet=quiet, skip_suspect=skip_suspect, every_row=every_row)
    metric = isinstance(options, HeightsOptions) and any(row.height_m is not None for row in rows)
    if metric and not quiet and any(frame.calibration is None for frame in frames):
        say(
            f"{options.result}: was made with a calibration: give it with --calib to have heights in metres, "
            "not camera heights"
        )
    return rows


def _remove_leftovers(frames: Iterable[Frame], options: ConvertOptions) -> None:
    remove_leftovers(path for frame in frames for path in outputs.paths_of(frame, options))


def _convert(frame: Frame, options: ConvertOptions, read: FrameOptions) -> FrameResult:
    from rollcli.run.images import convert_frame  # loads NumPy: only on a worker

    return convert_frame(frame, options, read)


def _lost(frame: Frame, reason: str, options: ConvertOptions) -> FrameResult:
    outputs.write_outputs({}, outputs.paths_of(frame, options), replaces=options.running.overwrite)
    return failed_frame(frame, reason)
