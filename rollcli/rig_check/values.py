"""An assessment as the values that programs read: JSON objects and the rows of a CSV."""

from collections.abc import Sequence
from typing import Any

from rollcli.rig.assess import DriveAssessment, RigAssessment
from rollcli.rig.quantities import QUANTITIES, ROLL, Quantity
from rollcli.rig.sequence.assess import Segment
from rollcli.rig.sequence.blocks import Estimate
from rollcli.rig_check.gates import Check

_DIGITS = 6


def named(prefix: str, estimate: Estimate, suffix: str = "deg") -> dict[str, float | None]:
    """Return a value and its interval under the names of the interface."""
    return {
        f"{prefix}_{suffix}": rounded(estimate.value),
        f"{prefix}_ci95_{suffix}": rounded(estimate.ci95),
    }


def rounded(value: float | None) -> float | None:
    """Round to a millionth of a degree or of a metre, far below any noise."""
    return None if value is None else round(value, _DIGITS) + 0.0


def rig_values(
    rig: RigAssessment, checks: Sequence[Check], against: tuple[RigAssessment, dict[str, Estimate]] | None
) -> dict[str, Any]:
    """Return the assessment as one JSON object."""
    latest = rig.latest()
    values: dict[str, Any] = {
        "frames": rig.count,
        "used": rig.used,
        "suspect": rig.suspect,
        "failed": rig.failed,
        "outliers": rig.outliers,
    }
    for quantity in QUANTITIES:
        values |= named(quantity.name, rig.now(quantity), quantity.suffix)
    values["between_frames_sd_deg"] = rounded(latest.between_sd) if latest else None
    values["status"] = latest.status if latest else "few"
    for quantity in QUANTITIES:
        found = rig.latest(quantity)
        prefix = "drift" if quantity is ROLL else f"{quantity.name}_drift"
        values |= named(prefix, found.drift if found else Estimate(), quantity.suffix)
    for quantity in QUANTITIES:
        values["jumps" if quantity is ROLL else f"{quantity.name}_jumps"] = _jumps(rig, quantity)
    values["segments"] = [
        _segment(rig, drive, place) for drive in rig.drives for place in range(len(_segments(drive)))
    ]
    if against is not None:
        values["against"] = _against(*against)
    values["checks"] = [{"name": c.name, "ok": c.ok, "message": c.message} for c in checks]
    return values


def _jumps(rig: RigAssessment, quantity: Quantity) -> list[dict[str, Any]]:
    found = []
    for drive in rig.drives:
        assessed = drive.quantities.get(quantity.name)
        for jump in assessed.jumps if assessed else ():
            frame = int(drive.frames[jump.frame])
            change = named("change", jump.change, quantity.suffix)
            found.append({"frame": frame, "file": rig.frames.files[frame], **change})
    return found


def _segments(drive: DriveAssessment) -> Sequence[Segment]:
    return drive.quantities[ROLL.name].segments


def _segment(rig: RigAssessment, drive: DriveAssessment, place: int) -> dict[str, Any]:
    """One segment of the roll, with the other quantities over the same frames."""
    roll = _segments(drive)[place]
    frames = drive.frames[roll.first : roll.last + 1]
    values: dict[str, Any] = {
        "drive": drive.name,
        "first": int(frames[0]),
        "last": int(frames[-1]),
        "frames": len(frames),
        "used": roll.used,
        "suspect": int(rig.frames.suspect[frames].sum()),
    }
    for quantity in QUANTITIES:
        found = drive.quantities.get(quantity.name)
        mean = found.mean_over(roll.first, roll.last) if found else Estimate()
        values |= named(quantity.name, roll.mean if quantity is ROLL else mean, quantity.suffix)
    return values


def segment_rows(rig: RigAssessment) -> list[dict[str, Any]]:
    """Return the segments with what else is known of their drive: the lines of the CSV."""
    rows = []
    for drive in rig.drives:
        found = drive.quantities[ROLL.name]
        for place in range(len(found.segments)):
            segment = _segment(rig, drive, place)
            change = found.jumps[place - 1].change if place else drive.change
            rows.append(
                {
                    **segment,
                    "first_file": rig.frames.files[segment["first"]],
                    "last_file": rig.frames.files[segment["last"]],
                    "between_frames_sd_deg": rounded(found.between_sd),
                    **named("drift", found.drift),
                    **named("change", change),
                    "status": found.status,
                }
            )
    return rows


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
