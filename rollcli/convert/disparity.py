"""Compute the disparity map of each stereo pair."""

from functools import partial

from rollcli.convert.options import DisparityOptions
from rollcli.convert.run import Conversion, convert
from rollcli.errors import ExitStatus
from rollcli.frames.find import pair_frames
from rollcli.frames.frame import FrameResult
from rollcli.frames.options import EncodingOptions, FrameOptions
from rollcli.frames.outputs import ENDING_OF_FORMAT, output_path


def run_disparity(options: DisparityOptions) -> ExitStatus:
    """Match every pair."""
    frames = pair_frames(options.inputs, options.pairs, skip=[options.output])
    ending = ENDING_OF_FORMAT[options.save_as]
    conversions = [Conversion(frame, (output_path(frame, options.output, ending),)) for frame in frames]
    read = FrameOptions(stereo=options.stereo, root=options.running.root)
    do = partial(_match, options=read, save_as=options.save_as)
    return convert(conversions, do, options.output, options.running, EncodingOptions())


def _match(conversion: Conversion, options: FrameOptions, save_as: str) -> FrameResult:
    from rollcli.convert.work import match_frame  # loads NumPy: only on a worker

    return match_frame(conversion, options, save_as)
