"""One frame in, one row and its files out: the images beside a row, and what a conversion writes."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.files.codecs.png import encode_png
from rollcli.files.encodings import HEIGHTS, KITTI_TOP, Encoding, to_kitti
from rollcli.files.formats import encode_stored
from rollcli.files.results import Row
from rollcli.files.storage import noting
from rollcli.pictures.derotate import derotate, rotation_matrix
from rollcli.pictures.heights import FittedRoad, heights_over, steadied, unit_of
from rollcli.pictures.overlay import draw_heights, draw_preview, draw_road
from rollcli.pictures.vdisparity import MiddleColumn, draw_v_disparity, v_disparity
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import horizon_row, with_pose
from rollcli.run.diagnosis import estimate_or_liken, looks_like, sure_estimate
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.options import (
    ConvertOptions,
    DerotateOptions,
    DisparityOptions,
    EncodingOptions,
    FramesOptions,
    HeightsOptions,
    VDisparityOptions,
)
from rollcli.run.outputs import possible_paths, roomy_path, write_outputs
from rollcli.run.read import FRAME_ERRORS, Source, frame_of_error, read_source
from rollcli.run.result_file import inputs_line

TOO_LARGE_FOR_PNG = f"written as TIFF: a disparity is above the {KITTI_TOP:.0f} px of a KITTI PNG"
_Named = tuple[str, bytes]
_Files = tuple[dict[str, bytes], dict[str, str]]  # files by path, and warnings by code
_Made = tuple[Row, dict[str, bytes], dict[str, str]]  # the same behind the row


def run_frame(frame: Frame, options: FramesOptions) -> FrameResult:
    """Read a frame, make its row and write its files; what is wrong with it becomes an `error` row.

    Raises
    ------
    OutputError
        A file cannot be written, which ends the run.
    """
    start = time.perf_counter()
    # numbers of damaged maps overflow: the row says what comes of them
    with noting(options.notes) as notes, np.errstate(all="ignore"):
        try:
            result, files = _done(frame, options)
        except FRAME_ERRORS as error:
            result, files = frame_of_error(frame, error), {}
    write_outputs(frame, files, options)
    elapsed = 1000 * (time.perf_counter() - start)
    noted = {**notes, **(frame.decoded.notes if frame.decoded else {})}
    inputs = inputs_line(frame, noted, options) if options.notes else b""
    return replace(result, row=replace(result.row, elapsed_ms=elapsed), inputs=inputs)


def _done(frame: Frame, options: FramesOptions) -> tuple[FrameResult, dict[str, bytes]]:
    """Read a frame; return its row, and its files by path."""
    # of the result that a conversion is given
    if isinstance(options, ConvertOptions) and frame.row is not None and frame.row.map_roll_deg is None:
        raise InputError(f"{frame.file}: has no angle in {options.result}")
    source = read_source(frame, options)
    if isinstance(options, ConvertOptions):
        files, warnings = _MAKERS[type(options)](source, frame, options, _usual_paths(frame, options))
        height, width = source.disparity.shape
        row = Row(frame.file, frame.right_file, "ok", width=width, height=height, **source.alignment)
        warnings = {**source.doubts, **warnings}
    else:
        row, files, warnings = _estimated(frame, source, options)
    return FrameResult(row, source.read_as, warnings), files


def _estimated(frame: Frame, source: Source, options: FramesOptions) -> _Made:
    calibration = source.calibrated(frame.calibration)
    request = options.method.request(source.slope_error, calibration)
    like = partial(looks_like, source.disparity, source.stored, options)
    how: dict[str, Any] = {"mask": source.allowed, "road_mask": options.images.road_mask is not None}
    with source.doubting():
        estimate, likeness = estimate_or_liken(source.disparity, request, like, **how)
    # the images are turned by the angle of the pixels, which is not the rig's where fx and fy differ
    files, note = _encode_images(frame, Pictured(source, estimate, options, calibration))
    if calibration is not None:
        estimate = with_pose(estimate, calibration)
    said = {**source.doubted(estimate, likeness, note).to_dict(), **source.alignment}
    row = Row(file=frame.file, right_file=frame.right_file, **said)
    return row, files, {**source.warnings, likeness: likeness}


@dataclass(frozen=True)  # without slots, for the cached heights
class Pictured:
    """A frame whose images are made: a method for each of `KINDS` names and encodes one.

    Attributes
    ----------
    source : Source
    estimate : RollEstimate
        In the pixels of the map: its roll is not the rig's where fx and fy differ.
    options : FramesOptions
    calibration : Calibration or None
        Of the map.
    """

    source: Source
    estimate: RollEstimate
    options: FramesOptions
    calibration: Calibration | None = None

    def derotated(self, path: str) -> _Named:
        """Turn the map upright."""
        source, theta = self.source, self.estimate.theta
        if source.stored is None:
            turned = derotate(source.shown, theta)
            return encode_computed(path, turned, self.options.images.save_as, source.text)
        return path, encode_turned(source, theta, self.options.encoding)

    def vdisparity(self, path: str) -> _Named:
        """Draw the v-disparity image of the map turned upright."""
        estimate = self.estimate
        histogram = v_disparity(derotate(self.source.shown, estimate.theta))
        column = MiddleColumn.of_level(estimate.theta, estimate.width, estimate.height)
        horizon = None if self.calibration is None else horizon_row(estimate.tangent, self.calibration)
        row = None if horizon is None else column.row(horizon)
        return path, encode_png(draw_v_disparity(histogram, column.profile(estimate.alpha), row))

    def disparity(self, path: str) -> _Named:
        """Take the map that was matched."""
        return encode_computed(path, self.source.shown, self.options.images.save_as, self.source.text)

    def road_mask(self, path: str) -> _Named:
        """Draw the road that was found."""
        road = self.estimate.road_mask
        assert road is not None  # the frame's task asks for it
        return path, encode_png(draw_road(self.source.shown, road, self.source.photo))

    def heights(self, path: str) -> _Named:
        """Measure the heights over the road."""
        return path, encode_heights(self._over, self.options.images.save_as, unit_of(self.calibration))

    def heights_preview(self, path: str) -> _Named:
        """Draw the heights over the road."""
        span, unit = self.options.images.heights_range, unit_of(self.calibration)
        return path, encode_png(draw_heights(self._over, span, unit, self.source.photo))

    @cached_property
    def _over(self) -> NDArray[np.float32]:
        """The heights over the road, of a pair steadied; an image and its preview share them."""
        road = FittedRoad.of_estimate(self.estimate)
        heights = heights_over(self.source.shown, road, self.calibration)
        return heights if self.source.stored is not None else steadied(heights)


def _encode_images(frame: Frame, pictured: Pictured) -> tuple[dict[str, bytes], str]:
    """Make the images that were requested, by their paths, and what the row should say of them."""
    images, note = {}, ""
    for kind, planned in _usual_paths(frame, pictured.options).items():
        target, data = getattr(pictured, kind)(planned)
        images[target] = data
        if target != planned:
            note = TOO_LARGE_FOR_PNG
    return images, note


def _usual_paths(frame: Frame, options: FramesOptions) -> dict[str, str]:
    """Name the files of a frame, by their kinds."""
    return {kind: usual for kind, (usual, *_) in possible_paths(frame, options.writes)}


def encode_turned(source: Source, roll: float, given: EncodingOptions, *, expand: bool = False) -> bytes:
    """Rotate a map by `roll` radians, and encode it in its own type, encoding and format."""
    stored = source.stored
    assert stored is not None  # a map, not a pair
    sign = -1 if given.scale is not None and given.scale < 0 else 1
    no_data = [sign * each for each in (*given.invalid, *stored.nodata)]
    if source.encoding == Encoding.CITYSCAPES:
        no_data.append(1)  # (1 - 1) / 256 is a disparity of 0
    values = stored.values
    if sign < 0:  # positive numbers are data to the rotation; whole ones get room for their lowest
        values = -(values if values.dtype.kind == "f" else values.astype(np.int64))
    if "plateau" in source.warnings:  # positive numbers that are no data
        values = np.where((source.disparity == 0) & (values > 0), 0, values)
    turned = sign * derotate(values, roll, expand=expand, invalid=no_data)
    turned = turned.astype(stored.values.dtype, copy=False)
    return encode_stored(turned, stored.format, stored.nodata, source.text)


def encode_computed(path: str, disparity: NDArray[Any], save_as: str, text: str = "") -> tuple[str, bytes]:
    """Name and encode a map computed from a pair: a PNG in KITTI's 16 bits, other formats in pixels.

    A map that reaches further than such a PNG holds becomes a TIFF of the same stem. Both carry `text`.
    """
    if save_as == "png" and np.max(disparity, initial=0) <= KITTI_TOP:
        return path, encode_stored(to_kitti(disparity), "png", text=text)
    form = "tiff" if save_as == "png" else save_as
    data = encode_stored(disparity.astype(np.float32, copy=False), form, text=text)
    return (roomy_path(path) if save_as == "png" else path), data


def encode_heights(heights: NDArray[np.float32], save_as: str, unit: str) -> bytes:
    """Encode heights over the road as a float32 TIFF, which names their unit, or NPY."""
    form = "npy" if save_as == "npy" else "tiff"
    return encode_stored(heights, form, text=f"{HEIGHTS}, {unit}")


def _rotated(source: Source, of: Frame, options: DerotateOptions, paths: Mapping[str, str]) -> _Files:
    """Turn the map, and say where pixels go."""
    roll = math.radians((options.roll_deg if of.row is None else of.row.map_roll_deg) or 0.0)
    turned = encode_turned(source, roll, options.encoding, expand=options.expand)
    files = {paths["derotated"]: turned}
    if options.save_matrix:
        files[paths["matrix"]] = _matrix_text(source.disparity.shape, roll, options.expand)
    # its stored numbers stay as they are, and may be no pixels
    warnings = {code: text for code, text in source.warnings.items() if code != "beyond"}
    return files, warnings


def _matrix_text(shape: tuple[int, ...], roll: float, expand: bool) -> bytes:
    """Return where pixels go, as `numpy.loadtxt` reads it."""
    v, u = ((side - 1) / 2 for side in shape)
    lines = [
        f"# turned by {math.degrees(roll):.6f} degrees about its centre, ({u:g}, {v:g})",
        "# pixel (u, v, 1) of the map, from the centre of the top-left one, to (x, y, 1) of the new one",
        *(" ".join(f"{each:.12g}" for each in row) for row in rotation_matrix(shape, roll, expand=expand)),
    ]
    return "\n".join([*lines, ""]).encode()


def _counted(source: Source, of: Frame, options: VDisparityOptions, paths: Mapping[str, str]) -> _Files:
    """Draw the v-disparity image of the map, and count for it; or draw the figure of both."""
    counting: dict[str, Any] = {"bins": options.bins, "max_disparity": options.max_disparity}
    if options.figure is not None:
        from rollcli.pictures.figures import v_disparity_figure  # loads matplotlib, an extra

        road: Row | RollEstimate = of.row or estimate_roll(source.disparity)
        source.require_size(of.file, of.row, f" in {options.result}")
        theta = math.radians(road.map_roll_deg or 0.0) if isinstance(road, Row) else road.theta
        figure = v_disparity_figure(source.disparity, theta, road.alpha, options.figure, **counting)
        return {paths["vdisparity"]: figure}, dict(source.warnings)
    histogram = v_disparity(source.disparity, **counting)
    estimate = sure_estimate(source.disparity)
    curve, horizon, likeness = None, None, ""
    if estimate is None:
        likeness = looks_like(source.disparity, source.stored, options)
    else:
        column = MiddleColumn.of_map(estimate.theta, estimate.width)
        curve = column.profile(estimate.alpha)
        if (calibration := source.calibrated(of.calibration)) is not None:
            y = horizon_row(estimate.tangent, calibration)
            horizon = None if y is None else column.row(y)
    picture = draw_v_disparity(histogram, curve, horizon, options.max_disparity)
    files = {paths["vdisparity"]: encode_png(picture)}
    if options.counts:
        says = f"columns divide 0 to {histogram.max_disparity:g} px evenly"
        files[paths["counts"]] = encode_stored(histogram.counts, "tiff", text=says)
    return files, {**source.warnings, likeness: likeness}


def _heights_of_row(
    source: Source, frame: Frame, options: HeightsOptions, paths: Mapping[str, str]
) -> _Files:
    """Measure the heights of the map over the road of its row, and draw them if that was requested."""
    calibration = source.calibrated(frame.calibration)
    road = None if frame.row is None else FittedRoad.of_row(frame.row, calibration)
    if road is None:
        raise InputError(f"{frame.file}: its row in {options.result} has no road (alpha0, alpha1, alpha2)")
    source.require_size(frame.file, frame.row, f" in {options.result}")
    heights, unit = heights_over(source.disparity, road, calibration), unit_of(calibration)
    files = {paths["heights"]: encode_heights(heights, options.save_as, unit)}
    if options.preview is not None:
        files[paths["preview"]] = encode_png(draw_heights(heights, options.heights_range, unit))
    return files, dict(source.warnings)


def _matched(source: Source, _: Frame, options: DisparityOptions, paths: Mapping[str, str]) -> _Files:
    """Encode the disparity map of the pair, and draw it if that was requested."""
    planned = paths["disparity"]
    path, data = encode_computed(planned, source.shown, options.save_as, source.text)
    files = {path: data}
    if options.preview is not None:
        files[paths["preview"]] = encode_png(draw_preview(source.shown))
    return files, {"too large": "" if path == planned else TOO_LARGE_FOR_PNG}


_MAKERS: dict[type, Callable[..., _Files]] = {
    DerotateOptions: _rotated,
    VDisparityOptions: _counted,
    HeightsOptions: _heights_of_row,
    DisparityOptions: _matched,
}
