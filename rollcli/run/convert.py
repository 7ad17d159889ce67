"""`derotate`, `vdisparity`, `heights` and `disparity`: each frame becomes files of its own."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

from rollcli.errors import ExitStatus, UsageError
from rollcli.extras import require_extra
from rollcli.files.results import Row
from rollcli.messages import say
from rollcli.run import outputs
from rollcli.run.find import check_depth, check_first_size, find_frames
from rollcli.run.frame import Frame
from rollcli.run.frame_work import work_on, workers_for
from rollcli.run.options import ConvertOptions, DerotateOptions, HeightsOptions, VDisparityOptions
from rollcli.run.progress import Progress
from rollcli.run.result_rows import rows_of
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
        outputs.list_files((each.reads(), outputs.every_path(each, options.writes)) for each in frames)
        return ExitStatus.DONE
    require_scheduler(running.scheduler)
    progress = Progress(len(frames), running, options.encoding, statuses=("ok",))
    work, workers = work_on(frames, options.frame), workers_for(frames, options)
    work.clear(frames)
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
    frames = find_frames(options)
    if not (options.paired or isinstance(options, DerotateOptions)):
        check_depth(frames, options.encoding)
    rows = _find_rows(frames, options)
    say(*check_first_size(frames, options.frame)[0])
    wanted = [
        replace(frame, row=row)
        for frame, row in zip(frames, rows, strict=True)
        if row is None or row.status != "suspect" or not options.skip_suspect
    ]
    outputs.check_one_owner(wanted, options.writes)
    outputs.check_places(wanted, options.folders)
    outputs.check_writes(
        [path for each in wanted for path in each.reads()],
        list(outputs.files_of(wanted, options.writes)),
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
