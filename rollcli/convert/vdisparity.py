"""`rollcli vdisparity`: the v-disparity image of each map."""

from functools import partial

from rollcli.convert.options import CountOptions, VDisparityOptions
from rollcli.convert.run import Conversion, convert
from rollcli.frames.find import map_frames
from rollcli.frames.frame import Frame, Outcome
from rollcli.frames.options import EncodingOptions
from rollcli.frames.outputs import output_path


def count_maps(options: VDisparityOptions) -> int:
    """Count the disparities of every map; the exit status."""
    frames = map_frames(options.inputs, skip=[options.output])
    conversions = [Conversion(frame, _writes(frame, options)) for frame in frames]
    do = partial(_count, encoding=options.encoding, count=options.count)
    return convert(conversions, do, options.running, options.encoding)


def _writes(frame: Frame, options: VDisparityOptions) -> tuple[str, ...]:
    picture = output_path(frame, options.output, ".png")
    return (picture, output_path(frame, options.output, ".tif")) if options.count.counts else (picture,)


def _count(conversion: Conversion, encoding: EncodingOptions, count: CountOptions) -> Outcome:
    from rollcli.convert.work import count_map  # where the work is done

    return count_map(conversion, encoding, count)
