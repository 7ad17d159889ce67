"""`evaluate accuracy` from the command line: what is read and written, and the table to read."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from rollcli.errors import ExitStatus
from rollcli.evaluate.accuracy import (
    DISTANCES_M,
    LARGE_ERROR_DEG,
    Accuracy,
    Comparison,
    HeightsAt,
    assess,
    assess_heights,
)
from rollcli.evaluate.options import AccuracyOptions
from rollcli.evaluate.truth import KnownPose, read_truth
from rollcli.files.atomic import is_folder
from rollcli.files.matching import stem_of
from rollcli.files.naming import listed
from rollcli.files.results import Result, Row, csv_table, read_result, run_path
from rollcli.files.stream import is_stream, write_output
from rollcli.messages import say
from rollcli.run.reads_and_writes import check_writes, list_files
from rollcli.run.record import recorded_options

_NAMES = {"no_angle", "no_truth"}
_DIGITS = 6
_OF_POSE = ("count", "median", "p95", "worst", "bias", "coverage_95")
_OF_HEIGHTS = ("frames", "median", "p95", "bias")
_LENGTHS = {"median", "p95", "worst", "bias"}  # what has the unit of the quantity


def as_table(found: Comparison) -> str:
    """Return one figure a line, for people."""
    roll = found.roll
    lines = [
        ("frames compared", f"{roll.count}" + (f" ({found.suspect} suspect)" if found.suspect else "")),
        ("without an angle", str(len(found.no_angle))),
        ("without a known angle", str(len(found.no_truth))),
        *_lines("", roll, "degrees", f"  {roll.worst_file}".rstrip()),
        (f"above {LARGE_ERROR_DEG:g} degrees", _percent(roll.share_above_0_5_deg, roll.count)),
        ("inside the 95 % interval", _percent(roll.coverage_95, roll.intervals)),
    ]
    for name, part, unit in (("pitch", found.pitch, "degrees"), ("height", found.height, "m")):
        if part is not None:
            lines += [
                (f"{name}, frames compared", str(part.count)),
                *_lines(f"{name}, ", part, unit),
                (f"{name}, in its interval", _percent(part.coverage_95, part.intervals)),
            ]
    for at in found.heights:
        name = f"heights, {at.distance} m"
        lines += [
            (f"{name}, frames", str(at.frames)),
            (f"{name}, median", f"{at.median:.4f} m"),
            (f"{name}, 95 %", f"{at.p95:.4f} m"),
            (f"{name}, signed", f"{at.bias:.4f} m"),
        ]
    return "".join(f"{name:26}{value}\n" for name, value in lines)


def _lines(name: str, part: Accuracy, unit: str, worst: str = "") -> list[tuple[str, str]]:
    """Return the figures of a quantity in words; `worst` names the frame of the largest error."""
    figures = (
        ("median error", part.median, ""),
        ("95th percentile", part.p95, ""),
        ("worst", part.worst, worst),
        ("mean, signed", part.bias, ""),
    )
    return [
        (f"{name}{words}", "-" if value is None else f"{value:.4f} {unit}{more}")
        for words, value, more in figures
    ]


def _percent(share: float | None, of: int) -> str:
    return "-" if share is None else f"{100 * share:.1f} % ({round(share * of)} of {of})"


def as_csv(found: Comparison) -> str:
    """Return a header and one line."""
    values = _values(found)
    line = [len(value) if name in _NAMES else value for name, value in values.items()]
    return csv_table([values, line]).decode("utf-8", "surrogateescape")


def as_json(found: Comparison) -> str:
    """Return one object; the frames without an angle or a known one by name."""
    return json.dumps(_values(found), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _values(found: Comparison) -> dict[str, Any]:
    """Return every figure by its column."""
    heights = {at.distance: at for at in found.heights}
    values = {
        **_named(found.roll, [field.name for field in fields(Accuracy)], "", "deg"),
        **{name: getattr(found, name) for name in ("ok", "suspect", "no_angle", "no_truth")},
        **_named(found.pitch, _OF_POSE, "pitch_", "deg"),
        **_named(found.height, _OF_POSE, "height_", "m"),
    }
    for distance in DISTANCES_M:
        values |= _named(heights.get(distance), _OF_HEIGHTS, f"over_road_at_{distance}_m_", "m")
    return {name: round(v, _DIGITS) if isinstance(v, float) else v for name, v in values.items()}


def _named(part: Accuracy | HeightsAt | None, names: Iterable[str], before: str, unit: str) -> dict[str, Any]:
    return {
        f"{before}{name}{f'_{unit}' if name in _LENGTHS else ''}": getattr(part, name, None) for name in names
    }


def run_accuracy(options: AccuracyOptions) -> ExitStatus:
    """Compare a result with known angles.

    Parameters
    ----------
    options : AccuracyOptions

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
    result, truth, running = options.result, options.truth, options.running
    writes = [] if is_stream(options.output) else [options.output]
    check_writes([result, truth], writes, overwrite=running.overwrite)
    if running.dry_run:
        list_files([((result, truth), writes)])
        return ExitStatus.DONE
    read, known = read_result(result), read_truth(truth)
    found = assess(read.rows, known, result)
    found = replace(found, heights=_heights(read, known, options))
    if not running.quiet:
        _name_unmatched(found, options)
        _count_bent(read.rows, known, truth)
    data = FORMATS[options.format](found).encode("utf-8", "surrogateescape")
    write_output(options.output, data, overwrite=running.overwrite)
    return ExitStatus.FRAMES_FAILED if found.no_angle else ExitStatus.DONE


def _heights(read: Result, known: Mapping[str, KnownPose], options: AccuracyOptions) -> tuple[HeightsAt, ...]:
    """Compare the heights over the road of a folder that was named, or of that of the run."""
    heights, beside = options.heights, options.truth.rpartition("/")[0] or "."
    if heights is None:
        heights = recorded_options(read.run, run_path(options.result)).images.heights
        if heights is None or not (is_folder(heights) and is_folder(f"{beside}/heights")):
            return ()
    found = assess_heights(read.rows, known, heights, beside)
    if found is None and not options.running.quiet:
        say(
            f"{heights}: no heights are compared: they need metres (estimate --calib), and the truth columns "
            "focal_px and baseline_m"
        )
    return found or ()


def _name_unmatched(found: Comparison, options: AccuracyOptions) -> None:
    """Say which frames could not be compared: the first few by name."""
    for names, where, what in (
        (found.no_angle, options.truth, f"no angle in {options.result}"),
        (found.no_truth, options.result, f"no known angle in {options.truth}"),
    ):
        if names:
            frames = "1 frame has" if len(names) == 1 else f"{len(names)} frames have"
            say(f"{where}: {frames} {what}: {listed(names)}")


def _count_bent(rows: Sequence[Row], known: Mapping[str, KnownPose], truth: str) -> None:
    """Say how many poses are not compared because the road bends away from that below the camera."""
    posed = (known.get(stem_of(row.file)) for row in rows if row.pitch_deg is not None)
    bent = sum(pose is not None and pose.bends for pose in posed)
    if bent:
        frames = "1 frame, whose road bends" if bent == 1 else f"{bent} frames, whose roads bend"
        say(f"{truth}: pitch and height are not compared on {frames} (curvature_per_m)")
