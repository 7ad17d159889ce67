"""`rollcli disparity`: the disparity map of each stereo pair."""

from functools import partial

from rollcli.convert.options import DisparityOptions
from rollcli.convert.run import Conversion, convert
from rollcli.frames.find import pair_frames
from rollcli.frames.frame import Outcome
from rollcli.frames.options import EncodingOptions
from rollcli.frames.outputs import MAP_ENDINGS, output_path
from rollcli.imaging.stereo_options import StereoOptions


def match_pairs(options: DisparityOptions) -> int:
    """Match every pair; the exit status."""
    frames = pair_frames(options.inputs, options.pairs, skip=[options.output])
    ending = MAP_ENDINGS[options.save_as]
    conversions = [Conversion(frame, (output_path(frame, options.output, ending),)) for frame in frames]
    do = partial(_match, stereo=options.stereo, save_as=options.save_as)
    return convert(conversions, do, options.running, EncodingOptions())


def _match(conversion: Conversion, stereo: StereoOptions, save_as: str) -> Outcome:
    from rollcli.convert.work import match_frame  # where the work is done

    return match_frame(conversion, stereo, save_as)
