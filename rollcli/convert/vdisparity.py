"""Draw the v-disparity image of each map."""

from functools import partial

from rollcli.convert.options import CountOptions, VDisparityOptions
from rollcli.convert.run import Conversion, convert
from rollcli.errors import ExitStatus
from rollcli.frames.calibration import check_depth, check_first_size
from rollcli.frames.find import map_frames
from rollcli.frames.frame import Frame, FrameResult
from rollcli.frames.options import FrameOptions
from rollcli.frames.outputs import output_path


def run_vdisparity(options: VDisparityOptions) -> ExitStatus:
    """Count the disparities of every map, row by row, and draw them."""
    running = options.running
    frames = map_frames(options.inputs, calibration=options.calibration, skip=[options.output])
    check_depth(frames, options.encoding)
    conversions = [Conversion(frame, _writes(frame, options)) for frame in frames]
    read = FrameOptions(encoding=options.encoding, root=running.root, replaces=running.overwrite)
    check_first_size(frames, read)
    do = partial(_count, options=read, count=options.count)
    return convert(conversions, do, options.output, running, options.encoding)


def _writes(frame: Frame, options: VDisparityOptions) -> tuple[str, ...]:
    picture = output_path(frame, options.output, ".png")
    return (picture, output_path(frame, options.output, ".tif")) if options.count.counts else (picture,)


def _count(conversion: Conversion, options: FrameOptions, count: CountOptions) -> FrameResult:
    from rollcli.convert.work import count_map  # loads NumPy: only on a worker

    return count_map(conversion, options, count)
