"""`derotate`, `vdisparity` and `disparity`: what is done with each frame."""

import math
from collections.abc import Iterator, Sequence
from functools import partial

from rollcli.errors import ExitStatus, UsageError
from rollcli.extras import require_extra
from rollcli.files.results import Row
from rollcli.run.calibration import check_depth, check_first_size
from rollcli.run.conversion import Conversion, convert
from rollcli.run.find import map_frames, pair_frames
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.image_kinds import ENDING_OF_FORMAT
from rollcli.run.options import (
    CountOptions,
    DerotateOptions,
    DisparityOptions,
    EncodingOptions,
    FrameOptions,
    ImageOptions,
    VDisparityOptions,
)
from rollcli.run.outputs import output_path, roomy_path
from rollcli.run.result_rows import rows_of


def run_derotate(options: DerotateOptions) -> ExitStatus:
    """Rotate every map."""
    rotation, running = options.rotation, options.running
    if (rotation.roll_deg is None) == (rotation.result is None):
        raise UsageError("give either --roll, one angle for all maps, or --from, a result with one for each")
    if rotation.skip_suspect and rotation.result is None:
        raise UsageError("--skip-suspect needs --from: one angle for all maps is not doubted")
    frames = map_frames(options.inputs, skip=[options.output], quiet=running.quiet)
    conversions = list(_conversions(frames, options))
    read = FrameOptions(encoding=options.encoding, root=running.root, replaces=running.overwrite)
    do = partial(_derotate, options=read, expand=rotation.expand)
    return convert(conversions, do, options.output, running, options.encoding)


def _conversions(frames: Sequence[Frame], options: DerotateOptions) -> Iterator[Conversion]:
    rotation = options.rotation
    rows: Sequence[Row | None] = [None] * len(frames)
    if rotation.result is not None:
        quiet = options.running.quiet
        rows = rows_of(frames, rotation.result, skip_suspect=rotation.skip_suspect, quiet=quiet)
    for frame, row in zip(frames, rows, strict=True):
        if row is not None and row.status == "suspect" and rotation.skip_suspect:
            continue
        roll_deg = rotation.roll_deg if row is None else row.map_roll_deg
        refused = "" if roll_deg is not None else f"has no angle in {rotation.result}"
        matrix = (output_path(frame, options.output, ".txt"),) if rotation.save_matrix else ()
        writes = (output_path(frame, options.output), *matrix)
        roll = math.radians(roll_deg or 0.0)
        yield Conversion(frame, writes, roll, refused=refused, keeps_numbers=True)


def _derotate(conversion: Conversion, options: FrameOptions, expand: bool) -> FrameResult:
    from rollcli.run.convert_frame import derotate_map  # loads NumPy: only on a worker

    return derotate_map(conversion, options, expand)


def run_disparity(options: DisparityOptions) -> ExitStatus:
    """Match every pair."""
    frames = pair_frames(
        options.inputs,
        options.pairs,
        options.topics,
        skip=[*filter(None, [options.output, options.preview])],
        quiet=options.running.quiet,
    )
    conversions = [Conversion(frame, _disparity_writes(frame, options)) for frame in frames]
    read = FrameOptions(
        stereo=options.stereo,
        images=ImageOptions(disparity=options.output),  # levelled as the estimate does, then every row
        root=options.running.root,
        replaces=options.running.overwrite,
        side_by_side=options.pairs.side_by_side,
    )
    check_first_size(frames, read)
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
        require_extra("report", "--figure")
        if count.counts:
            raise UsageError("--counts goes with the picture: give it without --figure")
    elif count.result is not None:
        raise UsageError("--from is for --figure: a picture shows the map as it is")
    frames = map_frames(
        options.inputs, calibration=options.calibration, skip=[options.output], quiet=running.quiet
    )
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
    rows = rows_of(frames, result, quiet=options.running.quiet, every_row=False)
    for frame, row in zip(frames, rows, strict=True):
        refused = "" if row.roll_deg is not None else f"has no angle in {result}"
        yield Conversion(frame, _vdisparity_writes(frame, options), row=row, refused=refused)


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
