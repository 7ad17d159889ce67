"""Convert one frame, on a worker: read, compute, write."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from rollcli.errors import EstimationError, InputError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.files.codecs.png import encode_png
from rollcli.files.formats import encode_stored
from rollcli.files.results import Row
from rollcli.pictures.derotate import rotation_matrix
from rollcli.pictures.heights import FittedRoad, heights_over, unit_of
from rollcli.pictures.heights_preview import draw_heights
from rollcli.pictures.overlay import draw_preview
from rollcli.pictures.vdisparity import draw_v_disparity, middle_row, profile, v_disparity
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import horizon_row
from rollcli.run.diagnosis import looks_like
from rollcli.run.frame import Conversion, FrameResult
from rollcli.run.images import TOO_LARGE_FOR_PNG, encode_computed, encode_heights, encode_turned
from rollcli.run.options import (
    ConvertOptions,
    DerotateOptions,
    DisparityOptions,
    FrameOptions,
    HeightsOptions,
    VDisparityOptions,
)
from rollcli.run.outputs import write_outputs
from rollcli.run.read import Source, guarded, read_source

_Made = tuple[dict[str, bytes], dict[str, str]]  # files by their paths, and warnings by their codes


def convert_frame(conversion: Conversion, options: ConvertOptions, read: FrameOptions) -> FrameResult:
    """Read a frame and write the files that its command makes of it, each whole or not at all."""
    frame, paths = conversion.frame, [read.at(path) for path in conversion.writes]
    files: dict[str, bytes] = {}

    def work() -> FrameResult:
        if conversion.row is not None and conversion.row.map_roll_deg is None:
            raise InputError(f"{frame.file}: has no angle in {options.result}")
        source = read_source(frame, read)
        made, warnings = _MAKERS[type(options)](source, conversion, options, paths)
        files.update(made)
        row = Row(frame.file, frame.right_file, "ok", **source.alignment)
        return FrameResult(row, source.encoding, {**source.doubts, **warnings}, source.searched)

    result = guarded(frame, work)
    write_outputs(files, paths, replaces=options.running.overwrite)
    return result


def _rotated(source: Source, of: Conversion, options: DerotateOptions, paths: Sequence[str]) -> _Made:
    """Turn the map, and say where pixels go."""
    assert source.stored is not None  # a map, not a pair
    roll = math.radians((options.roll_deg if of.row is None else of.row.map_roll_deg) or 0.0)
    turned = encode_turned(source.stored, roll, source.encoding, options.encoding, expand=options.expand)
    files = [turned, _matrix_text(source.disparity.shape, roll, options.expand)]
    # its stored numbers stay as they are, and may be too large for pixels
    warnings = {code: text for code, text in source.warnings.items() if code != "beyond"}
    return dict(zip(paths, files, strict=False)), warnings


def _matrix_text(shape: tuple[int, ...], roll: float, expand: bool) -> bytes:
    """Return where pixels go, as `numpy.loadtxt` reads it."""
    v, u = ((side - 1) / 2 for side in shape)
    lines = [
        f"# turned by {math.degrees(roll):.6f} degrees about its centre, ({u:g}, {v:g})",
        "# pixel (u, v, 1) of the map, from the centre of the top-left one, to (x, y, 1) of the new one",
        *(" ".join(f"{each:.12g}" for each in row) for row in rotation_matrix(shape, roll, expand=expand)),
    ]
    return "\n".join([*lines, ""]).encode()


def _v_disparity(source: Source, of: Conversion, options: VDisparityOptions, paths: Sequence[str]) -> _Made:
    """Draw the v-disparity image of the map, and count for it; or draw the figure of both."""
    if options.figure is not None:
        from rollcli.pictures.vdisparity_figure import v_disparity_figure  # loads matplotlib, an extra

        road: Row | RollEstimate = of.row or estimate_roll(source.disparity)
        theta = math.radians(road.roll_deg or 0.0) if isinstance(road, Row) else road.theta
        figure = v_disparity_figure(
            source.disparity,
            theta,
            road.alpha,
            options.figure,
            bins=options.bins,
            max_disparity=options.max_disparity,
        )
        return {paths[0]: figure}, dict(source.warnings)
    histogram = v_disparity(source.disparity, bins=options.bins, max_disparity=options.max_disparity)
    estimate = _sure_estimate(source)
    curve, horizon, likeness = None, None, ""
    if estimate is None:
        likeness = looks_like(source.disparity, source.stored, options.frame)
    else:
        curve = profile(estimate.alpha, estimate.theta, estimate.width)
        horizon = _horizon(estimate, of.frame.calibration)
    files = [encode_png(draw_v_disparity(histogram, curve, horizon=horizon))]
    if options.counts:
        files.append(encode_stored(histogram.counts, "tiff"))
    return dict(zip(paths, files, strict=True)), {**source.warnings, likeness: likeness}


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


def _heights(source: Source, of: Conversion, options: HeightsOptions, paths: Sequence[str]) -> _Made:
    """Measure the heights of the map over the road of its row, and draw them if that was requested."""
    frame, (height, width) = of.frame, source.disparity.shape
    calibration = None if frame.calibration is None else frame.calibration.for_size(width, height)
    road = None if of.row is None else FittedRoad.of_row(of.row, calibration)
    if road is None:
        raise InputError(f"{frame.file}: its row in {options.result} has no road (alpha0, alpha1, alpha2)")
    if (road.width, road.height) != (width, height):
        raise InputError(
            f"{frame.file}: has {width}x{height} px, its row in {options.result} {road.width}x{road.height}: "
            "name the result of these maps"
        )
    heights, unit = heights_over(source.disparity, road, calibration), unit_of(calibration)
    files = [encode_heights(heights, options.save_as, unit)]
    if options.preview is not None:
        files.append(encode_png(draw_heights(heights, options.heights_range, unit)))
    return dict(zip(paths, files, strict=True)), dict(source.warnings)


def _matched(source: Source, of: Conversion, options: DisparityOptions, paths: Sequence[str]) -> _Made:
    """Encode the disparity map of the pair, and draw it if that was requested."""
    if not np.any(source.disparity):
        raise InputError(f"{of.frame.file}: no pixel could be matched with the right image")
    path, data = encode_computed(paths[0], source.shown, options.save_as, source.provenance.text)
    files = {path: data}
    if options.preview is not None:
        files[paths[-1]] = encode_png(draw_preview(source.shown))
    return files, {"too large": "" if path == paths[0] else TOO_LARGE_FOR_PNG}


_MAKERS: dict[type, Callable[..., _Made]] = {
    DerotateOptions: _rotated,
    VDisparityOptions: _v_disparity,
    HeightsOptions: _heights,
    DisparityOptions: _matched,
}
