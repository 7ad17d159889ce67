"""An assessment in words: what people read in the table, on stderr and on the page."""

import math
from collections.abc import Iterator

import numpy as np

from rollcli.messages import counted, listed
from rollcli.rig.drive.assess import DriveAssessment, RigAssessment
from rollcli.rig.drive.posterior import TUNING, Estimate
from rollcli.rig.drive.quantity import SequenceAssessment
from rollcli.rig.quantities import ALIGNMENT, HEIGHT, QUANTITIES, ROLL, Quantity

# a thousandth of a degree or of a metre is below what any calibration is worth
_FEWEST_DIGITS, _MOST_DIGITS = 2, 3


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
    half = "" if estimate.ci95 is None else f" {plus_or_minus(estimate.ci95)}"
    return f"{text}{half}{quantity.unit}"


def plus_or_minus(half: float) -> str:
    """Return the half-width of an interval, such as "± 0.06"; what is hardly any is never said to be none."""
    digits = decimals(half)
    return f"± {max(half, 10.0**-digits):.{digits}f}"


def decimals(half: float | None) -> int:
    """Return as many decimals as the half-width of an interval is worth: two where there is none."""
    if half is None or not half > 0:
        return _FEWEST_DIGITS
    return min(_MOST_DIGITS, max(_FEWEST_DIGITS, -math.floor(math.log10(half))))


def one_line(rig: RigAssessment) -> str:
    """Return the answer in one line: `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
    ok = int(rig.frames.ok.sum())
    drive, now = rig.latest_drive(), rig.now()
    where = f" {now_in_words(rig)}".rstrip()
    if drive is not None and now.ci95 is None:
        where += f" ({too_few(drive.quantities[ROLL.name])})"
    others = [each for each in rig.drives if each is not drive and each.quantities[ROLL.name].used]
    if any(each.differs for each in rig.drives):
        named = [f"{answer(each.quantities[ROLL.name].now)} in {rig.name_of(each)}" for each in others]
        where += f"; the drives differ: {listed(named)}"
    return f"roll {answer(now)}{where}, {ok:,} ok, {rig.suspect:,} suspect, {rig.failed:,} failed"


def counts(rig: RigAssessment) -> str:
    """Return which frames the answer is from."""
    left_out = {
        "suspect" + (", counted" if rig.include_suspect else ""): rig.suspect,
        "failed": rig.failed,
        "far off their neighbours": rig.outliers,
    }
    others = (f"{count:,} {what}" for what, count in left_out.items() if count)
    return ", ".join([f"{rig.used:,} of {counted(rig.count, 'frame')}", *others])


def now_in_words(rig: RigAssessment, quantity: Quantity = ROLL) -> str:
    """Return of which frames the answer is, where it is not of all: after a jump, a drift, or of a drive."""
    drive = rig.latest_drive(quantity)
    if drive is None:
        return ""
    found = drive.quantities[quantity.name]
    words = []
    if found.jumps:
        jump = found.jumps[-1]
        change = answer(jump.change, quantity, change=True)
        words.append(f"since {frame_name(rig, drive, jump.frame)}, where it jumped by {change}")
    elif len(rig.drives) > 1:
        words.append(f"in {rig.name_of(drive)}" if drive.name else "")
    if found.drifts:
        words.append(f"at the end, after a drift of {drift_in_words(rig, drive, quantity)}")
    return ", ".join(filter(None, words))


def drift_in_words(
    rig: RigAssessment, drive: DriveAssessment, quantity: Quantity = ROLL, over: str = "the drive"
) -> str:
    """Return a drift over its drive and, where names have stamps, an hour."""
    whole = f"{answer(drive.quantities[quantity.name].drift, quantity, change=True)} over {over}"
    hourly = rig.drift_per_hour(drive, quantity)
    return whole if hourly.value is None else f"{whole}, {answer(hourly, quantity, change=True)} an hour"


def frame_name(rig: RigAssessment, drive: DriveAssessment, place: int) -> str:
    """Name a frame of a drive, without the folders common to all, and with its result where several are."""
    frame = int(drive.frames[place])
    return rig.names[frame] + (f" ({rig.frames.origins[frame]})" if rig.frames.origins else "")


def findings(rig: RigAssessment, *, roll: bool = True) -> list[str]:
    """Return a sentence for each thing that is wrong: jumps, drift, drives that differ, too few frames.

    Parameters
    ----------
    rig : RigAssessment
    roll : bool
        Whether to say the jumps and drifts of the roll too, which the table has already.
    """
    sentences, before = [], ""
    for drive in rig.drives:
        name = rig.name_of(drive)
        if drive.differs:
            sentences.append(f"{name} differs from {before} by {answer(drive.change, change=True)}")
        before = name if drive.quantities[ROLL.name].used else before
        where = f" of {name}" if len(rig.drives) > 1 and drive.name else ""
        for quantity in (*QUANTITIES, *ALIGNMENT):
            found = drive.quantities.get(quantity.name)
            if found is None:
                continue
            told = roll or quantity is not ROLL
            for jump in found.jumps if told else ():
                change, at = answer(jump.change, quantity, change=True), frame_name(rig, drive, jump.frame)
                sentences.append(f"{quantity.name} jumped by {change} at {at}")
            if found.drifts and told:
                sentences.append(f"{quantity.name}{where} drifted by {drift_in_words(rig, drive, quantity)}")
    return [*sentences, *_without_interval(rig)]


def _without_interval(rig: RigAssessment) -> Iterator[str]:
    """Yield a sentence for each quantity of which drives have no interval."""
    for quantity in QUANTITIES:
        drives = [drive for drive in rig.drives if quantity.name in drive.quantities]
        short = [drive for drive in drives if drive.quantities[quantity.name].now.ci95 is None]
        names = [name for drive in short if len(rig.drives) > 1 and (name := rig.name_of(drive))]
        of = f" of {listed(names)}" if names else ""
        if len(short) == 1:
            why = too_few(short[0].quantities[quantity.name], quantity)
        else:
            why = f"an interval takes {TUNING.fewest} frames that count"
        if short:
            yield f"no interval for the {quantity.name}{of}: {why}"


def too_few(found: SequenceAssessment, quantity: Quantity = ROLL) -> str:
    """Return why a quantity has no interval, or no jumps, and how far the frames spread."""
    if not found.used:
        return "no frame counts"
    if found.used == 1:
        return "a single frame"
    spread = f"{np.ptp(found.series.values[found.series.used]):.2f}{quantity.unit}"
    none = found.now.ci95 is None
    takes = f"an interval takes {TUNING.fewest}" if none else f"a jump takes {TUNING.searched}"
    return f"{found.used:,} frames, which spread over {spread}; {takes}"
