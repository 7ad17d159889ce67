"""`evaluate accuracy` from the command line: what is read and written, and the table to read."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from rollcli.errors import ExitStatus
from rollcli.evaluate.accuracy import (
    LARGE_ERROR_DEG,
    Accuracy,
    PoseAccuracy,
    assess,
    assess_height,
    assess_pitch,
)
from rollcli.evaluate.map_accuracy import DISTANCES_M, HeightsAt, assess_heights, height_files
from rollcli.evaluate.truth import KnownPose, read_known_poses
from rollcli.files.atomic import is_folder
from rollcli.files.matching import stem_of
from rollcli.files.naming import listed
from rollcli.files.results import Row, read_result, run_path
from rollcli.files.stream import is_stream, write_output
from rollcli.messages import say
from rollcli.run.options import RunningOptions
from rollcli.run.reads_and_writes import check_writes, list_files
from rollcli.run.record import recorded_options

_NAMES = {"no_angle", "no_truth"}
_DIGITS = 6
_LENGTHS = {"median", "p95", "worst", "bias"}  # what has the unit of the quantity


def as_table(accuracy: Accuracy) -> str:
    """Return one figure a line, for people."""
    of = accuracy.count
    lines = [
        ("frames compared", f"{of}" + (f" ({accuracy.suspect} suspect)" if accuracy.suspect else "")),
        ("without an angle", str(len(accuracy.no_angle))),
        ("without a known angle", str(len(accuracy.no_truth))),
        ("median error", _degrees(accuracy.median_deg)),
        ("95th percentile", _degrees(accuracy.p95_deg)),
        ("worst", _degrees(accuracy.worst_deg) + (f"  {accuracy.worst_file}" if of else "")),
        ("mean, signed", _degrees(accuracy.bias_deg)),
        (f"above {LARGE_ERROR_DEG:g} degrees", _percent(accuracy.share_above_0_5_deg, of)),
        ("inside the 95 % interval", _percent(accuracy.coverage_95, accuracy.intervals)),
    ]
    for name, part, unit in (("pitch", accuracy.pitch, "degrees"), ("height", accuracy.height, "m")):
        if part is not None:
            lines += [
                (f"{name}, frames compared", str(part.count)),
                (f"{name}, median error", f"{part.median:.4f} {unit}"),
                (f"{name}, 95th percentile", f"{part.p95:.4f} {unit}"),
                (f"{name}, worst", f"{part.worst:.4f} {unit}"),
                (f"{name}, mean, signed", f"{part.bias:.4f} {unit}"),
                (f"{name}, in its interval", _percent(part.coverage_95, part.count)),
            ]
    for at in accuracy.heights:
        name = f"heights, {at.distance} m"
        lines += [
            (f"{name}, frames", str(at.frames)),
            (f"{name}, median", f"{at.median:.4f} m"),
            (f"{name}, 95 %", f"{at.p95:.4f} m"),
            (f"{name}, signed", f"{at.bias:.4f} m"),
        ]
    return "".join(f"{name:26}{value}\n" for name, value in lines)


def as_csv(accuracy: Accuracy) -> str:
    """Return a header and one line."""
    buffer = io.StringIO()
    values = _values(accuracy)
    lines = csv.writer(buffer, lineterminator="\n")
    lines.writerow(values)
    lines.writerow(len(value) if name in _NAMES else value for name, value in values.items())
    return buffer.getvalue()


def as_json(accuracy: Accuracy) -> str:
    """Return one object; the frames without an angle or a known one by name."""
    return json.dumps(_values(accuracy), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _values(accuracy: Accuracy) -> dict[str, Any]:
    values = {field.name: getattr(accuracy, field.name) for field in fields(accuracy)}
    for name, unit in (("pitch", "deg"), ("height", "m")):
        part = values.pop(name)
        for field in fields(PoseAccuracy):
            suffix = f"_{unit}" if field.name in _LENGTHS else ""
            values[f"{name}_{field.name}{suffix}"] = getattr(part, field.name, None)
    heights = {at.distance: at for at in values.pop("heights")}
    for distance in DISTANCES_M:
        for name in ("frames", "median", "p95", "bias"):
            suffix = "_m" if name in _LENGTHS else ""
            key = f"over_road_at_{distance}_m_{name}{suffix}"
            values[key] = getattr(heights.get(distance), name, None)
    return {name: round(v, _DIGITS) if isinstance(v, float) else v for name, v in values.items()}


def _degrees(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f} degrees"


def _percent(share: float | None, of: int) -> str:
    return "-" if share is None else f"{100 * share:.1f} % ({round(share * of)} of {of})"


def run_accuracy(
    result: str,
    truth: str,
    form: str,
    output: str,
    running: RunningOptions,
    heights: str | None = None,
) -> ExitStatus:
    """Compare a result with known angles.

    Parameters
    ----------
    result, truth : str
        Files: what `rollcli estimate` wrote, and a CSV with `file`, `roll_deg` and, where known, `pitch_deg`
        and `height_m`.
    form : {"table", "csv", "json"}
    output : str
        A file, or "-" for stdout.
    running : RunningOptions
    heights : str, optional
        The folder of heights over the road that the run wrote; by default the one that its record names, if
        it and `heights/` beside the truth exist.

    Returns
    -------
    ExitStatus
        FRAMES_FAILED when a frame of the truth has no angle.

    Raises
    ------
    UsageError, InputError
        Exit status 2: a file is not what it should be, or nothing in them matches.
    OutputError
        Exit status 1.
    """
    writes = [] if is_stream(output) else [output]
    check_writes([result, truth], writes, overwrite=running.overwrite)
    if running.dry_run:
        list_files([((result, truth), writes)])
        return ExitStatus.DONE
    found, known = read_result(result), read_known_poses(truth)
    rows = found.rows
    accuracy = assess(rows, {stem: pose.theta for stem, pose in known.items()}, result)
    accuracy = replace(accuracy, pitch=assess_pitch(rows, known), height=assess_height(rows, known))
    beside = truth.rpartition("/")[0] or "."
    if heights is None:
        recorded = recorded_options(found.run, run_path(result)).images.heights
        both = recorded is not None and is_folder(recorded) and is_folder(f"{beside}/heights")
        heights = recorded if both else None
    if heights is not None:
        accuracy = replace(accuracy, heights=_heights(rows, known, heights, beside, running))
    _name_unmatched(accuracy, result, truth, running)
    _count_bent(rows, known, truth, running)
    data = FORMATS[form](accuracy).encode("utf-8", "surrogateescape")
    write_output(output, data, overwrite=running.overwrite)
    return ExitStatus.FRAMES_FAILED if accuracy.no_angle else ExitStatus.DONE


def _heights(
    rows: Sequence[Row], known: Mapping[str, KnownPose], heights: str, beside: str, running: RunningOptions
) -> tuple[HeightsAt, ...]:
    files = height_files(rows, known, heights, beside)
    if not files and not running.quiet:
        say(
            f"{heights}: no heights are compared: they need metres (estimate --calib), and the truth columns "
            "focal_px and baseline_m"
        )
    return assess_heights(files)


def _name_unmatched(accuracy: Accuracy, result: str, truth: str, running: RunningOptions) -> None:
    """Say which frames could not be compared: the first few by name."""
    if running.quiet:
        return
    for names, where, what in (
        (accuracy.no_angle, truth, f"no angle in {result}"),
        (accuracy.no_truth, result, f"no known angle in {truth}"),
    ):
        if names:
            frames = "1 frame has" if len(names) == 1 else f"{len(names)} frames have"
            say(f"{where}: {frames} {what}: {listed(names)}")


def _count_bent(
    rows: Sequence[Row], known: Mapping[str, KnownPose], truth: str, running: RunningOptions
) -> None:
    """Say how many poses are not compared because the road bends away from that below the camera."""
    posed = (known.get(stem_of(row.file)) for row in rows if row.pitch_deg is not None)
    bent = sum(pose is not None and pose.bends for pose in posed)
    if bent and not running.quiet:
        frames = "1 frame, whose road bends" if bent == 1 else f"{bent} frames, whose roads bend"
        say(f"{truth}: pitch and height are not compared on {frames} (curvature_per_m)")
