"""An assessment as a table to read, as CSV and as JSON."""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rollcli.rig.assess import RigAssessment
from rollcli.rig.quantities import QUANTITIES, ROLL
from rollcli.rig.sequence.blocks import Estimate
from rollcli.rig.words import answer, counts, findings, now_in_words
from rollcli.rig_check.gates import Check
from rollcli.rig_check.values import moved, rig_values, segment_rows

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
    """

    rig: RigAssessment
    checks: Sequence[Check]
    after: RigAssessment | None
    changes: dict[str, Estimate]


def as_table(found: Findings) -> str:
    """Write the answer first, then what happened over the drives."""
    return "".join(f"{line}\n" for line in _lines(found))


def as_csv(found: Findings) -> str:
    """Return a header, and a line for each segment."""
    buffer = io.StringIO()
    rows = segment_rows(found.rig)
    lines = csv.DictWriter(buffer, list(rows[0]) if rows else ["drive"], lineterminator="\n")
    lines.writeheader()
    lines.writerows(rows)
    return buffer.getvalue()


def as_json(found: Findings) -> str:
    """One object."""
    against = None if found.after is None else (found.after, found.changes)
    return json.dumps(rig_values(found.rig, found.checks, against), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _lines(found: Findings) -> Iterator[str]:
    rig = found.rig
    for quantity in QUANTITIES:
        if quantity is ROLL or rig.latest(quantity) is not None:
            now = f"{answer(rig.now(quantity), quantity)} {now_in_words(rig, quantity)}".rstrip()
            yield f"{quantity.name:8}{now}" + (f"  ({counts(rig)})" if quantity is ROLL else "")
    drive = rig.latest_drive()
    if drive is not None:
        drift, over = drive.quantities[ROLL.name].drift, drive.name if len(rig.drives) > 1 else ""
        if drift.ci95 is not None:
            yield f"drift   {answer(drift, change=True)} over {over or 'the drive'}"
        yield f"jumps   {_jump_count(rig)}"
    yield from (f"        {line}" for line in _roll_jumps(rig))
    yield from _segments(rig)
    for name, change in found.changes.items():
        yield from _moved(name, change)
    sentences = findings(rig)
    if sentences:
        yield ""
    yield from sentences
    for check in found.checks:
        yield f"{'ok' if check.ok else 'FAILED'}: {check.message}"


def _jump_count(rig: RigAssessment) -> str:
    """How many jumps of the roll there are; none only where every drive has frames enough to tell."""
    told = all(drive.quantities[ROLL.name].now.ci95 is not None for drive in rig.drives)
    return str(len(_roll_jumps(rig)) or ("none" if told else "unknown"))


def _roll_jumps(rig: RigAssessment) -> list[str]:
    return [
        f"{answer(jump.change, change=True)} at {rig.frames.files[drive.frames[jump.frame]]}"
        for drive in rig.drives
        for jump in drive.quantities[ROLL.name].jumps
    ]


def _segments(rig: RigAssessment) -> Iterator[str]:
    """Return a table of the segments, where there is more than one."""
    rows = [(drive, segment) for drive in rig.drives for segment in drive.quantities[ROLL.name].segments]
    if len(rows) < 2:
        return
    yield ""
    yield f"{'roll':>18}  {'frames':>9}  {'used':>9}  from, to"
    for drive, segment in rows[:_SEGMENTS_SHOWN]:
        first, last = (rig.frames.files[drive.frames[place]] for place in (segment.first, segment.last))
        count = segment.last - segment.first + 1
        differs = "  differs" if drive.differs and segment.first == 0 else ""
        yield f"{answer(segment.mean):>18}  {count:9,}  {segment.used:9,}  {first}, {last}{differs}"
    if len(rows) > _SEGMENTS_SHOWN:
        yield f"and {len(rows) - _SEGMENTS_SHOWN:,} more segments; --format csv lists all"


def _moved(name: str, change: Estimate) -> Iterator[str]:
    """Whether the rig has moved from one result to the other."""
    if change.value is None:
        return
    quantity = next(each for each in QUANTITIES if each.name == name)
    told = {True: "it has moved", False: "no move is seen", None: "too few frames for an interval"}
    yield f"{name} against the other result: {answer(change, quantity, change=True)}, {told[moved(change)]}"
