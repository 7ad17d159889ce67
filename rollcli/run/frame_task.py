"""One frame in, one row out."""

import time
from dataclasses import replace
from functools import partial
from typing import Any

from rollcli.estimator.estimate import RollEstimate
from rollcli.files.results import Row
from rollcli.files.storage import noting
from rollcli.rig.pose import with_pose
from rollcli.run.diagnosis import estimate_or_liken, looks_like
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.images import Made, Pictured, converted, encode_images, require_angle
from rollcli.run.options import FrameOptions
from rollcli.run.outputs import every_path, write_outputs
from rollcli.run.read import Source, guarded, read_source
from rollcli.run.result_file import inputs_line


def run_frame(frame: Frame, options: FrameOptions) -> FrameResult:
    """Read a frame, make its row and write its files; what is wrong with it becomes an `error` row.

    Raises
    ------
    OutputError
        A file cannot be written, which ends the run.
    """
    start = time.perf_counter()
    files: dict[str, bytes] = {}

    def work() -> FrameResult:
        require_angle(frame, options)
        source = read_source(frame, options)
        make = _estimated if options.convert is None else converted
        row, made, warnings = make(frame, source, options)
        files.update(made)  # last: a frame that fails has none
        return FrameResult(row, source.encoding, warnings, source.searched)

    with noting(options.notes) as notes:
        result = guarded(frame, work)
    paths = every_path(frame, options.writes, options.root)
    write_outputs(files, paths, replaces=options.replaces, retry_of=options.retry_of)
    elapsed = 1000 * (time.perf_counter() - start)
    noted = {**notes, **(frame.decoded.notes if frame.decoded else {})}
    inputs = inputs_line(frame, noted, options.at) if options.notes else b""
    return replace(result, row=replace(result.row, elapsed_ms=elapsed), inputs=inputs)


def _estimated(frame: Frame, source: Source, options: FrameOptions) -> Made:
    calibration = source.calibrated(frame.calibration)
    request = options.method.request(source.slope_error, calibration)
    like = partial(looks_like, source.disparity, source.stored, options)
    how: dict[str, Any] = {"mask": source.allowed, "road_mask": options.images.road_mask is not None}
    with source.doubting():
        estimate, likeness = estimate_or_liken(source.disparity, request, like, **how)
    # the images are turned by the angle of the pixels, which is not the rig's where fx and fy differ
    files, note = encode_images(frame, Pictured(source, estimate, options, calibration))
    if calibration is not None:
        estimate = with_pose(estimate, calibration)
    row = _row(frame, source, estimate, note, likeness)
    return row, files, {**source.warnings, likeness: likeness}


def _row(frame: Frame, source: Source, estimate: RollEstimate, note: str, likeness: str) -> Row:
    reasons = list(filter(None, [likeness, estimate.message, source.doubt, source.note, note]))
    said = {**estimate.to_dict(), **source.alignment, "message": "; ".join(reasons)}
    if source.doubt:
        said["status"] = "suspect"
    return Row(file=frame.file, right_file=frame.right_file, **said)
