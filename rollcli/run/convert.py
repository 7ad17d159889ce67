"""`derotate`, `vdisparity` and `disparity`: what is done with each frame."""

import math
from collections.abc import Iterator, Sequence
from functools import partial

from rollcli.errors import ExitStatus, UsageError
from rollcli.files.matching import match_paths
from rollcli.files.naming import listed
from rollcli.files.results import Row, read_result
from rollcli.messages import say
from rollcli.report.page import require_extra
from rollcli.run.calibration import check_depth, check_first_size
from rollcli.run.conversion import Conversion, convert
from rollcli.run.find import map_frames, pair_frames
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.options import (
    CountOptions,
    DerotateOptions,
    DisparityOptions,
    EncodingOptions,
    FrameOptions,
    MethodOptions,
    RotationOptions,
    RunningOptions,
    VDisparityOptions,
)
from rollcli.run.outputs import ENDING_OF_FORMAT, output_path, roomy_path


def run_derotate(options: DerotateOptions) -> ExitStatus:
    """Rotate every map."""
    rotation, running = options.rotation, options.running
    if (rotation.roll_deg is None) == (rotation.result is None):
        raise UsageError("give either --roll, one angle for all maps, or --from, a result with one for each")
    if rotation.skip_suspect and rotation.result is None:
        raise UsageError("--skip-suspect needs --from: one angle for all maps is not doubted")
    frames = map_frames(options.inputs, skip=[options.output])
    conversions = list(_conversions(frames, options))
    read = FrameOptions(encoding=options.encoding, root=running.root, replaces=running.overwrite)
    do = partial(_derotate, options=read, expand=rotation.expand)
    return convert(conversions, do, options.output, running, options.encoding)


def _conversions(frames: Sequence[Frame], options: DerotateOptions) -> Iterator[Conversion]:
    rotation = options.rotation
    rows: Sequence[Row | None] = [None] * len(frames)
    if rotation.result is not None:
        rows = found = rows_of(frames, rotation.result)
        _tell_suspects(found, rotation, options.running)
    for frame, row in zip(frames, rows, strict=True):
        if row is not None and row.status == "suspect" and rotation.skip_suspect:
            continue
        roll_deg = rotation.roll_deg if row is None else row.roll_deg
        refused = "" if roll_deg is not None else f"has no angle in {rotation.result}"
        writes = (output_path(frame, options.output),)
        yield Conversion(frame, writes, math.radians(roll_deg or 0.0), refused, keeps_numbers=True)


def _tell_suspects(rows: Sequence[Row], rotation: RotationOptions, running: RunningOptions) -> None:
    """Say how many angles are suspect, and whether they are used.

    Raises
    ------
    UsageError
        They are left out, and there are no others.
    """
    suspects = sum(row.status == "suspect" for row in rows)
    if rotation.skip_suspect and suspects == len(rows):
        raise UsageError(f"{rotation.result}: every angle is suspect: --skip-suspect leaves out all maps")
    if not suspects or running.quiet:
        return
    of = f"{rotation.result}: {suspects} of {len(rows)} angles {'is' if suspects == 1 else 'are'} suspect"
    if rotation.skip_suspect:
        say(f"{of}; such maps are left out")
    else:
        say(f"{of} and used; --skip-suspect leaves such maps out")


def rows_of(frames: Sequence[Frame], result: str, *, every_row: bool = True) -> list[Row]:
    """Find the row of each frame.

    Raises
    ------
    UsageError
        Names maps without a row, with `every_row` rows that have an angle but no map, and what matches more
        than one.
    """
    rows = read_result(result).rows
    found = match_paths([frame.file for frame in frames], [row.file for row in rows], result)
    alone = [frame.file for frame, at in zip(frames, found, strict=True) if at is None]
    if alone:
        raise UsageError(f"{result}: has no row for {listed(alone)}")
    used = [at for at in found if at is not None]
    lost = [rows[at] for at in sorted(set(range(len(rows))).difference(used))]
    if every_row and any(row.roll_deg is not None for row in lost):
        names = listed(row.file for row in lost if row.roll_deg is not None)
        raise UsageError(f"{result}: no map is given for its rows of {names}")
    return [rows[at] for at in used]


