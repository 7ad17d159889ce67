"""Convert one frame, on a worker: read, compute, write."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rollcli.errors import EstimationError, InputError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.files.codecs.png import encode_png
from rollcli.files.formats import encode_stored
from rollcli.files.results import Row
from rollcli.pictures.derotate import rotation_matrix
from rollcli.pictures.heights import FittedRoad, heights_over, unit_of
from rollcli.pictures.overlay import draw_preview
from rollcli.pictures.vdisparity import draw_v_disparity, middle_row, profile, v_disparity
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import horizon_row
from rollcli.run.conversion import Conversion
from rollcli.run.diagnosis import looks_like
from rollcli.run.frame import FrameResult
from rollcli.run.frame_errors import guarded
from rollcli.run.images import (
    TOO_LARGE_FOR_PNG,
    encode_computed,
    encode_heights,
    encode_heights_preview,
    encode_turned,
)
from rollcli.run.options import CountOptions, FrameOptions
from rollcli.run.outputs import write_outputs
from rollcli.run.read import Source, read_source


def derotate_map(conversion: Conversion, options: FrameOptions, expand: bool) -> FrameResult:
    """Write the rotated map."""

    def make(source: Source) -> dict[str, bytes]:
        assert source.stored is not None  # a map, not a pair
        given = options.encoding
        data = [encode_turned(source.stored, conversion.roll, source.encoding, given, expand=expand)]
        data += [_matrix_text(source.disparity.shape, conversion.roll, expand)]
        return dict(zip(map(options.at, conversion.writes), data, strict=False))

    return _convert(conversion, options, make)


def _matrix_text(shape: tuple[int, ...], roll: float, expand: bool) -> bytes:
    """Return where pixels go, as `numpy.loadtxt` reads it."""
    v, u = ((side - 1) / 2 for side in shape)
    lines = [
        f"# turned by {math.degrees(roll):.6f} degrees about its centre, ({u:g}, {v:g})",
        "# pixel (u, v, 1) of the map, from the centre of the top-left one, to (x, y, 1) of the new one",
        *(" ".join(f"{each:.12g}" for each in row) for row in rotation_matrix(shape, roll, expand=expand)),
    ]
    return "\n".join([*lines, ""]).encode()


def count_map(conversion: Conversion, options: FrameOptions, count: CountOptions) -> FrameResult:
    """Write the v-disparity image of the map, and the counts if they were requested."""
    likeness = ""

    def make(source: Source) -> dict[str, bytes]:
        nonlocal likeness
        histogram = v_disparity(source.disparity, bins=count.bins, max_disparity=count.max_disparity)
        estimate = _sure_estimate(source)
        road = horizon = None
        if estimate is None:
            likeness = looks_like(source.disparity, source.stored, options)
        else:
            road = profile(estimate.alpha, estimate.theta, estimate.width)
            horizon = _horizon(estimate, conversion.frame.calibration)
        picture = encode_png(draw_v_disparity(histogram, road, horizon=horizon))
        images = [picture, encode_stored(histogram.counts, "tiff")] if count.counts else [picture]
        return dict(zip(map(options.at, conversion.writes), images, strict=True))

    result = _convert(conversion, options, make)
    return replace(result, warning="; ".join(filter(None, [result.warning, likeness])))


def heights_of_map(conversion: Conversion, options: FrameOptions, result: str) -> FrameResult:
    """Write the heights of the map over the road of its row, and a picture of them if that was requested."""
    row, frame = conversion.row, conversion.frame

    def make(source: Source) -> dict[str, bytes]:
        height, width = source.disparity.shape
        calibration = None if frame.calibration is None else frame.calibration.for_size(width, height)
        road = None if row is None else FittedRoad.of_row(row, calibration)
        if road is None:
            raise InputError(f"{frame.file}: its row in {result} has no road (alpha0, alpha1, alpha2)")
        if (road.width, road.height) != (width, height):
            raise InputError(
                f"{frame.file}: has {width}x{height} px, its row in {result} {road.width}x{road.height}: "
                "name the result of these maps"
            )
        heights, unit = heights_over(source.disparity, road, calibration), unit_of(calibration)
        images = [encode_heights(heights, options.images.save_as, unit)]
        if len(conversion.writes) > 1:
            images.append(encode_heights_preview(heights, options.images.heights_range, unit))
        return dict(zip(map(options.at, conversion.writes), images, strict=True))

    return _convert(conversion, options, make)


def draw_figure(conversion: Conversion, options: FrameOptions, count: CountOptions) -> FrameResult:
    """Write the figure of the map and its v-disparity, by the angle of a result or by its own estimate."""
    from rollcli.pictures.vdisparity_figure import v_disparity_figure  # loads matplotlib, an extra

    def make(source: Source) -> dict[str, bytes]:
        row = conversion.row
        road: Row | RollEstimate = estimate_roll(source.disparity) if row is None else row
        theta = math.radians(road.roll_deg or 0.0) if isinstance(road, Row) else road.theta
        figure = v_disparity_figure(
            source.disparity,
            theta,
            road.alpha,
            count.figure or "svg",
            bins=count.bins,
            max_disparity=count.max_disparity,
        )
        return {options.at(conversion.writes[0]): figure}

    return _convert(conversion, options, make)


def match_frame(
    conversion: Conversion, options: FrameOptions, save_as: str, *, preview: bool = False
) -> FrameResult:
    """Write the disparity map of the pair, and a picture of it if that was requested."""

    def make(source: Source) -> dict[str, bytes]:
        if not np.any(source.disparity):
            raise InputError(f"{conversion.frame.file}: no pixel could be matched with the right image")
        path, data = encode_computed(
            options.at(conversion.writes[0]), source.shown, save_as, source.provenance.text
        )
        if not preview:
            return {path: data}
        return {path: data, options.at(conversion.writes[-1]): encode_png(draw_preview(source.shown))}

    return _convert(conversion, options, make)


def _convert(
    conversion: Conversion, options: FrameOptions, make: Callable[[Source], dict[str, bytes]]
) -> FrameResult:
    """Read the frame and write the files that `make` makes of it, each whole or not at all."""
    frame = conversion.frame
    paths = [options.at(path) for path in conversion.writes]
    made: dict[str, bytes] = {}

    def work() -> FrameResult:
        if conversion.refused:
            raise InputError(f"{frame.file}: {conversion.refused}")
        source = read_source(frame, options)
        made.update(make(source))
        row = Row(frame.file, frame.right_file, "ok", **source.alignment)
        too_large = "" if paths[0] in made else TOO_LARGE_FOR_PNG
        beyond = "" if conversion.keeps_numbers else source.beyond
        warning = source.warning or beyond or source.doubt or too_large
        return FrameResult(row, source.encoding, warning, source.searched)

    result = guarded(frame, work)
    write_outputs(made, paths, replaces=options.replaces)
    return result


def _sure_estimate(source: Source) -> RollEstimate | None:
    """Find the road; None unless the estimate is `ok`."""
    try:
        estimate = estimate_roll(source.disparity)
    except EstimationError:
        return None
    return estimate if estimate.status == "ok" else None


def _horizon(estimate: RollEstimate, calibration: Calibration | None) -> float | None:
    """Return the row of the horizon on the middle column; None without a calibration."""
    if calibration is None:
        return None
    y = horizon_row(estimate.tangent, calibration.for_size(estimate.width, estimate.height))
    return None if y is None else middle_row(y, estimate.theta, estimate.width)
