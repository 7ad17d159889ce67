"""Write how high each map's pixels lie over the road that a result has for it."""

from collections.abc import Iterator, Sequence
from functools import partial

from rollcli.errors import ExitStatus
from rollcli.files.results import Row
from rollcli.messages import say
from rollcli.run.calibration import check_depth, check_first_size
from rollcli.run.conversion import Conversion, convert
from rollcli.run.find import map_frames
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.image_kinds import ENDING_OF_FORMAT
from rollcli.run.options import FrameOptions, HeightsOptions, ImageOptions
from rollcli.run.outputs import output_path
from rollcli.run.result_rows import rows_of


def run_heights(options: HeightsOptions) -> ExitStatus:
    """Write the heights of every map."""
    running, skip = options.running, [*filter(None, [options.output, options.preview])]
    frames = map_frames(options.inputs, calibration=options.calibration, skip=skip, quiet=running.quiet)
    check_depth(frames, options.encoding)
    rows = rows_of(frames, options.result, skip_suspect=options.skip_suspect, quiet=running.quiet)
    _tell_unit(frames, rows, options)
    conversions = list(_conversions(frames, rows, options))
    read = FrameOptions(
        encoding=options.encoding,
        images=ImageOptions(heights_range=options.heights_range, save_as=options.save_as),
        root=running.root,
        replaces=running.overwrite,
    )
    for note in check_first_size(frames, read):
        say(note)
    do = partial(_heights, options=read, result=options.result)
    return convert(conversions, do, options.output, running, options.encoding)


def _conversions(
    frames: Sequence[Frame], rows: Sequence[Row], options: HeightsOptions
) -> Iterator[Conversion]:
    for frame, row in zip(frames, rows, strict=True):
        if row.status == "suspect" and options.skip_suspect:
            continue
        writes = [output_path(frame, options.output, ENDING_OF_FORMAT[options.save_as])]
        if options.preview is not None:
            writes.append(output_path(frame, options.preview, ENDING_OF_FORMAT["png"]))
        refused = "" if row.roll_deg is not None else f"has no angle in {options.result}"
        yield Conversion(frame, tuple(writes), refused=refused, row=row)


def _tell_unit(frames: Sequence[Frame], rows: Sequence[Row], options: HeightsOptions) -> None:
    """Say that heights are not in metres where they could be."""
    known = any(row.height_m is not None for row in rows)
    if known and not options.running.quiet and any(frame.calibration is None for frame in frames):
        say(
            f"{options.result}: was made with a calibration: give it with --calib to have heights in metres, "
            "not camera heights"
        )


def _heights(conversion: Conversion, options: FrameOptions, result: str) -> FrameResult:
    from rollcli.run.convert_frame import heights_of_map  # loads NumPy: only on a worker

    return heights_of_map(conversion, options, result)
