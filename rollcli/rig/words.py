"""An assessment in words: what people read in the table, on stderr and on the page."""

import math
from collections.abc import Iterator

from rollcli.rig.drive.assess import DriveAssessment, RigAssessment
from rollcli.rig.drive.noise import Estimate
from rollcli.rig.drive.quantity import SequenceAssessment
from rollcli.rig.drive.tuning import TUNING
from rollcli.rig.quantities import HEIGHT, QUANTITIES, ROLL, Quantity

_FEWEST_DIGITS, _MOST_DIGITS = 2, 4


def answer(estimate: Estimate, quantity: Quantity = ROLL, *, change: bool = False) -> str:
    """Return a value and its interval, such as "-0.44 ± 0.06°"; "unknown" where there is none.

    Parameters
    ----------
    estimate : Estimate
    quantity : Quantity
        Gives the unit; a height has a sign only as a change.
    change : bool
        Whether it is a difference.
    """
    if estimate.value is None:
        return "unknown"
    digits = decimals(estimate.ci95)
    sign = "" if quantity is HEIGHT and not change else "+"
    text = f"{estimate.value:{sign}.{digits}f}"
    if float(text) == 0:
        text = text.lstrip("+-")
    half = "" if estimate.ci95 is None else f" ± {estimate.ci95:.{digits}f}"
    return f"{text}{half}{quantity.unit}"


def decimals(half: float | None) -> int:
    """Return as many decimals as the half-width of an interval is worth: two where there is none."""
    if half is None or not half > 0:
        return _FEWEST_DIGITS
    return min(_MOST_DIGITS, max(_FEWEST_DIGITS, -math.floor(math.log10(half))))


def one_line(rig: RigAssessment) -> str:
    """Return the answer in one line: `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
    ok = int(rig.frames.ok.sum())
    now = rig.now()
    where = f" {now_in_words(rig)}".rstrip()
    if now.value is not None and now.ci95 is None:
        where += " (too few frames for an interval)"
    return f"roll {answer(now)}{where}, {ok:,} ok, {rig.suspect:,} suspect, {rig.failed:,} failed"


def counts(rig: RigAssessment) -> str:
    """Return which frames the answer is from."""
    left_out = [
        f"{count:,} {what}"
        for count, what in (
            (rig.suspect, "suspect" + (", counted" if rig.include_suspect else "")),
            (rig.failed, "failed"),
            (rig.outliers, "far off their neighbours"),
        )
        if count
    ]
    return ", ".join([f"{rig.used:,} of {rig.count:,} frames", *left_out])


def now_in_words(rig: RigAssessment, quantity: Quantity = ROLL) -> str:
    """Return of which frames the answer is, where it is not of all: after a jump, or of the last drive."""
    drive = rig.latest_drive(quantity)
    if drive is None:
        return ""
    found = drive.quantities[quantity.name]
    if found.jumps:
        return f"since {rig.frames.files[drive.frames[found.jumps[-1].frame]]}"
    return f"in {drive.name}" if len(rig.drives) > 1 else ""


def findings(rig: RigAssessment) -> list[str]:
    """Return a sentence for each thing that is wrong: jumps, drift, drives that differ, too few frames."""
    sentences = []
    for place, drive in enumerate(rig.drives):
        if drive.differs:
            before = rig.drives[place - 1].name
            sentences.append(f"{drive.name} differs from {before} by {answer(drive.change, change=True)}")
        for quantity in QUANTITIES:
            found = drive.quantities.get(quantity.name)
            if found is not None:
                sentences += _of_one(rig, drive, quantity, found)
    return sentences


def _of_one(
    rig: RigAssessment, drive: DriveAssessment, quantity: Quantity, found: SequenceAssessment
) -> Iterator[str]:
    """Return the sentences of one quantity of one drive."""
    where = f" of {drive.name}" if len(rig.drives) > 1 and drive.name else ""
    for jump in found.jumps:
        file = rig.frames.files[drive.frames[jump.frame]]
        yield f"{quantity.name} jumped by {answer(jump.change, quantity, change=True)} at {file}"
    if found.drifts:
        yield f"{quantity.name}{where} drifted by {answer(found.drift, quantity, change=True)} over the drive"
    if found.now.ci95 is None:
        yield f"no interval for the {quantity.name}{where}: {too_few(found)}"


def too_few(found: SequenceAssessment) -> str:
    """Return why there is no interval, and what it would take."""
    if not found.used:
        return "no frame counts"
    last = found.segments[-1]
    frames = last.last - last.first + 1
    since = " since the last jump" if found.jumps else ""
    holds = "frame" if frames == 1 else "frames"
    return (
        f"{frames:,} {holds}{since}, and about {last.mean.needed:,} are needed for "
        f"{TUNING.fewest_blocks} independent blocks of frames"
    )
