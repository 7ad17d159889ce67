"""Options without effect on a conversion."""

from collections.abc import Iterator

from rollcli.convert.options import DerotateOptions, DisparityOptions, VDisparityOptions
from rollcli.frames.idle import Idle, idle_folders, idle_running, idle_stereo
from rollcli.frames.options import PairOptions


def idle_in_disparity(options: DisparityOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `disparity`."""
    yield from idle_stereo(options.stereo)
    yield from idle_folders(options.inputs, options.pairs)
    yield from idle_running(options.running)


def idle_in_derotate(options: DerotateOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `derotate`."""
    yield Idle(("scale",), "rotated maps keep their stored numbers")
    if options.encoding.encoding != "cityscapes":  # where a stored 1 is no data
        yield Idle(("encoding",), "rotated maps keep their stored numbers")
    yield from idle_folders(options.inputs, PairOptions())
    yield from idle_running(options.running)


def idle_in_vdisparity(options: VDisparityOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `vdisparity`."""
    if options.encoding.encoding != "depth":
        yield Idle(("baseline",), "the horizon does not depend on it; only --encoding depth needs it")
    yield from idle_folders(options.inputs, PairOptions())
    yield from idle_running(options.running)
