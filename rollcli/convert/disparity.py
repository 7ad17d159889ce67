"""Compute the disparity map of each stereo pair."""

from functools import partial

from rollcli.convert.options import DisparityOptions
from rollcli.convert.run import Conversion, convert
from rollcli.errors import ExitStatus
from rollcli.frames.find import pair_frames
from rollcli.frames.frame import Frame, FrameResult
from rollcli.frames.options import EncodingOptions, FrameOptions, MethodOptions
from rollcli.frames.outputs import ENDING_OF_FORMAT, output_path, roomy_path


def run_disparity(options: DisparityOptions) -> ExitStatus:
    """Match every pair."""
    frames = pair_frames(
        options.inputs, options.pairs, skip=[*filter(None, [options.output, options.preview])]
    )
    conversions = [Conversion(frame, _writes(frame, options)) for frame in frames]
    read = FrameOptions(
        stereo=options.stereo,
        method=MethodOptions(road="all"),  # every row is wanted at full size
        root=options.running.root,
        replaces=options.running.overwrite,
    )
    do = partial(_match, options=read, save_as=options.save_as, preview=options.preview is not None)
    return convert(conversions, do, options.output, options.running, EncodingOptions())


def _writes(frame: Frame, options: DisparityOptions) -> tuple[str, ...]:
    """List the map, the TIFF in place of a PNG that cannot hold it, and last the preview."""
    path = output_path(frame, options.output, ENDING_OF_FORMAT[options.save_as])
    roomy = (roomy_path(path),) if options.save_as == "png" else ()
    preview = () if options.preview is None else (output_path(frame, options.preview, ".png"),)
    return (path, *roomy, *preview)


def _match(conversion: Conversion, options: FrameOptions, save_as: str, preview: bool) -> FrameResult:
    from rollcli.convert.work import match_frame  # loads NumPy: only on a worker

    return match_frame(conversion, options, save_as, preview=preview)
