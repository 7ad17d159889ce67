"""What a worker does with one frame: read, compute, write."""

from collections.abc import Callable

import numpy as np

from rollcli.convert.options import CountOptions
from rollcli.convert.run import Conversion
from rollcli.errors import EstimationError, InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.files.atomic import write_atomic
from rollcli.files.codecs.png import encode_png
from rollcli.files.formats import encode_stored
from rollcli.files.results import Row
from rollcli.frames.encode import encode_computed, encode_turned
from rollcli.frames.frame import Outcome
from rollcli.frames.guard import guarded
from rollcli.frames.options import EncodingOptions, FrameOptions
from rollcli.frames.outputs import remove_outputs
from rollcli.frames.read import Source, read_source
from rollcli.imaging.stereo_options import StereoOptions
from rollcli.imaging.vdisparity import profile, v_disparity
from rollcli.imaging.vdisparity_picture import draw_v_disparity


def derotate_map(conversion: Conversion, encoding: EncodingOptions, expand: bool) -> Outcome:
    """Write the map, rotated."""

    def make(source: Source) -> list[bytes]:
        assert source.stored is not None  # a map, not a pair
        given = encoding.invalid
        return [encode_turned(source.stored, conversion.roll, source.encoding, given, expand=expand)]

    return _done(conversion, FrameOptions(encoding=encoding), make)


def count_map(conversion: Conversion, encoding: EncodingOptions, count: CountOptions) -> Outcome:
    """Write the picture of the map's v-disparity, and the counts if that was asked for."""

    def make(source: Source) -> list[bytes]:
        histogram = v_disparity(source.disparity, bins=count.bins, max_disparity=count.max_disparity)
        picture = encode_png(draw_v_disparity(histogram, _road(source)))
        return [picture, encode_stored(histogram.counts, "tiff")] if count.counts else [picture]

    return _done(conversion, FrameOptions(encoding=encoding), make)


def match_frame(conversion: Conversion, stereo: StereoOptions, save_as: str) -> Outcome:
    """Write the disparity map of the pair."""

    def make(source: Source) -> list[bytes]:
        if not np.any(source.disparity):
            raise InputError(f"{conversion.frame.file}: no pixel could be matched with the right image")
        return [encode_computed(source.disparity, save_as)]

    return _done(conversion, FrameOptions(stereo=stereo), make)


def _done(conversion: Conversion, options: FrameOptions, make: Callable[[Source], list[bytes]]) -> Outcome:
    """Read the frame, write what is made of it, each file whole or not at all."""
    frame = conversion.frame

    def work() -> Outcome:
        if conversion.refused:
            raise InputError(f"{frame.file}: {conversion.refused}")
        source = read_source(frame, options)
        for path, data in zip(conversion.writes, make(source), strict=True):
            write_atomic(path, data)
        row = Row(frame.file, frame.right_file, "ok")
        return Outcome(row, source.encoding, source.warning or source.doubt or source.note, source.searched)

    outcome = guarded(frame, work)
    if outcome.row.status == "error":
        remove_outputs(conversion.writes)  # an older file would pass for this run's
    return outcome


def _road(source: Source) -> tuple[float, float, float] | None:
    """The road's disparity as a parabola of the row, if there is a road to be sure of."""
    try:
        estimate = estimate_roll(source.disparity)
    except EstimationError:
        return None
    return profile(estimate.alpha, estimate.theta, estimate.width) if estimate.status == "ok" else None
