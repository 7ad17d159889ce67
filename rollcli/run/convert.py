"""`derotate`, `vdisparity`, `heights` and `disparity`: each frame becomes files of its own.

Where they are given a result, each map has its row there.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from itertools import chain

from rollcli.errors import ExitStatus, RollcliError, UsageError
from rollcli.extras import require_extra
from rollcli.files.inputs import is_elsewhere, match_paths
from rollcli.files.results import Row, read_result, run_path
from rollcli.messages import counted, listed
from rollcli.run import outputs
from rollcli.run.batch import work_on, workers_for
from rollcli.run.find import calibration_files, check_depth, check_first_size, find_frames, mask_finder
from rollcli.run.frame import Frame, located_beside
from rollcli.run.options import (
    ConvertOptions,
    DerotateOptions,
    FramesOptions,
    HeightsOptions,
    VDisparityOptions,
)
from rollcli.run.progress import Progress
from rollcli.run.resume import recorded_calibrations, recorded_options
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import require_scheduler, run_tasks

_COMPARED = 3  # maps in other folders than their rows': the first, the last and one between
_SAME_DEG = 1e-4  # a result holds angles to a millionth of a degree


def run_conversion(options: ConvertOptions) -> ExitStatus:
    """Make the files of every frame.

    Raises
    ------
    UsageError, OutputError, WorkerError
        The run cannot start or cannot go on.
    """
    running = options.running
    frames = _plan(options)
    written = partial(outputs.every_path, writes=options.writes)
    given = [([*filter(None, [options.result]), *calibration_files(options.calibration)], ())]
    if outputs.listed_only(lambda: chain(given, ((each.reads(), written(each)) for each in frames)), running):
        return ExitStatus.DONE
    require_scheduler(running.scheduler)
    progress = Progress(len(frames), options, statuses=("ok",))
    work, workers = work_on(frames, options.told), workers_for(frames, options)
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
    """Find the frames, give each its row, and check what can be checked before they run."""
    _check_options(options)
    frames = find_frames(options)
    if options.calibrates:
        check_depth(frames, options)
    rows = _find_rows(frames, options)
    check_first_size(frames, options)
    wanted = [
        frame._replace(row=row)
        for frame, row in zip(frames, rows, strict=True)
        if row is None or row.status != "suspect" or not options.skip_suspect
    ]
    outputs.check_one_owner(wanted, options.writes)
    outputs.check_places(wanted, options.folders)
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
    rows = _rows_of(frames, options.result, options)
    posed = (frame for frame, row in zip(frames, rows, strict=True) if row.pitch_deg is not None)
    lacks = any(frame.calibration is None and not frame.damaged for frame in posed)
    if isinstance(options, HeightsOptions) and lacks:
        options.running.note(
            f"{options.result}: was made with a calibration: give it with --calib; without it heights are in "
            "camera heights, and off with a doffs, or where camber meets a principal point beside the middle"
        )
    return rows


def _rows_of(frames: Sequence[Frame], result: str, options: ConvertOptions) -> list[Row]:
    """Find the row of each frame, and say how many angles are suspect, and whether they are used.

    Frames and rows are compared by path as far as they agree. Where folders differ, names do not tell a copy
    from another drive: some of these maps are estimated again, and have to give the angles of their rows.

    Raises
    ------
    UsageError
        Names maps without a row, rows that have an angle but no map where all maps are to be converted, and
        what matches more than one; a row is of another drive; or every angle is suspect, and such are left
        out.
    """
    read = read_result(result)
    rows = read.rows
    found = match_paths([frame.file for frame in frames], [row.file for row in rows], result)
    alone = [frame.file for frame, at in zip(frames, found, strict=True) if at is None]
    if alone:
        raise UsageError(f"{result}: has no row for {listed(alone)}")
    used = [at for at in found if at is not None]
    lost = [rows[at] for at in sorted(set(range(len(rows))).difference(used))]
    angled = [row.file for row in lost if row.roll_deg is not None]
    if angled and not isinstance(options, VDisparityOptions):
        remedy = "give all of its maps, or a result of these alone"
        raise UsageError(f"{result}: no map is given for its rows of {listed(angled)}: {remedy}")
    matched = [rows[at] for at in used]
    elsewhere = [
        (frame, row)
        for frame, row in zip(frames, matched, strict=True)
        if row.roll_deg is not None and is_elsewhere(frame.file, row.file, of_pair=bool(row.right_file))
    ]
    if elsewhere:
        recorded = recorded_options(read.run, run_path(result))
        mask_of = _masks_of(recorded, result)
        cameras = (*recorded_calibrations(read.run), None)
        # a suspect angle of a pair need not be that of its map
        elsewhere = [each for each in elsewhere if each[1].status == "ok"] or elsewhere
        for at in {round(i * (len(elsewhere) - 1) / (_COMPARED - 1)): None for i in range(_COMPARED)}:
            frame, row = elsewhere[at]
            frame = frame._replace(mask=mask_of(row.file))
            if not any(_is_copy(frame._replace(calibration=each), row, recorded) for each in cameras):
                differ = f"its row is of {row.file}, and not of {frame.file}"
                raise UsageError(f"{result}: {differ}: give the result of these maps")
    _tell_suspects(matched, options)
    return matched


def _masks_of(recorded: FramesOptions, result: str) -> Callable[[str], str | None]:
    """Find the masks of a result's run, without which its maps have other angles."""
    mask = recorded.region.mask
    try:
        return mask_finder(mask and located_beside(mask, result))
    except UsageError as error:
        raise UsageError(f"{result}: its maps are known by the mask that they had: {error}") from error


def _is_copy(frame: Frame, row: Row, options: FramesOptions) -> bool:
    """Tell whether a map gives the angle of a row."""
    from rollcli.estimator.estimate import estimate_roll
    from rollcli.run.read import read_source

    try:
        source = read_source(frame, options)
        request = options.method.request(calibration=source.calibrated(frame.calibration))
        found = estimate_roll(source.disparity, request, mask=source.allowed)
    except (OSError, RollcliError):
        return False
    # of a pair the row is of the road matched along its plane, the map of all that was matched; with a
    # calibration the row is of the lane below the principal point, and not each of many is recorded
    other = row.right_file or row.pitch_deg is not None
    most = max(_SAME_DEG, row.roll_ci95_deg or 0.0) if other else _SAME_DEG
    return abs(math.degrees(found.theta) - (row.map_roll_deg or 0.0)) < most


def _tell_suspects(rows: Sequence[Row], options: ConvertOptions) -> None:
    suspects, skips = sum(row.status == "suspect" for row in rows), options.skip_suspect
    if skips and suspects == len(rows):
        raise UsageError(f"{options.result}: every angle is suspect: --skip-suspect leaves out all maps")
    if suspects:
        of, are = counted(len(rows), "angle"), "is" if suspects == 1 else "are"
        remedy = "" if isinstance(options, VDisparityOptions) else "; --skip-suspect leaves such maps out"
        done = "; such maps are left out" if skips else f" and used{remedy}"
        options.running.note(f"{options.result}: {suspects:,} of {of} {are} suspect{done}")