def _derotate(conversion: Conversion, options: FrameOptions, expand: bool) -> FrameResult:
    from rollcli.run.convert_frame import derotate_map  # loads NumPy: only on a worker

    return derotate_map(conversion, options, expand)


def run_disparity(options: DisparityOptions) -> ExitStatus:
    """Match every pair."""
    frames = pair_frames(
        options.inputs, options.pairs, skip=[*filter(None, [options.output, options.preview])]
    )
    conversions = [Conversion(frame, _disparity_writes(frame, options)) for frame in frames]
    read = FrameOptions(
        stereo=options.stereo,
        method=MethodOptions(road="all"),  # every row is wanted at full size
        root=options.running.root,
        replaces=options.running.overwrite,
    )
    do = partial(_match, options=read, save_as=options.save_as, preview=options.preview is not None)
    return convert(conversions, do, options.output, options.running, EncodingOptions())


def _disparity_writes(frame: Frame, options: DisparityOptions) -> tuple[str, ...]:
    """List the map, the TIFF in place of a PNG that cannot hold it, and last the preview."""
    path = output_path(frame, options.output, ENDING_OF_FORMAT[options.save_as])
    roomy = (roomy_path(path),) if options.save_as == "png" else ()
    preview = () if options.preview is None else (output_path(frame, options.preview, ".png"),)
    return (path, *roomy, *preview)


def _match(conversion: Conversion, options: FrameOptions, save_as: str, preview: bool) -> FrameResult:
    from rollcli.run.convert_frame import match_frame  # loads NumPy: only on a worker

    return match_frame(conversion, options, save_as, preview=preview)


def run_vdisparity(options: VDisparityOptions) -> ExitStatus:
    """Count the disparities of every map, row by row, and draw them."""
    running, count = options.running, options.count
    if count.figure is not None:
        require_extra("--figure")
        if count.counts:
            raise UsageError("--counts goes with the picture: give it without --figure")
    elif count.result is not None:
        raise UsageError("--from is for --figure: a picture shows the map as it is")
    frames = map_frames(options.inputs, calibration=options.calibration, skip=[options.output])
    check_depth(frames, options.encoding)
    conversions = list(_vdisparity_conversions(frames, options))
    read = FrameOptions(encoding=options.encoding, root=running.root, replaces=running.overwrite)
    check_first_size(frames, read)
    do = partial(_count, options=read, count=count)
    return convert(conversions, do, options.output, running, options.encoding)


def _vdisparity_conversions(frames: Sequence[Frame], options: VDisparityOptions) -> Iterator[Conversion]:
    result = options.count.result
    if result is None:
        yield from (Conversion(frame, _vdisparity_writes(frame, options)) for frame in frames)
        return
    for frame, row in zip(frames, rows_of(frames, result, every_row=False), strict=True):
        refused = "" if row.roll_deg is not None else f"has no angle in {result}"
        coefficients = [each for each in (row.alpha0, row.alpha1, row.alpha2) if each is not None]
        alpha = (coefficients[0], coefficients[1], coefficients[2]) if len(coefficients) == 3 else None
        roll = math.radians(row.roll_deg or 0.0)
        yield Conversion(frame, _vdisparity_writes(frame, options), roll, refused, alpha=alpha)


def _vdisparity_writes(frame: Frame, options: VDisparityOptions) -> tuple[str, ...]:
    if options.count.figure is not None:
        return (output_path(frame, options.output, f".{options.count.figure}"),)
    picture = output_path(frame, options.output, ".png")
    return (picture, output_path(frame, options.output, ".tif")) if options.count.counts else (picture,)


def _count(conversion: Conversion, options: FrameOptions, count: CountOptions) -> FrameResult:
    from rollcli.run.convert_frame import count_map, draw_figure  # loads NumPy: only on a worker

    if count.figure is not None:
        return draw_figure(conversion, options, count)
    return count_map(conversion, options, count)
