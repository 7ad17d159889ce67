"""An assessment of the rig as a table to read, as CSV and as JSON."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rollcli.errors import UsageError
from rollcli.files.results import csv_table
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.quantities import ALIGNMENT, QUANTITIES, ROLL, Quantity
from rollcli.rig.words import answer, counts, drift_in_words, findings, frame_name, now_in_words
from rollcli.run.rig_gates import DISTANCES, NOT_SEEN, Check, Health
from rollcli.stereo.correction import DriveRows

_DIGITS = 6


def named(prefix: str, estimate: Estimate, suffix: str = "deg") -> dict[str, float | None]:
    """Return a value and its interval under the names of the interface."""
    return {f"{prefix}_{suffix}": rounded(estimate.value), f"{prefix}_ci95_{suffix}": rounded(estimate.ci95)}


def rounded(value: float | None) -> float | None:
    """Round to a millionth of a degree or of a metre, far below any noise."""
    return None if value is None else round(value, _DIGITS) + 0.0


def rig_values(found: "Findings") -> dict[str, Any]:
    """Return the assessment as one JSON object."""
    rig, latest = found.rig, found.rig.latest()
    values: dict[str, Any] = {
        "frames": rig.count,
        **{name: getattr(rig, name) for name in ("used", "suspect", "failed", "outliers")},
    }
    for quantity in QUANTITIES:
        values |= named(quantity.name, rig.now(quantity), quantity.suffix)
    values["between_frames_sd_deg"] = rounded(latest.between_sd) if latest else None
    values["status"] = latest.status if latest else "few"
    for quantity in QUANTITIES:
        assessed = rig.latest(quantity)
        prefix = "drift" if quantity is ROLL else f"{quantity.name}_drift"
        values |= named(prefix, assessed.drift if assessed else Estimate(), quantity.suffix)
        hourly = rig.drift_per_hour(rig.latest_drive(quantity), quantity)
        values |= named(prefix, hourly, f"{quantity.suffix}_per_hour")
    for quantity in QUANTITIES:
        values["jumps" if quantity is ROLL else f"{quantity.name}_jumps"] = _jumps(rig, quantity)
    values["segments"] = [{name: row[name] for name in _OF_JSON} for row in segment_rows(rig)]
    values["alignment"] = None if found.health is None else alignment_values(found.health)
    if found.after is not None:
        values["against"] = _against(found.after, found.changes)
    values["checks"] = [asdict(check) for check in found.checks]
    return values


def alignment_values(health: Health) -> dict[str, Any]:
    """Return how the right view lies, with intervals, and what that does."""
    values: dict[str, Any] = {"frames": health.frames}
    for quantity, part in zip(ALIGNMENT, health.parts, strict=True):
        values |= named(quantity.name, part, quantity.suffix)
    values |= named("largest_shift", health.reach, "px")
    depths = {f"{each}_m": rounded(health.depth_percent(each)) for each in DISTANCES}
    return {**values, "depth_error_percent": depths, "advice": health.verdict}


def _jumps(rig: RigAssessment, quantity: Quantity) -> list[dict[str, Any]]:
    found = []
    for drive in rig.drives:
        assessed = drive.quantities.get(quantity.name)
        for jump in assessed.jumps if assessed else ():
            frame = int(drive.frames[jump.frame])
            change = named("change", jump.change, quantity.suffix)
            found.append({"frame": frame, "file": rig.frames.files[frame], **change})
    return found


_OF_CSV = (
    *("drive", "first", "last", "frames", "used", "suspect", "roll_deg", "roll_ci95_deg", "pitch_deg"),
    *("pitch_ci95_deg", "height_m", "height_ci95_m", "first_file", "last_file", "between_frames_sd_deg"),
    *("drift_deg", "drift_ci95_deg", "drift_deg_per_hour", "drift_ci95_deg_per_hour"),
    *("change_deg", "change_ci95_deg", "status"),
)
_OF_JSON = _OF_CSV[: _OF_CSV.index("first_file")]


def segment_rows(rig: RigAssessment) -> Iterator[dict[str, Any]]:
    """Yield of each segment of the roll what is known of it and of its drive: the lines of the CSV.

    The other quantities are those over the same frames.
    """
    for drive in rig.drives:
        roll = drive.quantities[ROLL.name]
        means = {ROLL.name: [each.mean for each in roll.segments]}
        for name in {each.name for each in QUANTITIES[1:]} & drive.quantities.keys():
            means[name] = drive.quantities[name].means([each.frame for each in roll.jumps])
        for place, segment in enumerate(roll.segments):
            frames = drive.frames[segment.first : segment.last + 1]
            first, last = int(frames[0]), int(frames[-1])
            row: dict[str, Any] = {
                "drive": drive.name,
                "first": first,
                "last": last,
                "frames": len(frames),
                "used": segment.used,
                "suspect": int(rig.frames.suspect[frames].sum()),
            }
            for quantity in QUANTITIES:
                mean = means[quantity.name][place] if quantity.name in means else Estimate()
                row |= named(quantity.name, mean, quantity.suffix)
            yield {
                **row,
                "first_file": rig.frames.files[first],
                "last_file": rig.frames.files[last],
                "between_frames_sd_deg": rounded(roll.between_sd),
                **named("drift", roll.drift),
                **named("drift", rig.drift_per_hour(drive), "deg_per_hour"),
                **named("change", roll.jumps[place - 1].change if place else drive.change),
                "status": roll.status,
            }


def _against(after: RigAssessment, changes: dict[str, Estimate]) -> dict[str, Any]:
    """How much more each quantity is in the later result, and whether the rig has moved."""
    values: dict[str, Any] = {"frames": after.count, "used": after.used}
    for quantity in QUANTITIES:
        change = changes[quantity.name]
        values |= named(f"{quantity.name}_change", change, quantity.suffix)
        values[f"{quantity.name}_moved"] = moved(change)
    return values


def moved(change: Estimate) -> bool | None:
    """Whether a change is more than its interval; None where that cannot be told."""
    if change.value is None or change.ci95 is None:
        return None
    return abs(change.value) > change.ci95


_SEGMENTS_SHOWN = 40


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """All that is to be printed.

    Attributes
    ----------
    rig : RigAssessment
    checks : sequence of Check
    after : RigAssessment or None
        Of the later result.
    changes : dict of str to Estimate
        From the rig to `after`, by quantity.
    health : Health or None
        Of the pair.
    """

    rig: RigAssessment
    checks: Sequence[Check]
    after: RigAssessment | None
    changes: dict[str, Estimate]
    health: Health | None = None


def as_table(found: Findings) -> str:
    """Write the answer first, then what happened over the drives."""
    return "".join(f"{line}\n" for line in _lines(found))


def as_csv(found: Findings) -> str:
    """Return a header, and a line for each segment."""
    rows = ([row[name] for name in _OF_CSV] for row in segment_rows(found.rig))
    return csv_table([_OF_CSV, *rows]).decode("utf-8", "surrogateescape")


def as_json(found: Findings) -> str:
    """One object."""
    return json.dumps(rig_values(found), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _lines(found: Findings) -> Iterator[str]:
    rig = found.rig
    jumps = [
        f"{answer(jump.change, change=True)} at {frame_name(rig, drive, jump.frame)}"
        for drive in rig.drives
        for jump in drive.quantities[ROLL.name].jumps
    ]
    for quantity in QUANTITIES:
        if quantity is ROLL or rig.latest(quantity) is not None:
            now = f"{answer(rig.now(quantity), quantity)} {now_in_words(rig, quantity)}".rstrip()
            yield f"{quantity.name:8}{now}" + (f"  ({counts(rig)})" if quantity is ROLL else "")
    drive = rig.latest_drive()
    if drive is not None:
        found_roll, over = drive.quantities[ROLL.name], rig.name_of(drive) if len(rig.drives) > 1 else ""
        if found_roll.drift.ci95 is not None:
            drifts = drift_in_words(rig, drive, over=over or "the drive")
            none = found_roll.searched and not found_roll.drifts
            yield f"drift   {drifts}" + (": none is seen" if none else "")
        # none only where every drive has frames enough to tell
        told = all(drive.quantities[ROLL.name].searched for drive in rig.drives)
        yield f"jumps   {len(jumps) or ('none' if told else 'too few frames to tell')}"
    yield from (f"        {line}" for line in jumps)
    yield from _segment_lines(rig)
    yield from moves(found)
    if found.health is not None:
        yield from found.health.lines()
    sentences = findings(rig, roll=False)
    if sentences:
        yield ""
    yield from sentences
    yield from (f"ok: {check.message}" for check in found.checks if check.ok)


def _segment_lines(rig: RigAssessment) -> Iterator[str]:
    """Yield a table of the segments, where there is more than one."""
    rows = [(drive, segment) for drive in rig.drives for segment in drive.quantities[ROLL.name].segments]
    if len(rows) < 2:
        return
    yield ""
    yield f"{'roll':>18}  {'frames':>9}  {'used':>9}  from, to"
    for drive, segment in rows[:_SEGMENTS_SHOWN]:
        first, last = (frame_name(rig, drive, place) for place in (segment.first, segment.last))
        count = segment.last - segment.first + 1
        differs = "  differs" if drive.differs and segment.first == 0 else ""
        yield f"{answer(segment.mean):>18}  {count:9,}  {segment.used:9,}  {first}, {last}{differs}"
    if len(rows) > _SEGMENTS_SHOWN:
        yield f"and {len(rows) - _SEGMENTS_SHOWN:,} more segments; --format csv lists all"


def moves(found: Findings) -> Iterator[str]:
    """Whether the rig has moved from one result to the other, a line for each quantity that tells."""
    told = {True: "it has moved", False: "no move is seen", None: "too few frames for an interval"}
    for quantity in QUANTITIES if found.changes else ():
        change = found.changes[quantity.name]
        if change.value is not None:
            said = answer(change, quantity, change=True)
            yield f"{quantity.name} against the other result: {said}, {told[moved(change)]}"


# OpenCV's cubic moves what lies between pixels: pitches of 60 rendered pairs that were turned by 0.3 degrees
# and levelled by it are off by 0.018 degrees on average, with Lanczos' weights by 0.008, as of level pairs
_CALL = (
    "cv2.warpPerspective(right, np.array(matrix), (width, height), "
    "flags=cv2.INTER_LANCZOS4 | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE)"
)


_MIDDLE = "the middle of the image: --calib makes that the principal point, or all disparities are off"
NO_COLUMNS = "too few pairs of one size can be read here: each tells alone what of a scale is in the columns"


def correction_text(health: Health | None, rows: DriveRows | None, results: Sequence[str]) -> str:
    """Return the JSON of a correction; `rows` are of the size matched at, if the drive tells.

    Raises
    ------
    UsageError
        The results have no pairs whose views were measured.
    """
    if health is None:
        raise UsageError(f"{results[0]}: no pair was measured, so there is no correction to write")
    width, height = health.size
    axis, about, aspect = health.axis, _MIDDLE, 1.0
    if health.calibration is not None:
        about, aspect = "the principal point", health.calibration.aspect
    lies = health.misalignment
    larger = lies.scale
    if rows is not None:
        larger = rows.columns.scale + 2 * rows.columns.twist * axis[0] + rows.columns.pitch * axis[1]
    values = {
        **alignment_values(health),
        "width": width,
        "height": height,
        **({} if rows is None else rows.as_text(height, width)),
        "matrix": lies.matrix(height, width, larger, axis, aspect),
        "opencv": _CALL,
        "note": f"matrix, for views of {width}x{height} px: from a pixel of the corrected right view to "
        f"the given one, without twist and bend, which no matrix holds, about {about}; {NOT_SEEN}",
    }
    return json.dumps(values, indent=2) + "\n"
