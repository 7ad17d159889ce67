"""How the views of a pair lie over a drive, and whether the rig is what it should be.

There is a check for each thing that was asked. It is told when all that the interval allows lies on one side
of its limit.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rollcli.errors import ExitStatus, UsageError
from rollcli.messages import counted, listed
from rollcli.rig.calibration import Calibration, for_matched
from rollcli.rig.drive.assess import DriveAssessment, RigAssessment, difference
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.drive.quantity import SequenceAssessment
from rollcli.rig.quantities import ALIGNMENT, HEIGHT, PITCH, ROLL, SIZE, Quantity
from rollcli.rig.words import answer, frame_name, too_few
from rollcli.run.options import GateOptions
from rollcli.stereo.misalignment import Misalignment

PIXELS = Quantity("shift", "", "", " px", "px")
NOT_SEEN = "not seen in rows: constant vergence and baseline"
DISTANCES = (10, 20, 50)  # m


@dataclass(frozen=True, slots=True)
class HealthTuning:
    """Limits between verdicts, with what is seen of rendered pairs.

    Attributes
    ----------
    level : float
        Largest vertical shift in the image of views that are level, px. Level rendered pairs measure up to
        0.2.
    enough : float
        Largest one that rollcli corrects without a loss, px; matchers without correction lose a quarter of a
        degree of roll from half a pixel on.
    roll_per_px : float
        By how much a road turns at most for a vertical shift of one pixel that nobody corrects, degrees.
    """

    level: float = 0.3
    enough: float = 1.0
    roll_per_px: float = 0.5


TUNING = HealthTuning()


@dataclass(frozen=True, slots=True)
class Health:
    """How the right view lies over the last drive that has pairs.

    Attributes
    ----------
    frames : int
        Pairs that were measured, since the last jump.
    parts : tuple of Estimate
        In the order of `ALIGNMENT`: px, degrees, per cent, px in the corners.
    size : tuple of int
        Width and height of the views, px.
    reach : Estimate
        The largest vertical shift in the image, px.
    calibration : Calibration or None
    """

    frames: int
    parts: tuple[Estimate, ...]
    size: tuple[int, int]
    reach: Estimate
    calibration: Calibration | None = None

    @property
    def misalignment(self) -> Misalignment:
        """The parts as the views are levelled by."""
        width, height = self.size
        return Misalignment.of_values([each.value or 0.0 for each in self.parts], height, width)

    @property
    def axis(self) -> tuple[float, float]:
        """The right view's principal point from the middle, px; the middle where there is no calibration."""
        return (0.0, 0.0) if self.calibration is None else self.calibration.right_axis(*self.size)

    @property
    def verdict(self) -> str:
        """One of three: level, level enough for rollcli, recalibrate; by the shift that is surely there."""
        surely = (self.reach.value or 0.0) - (self.reach.ci95 or 0.0)
        if surely <= TUNING.level:
            return "level"
        return "level enough for rollcli" if surely <= TUNING.enough else "recalibrate"

    def depth_percent(self, distance: float) -> float | None:
        """Return by how much depth errs at a distance, per cent; None without a baseline.

        Notes
        -----
        A disparity that errs by e puts a point at Z off by Z e / (f B) of its depth. A right view that is
        turned or larger moves points along the rows too, most in the corners.
        """
        if self.calibration is None or self.calibration.baseline is None:
            return None
        width, height = self.size
        lies = self.misalignment
        shift = abs(lies.rotation) * height / 2 + abs(lies.scale) * width / 2
        return 100 * distance * shift / (self.calibration.fx * self.calibration.baseline)

    @property
    def summary(self) -> str:
        """The verdict, with how far the right view is off."""
        off = answer(self.reach, PIXELS).lstrip("+")
        return f"{self.verdict}: up to {off} off in the image ({counted(self.frames, 'pair')})"

    @property
    def effect(self) -> str:
        """What the misalignment would do to the roll, and to depth where a calibration tells."""
        turned = TUNING.roll_per_px * (self.reach.value or 0.0)
        percents = {each: self.depth_percent(each) for each in DISTANCES}
        depths = [f"{off:.1f} % at {each} m" for each, off in percents.items() if off is not None]
        depth = f" and depth in the corners would err by {', '.join(depths)}" if depths else ""
        return f"uncorrected, it would turn the roll by up to {turned:.2f}°{depth}"

    def table(self) -> list[tuple[str, str]]:
        """Return what each part is called, and its value with its interval."""
        words = ("px lower", "degrees clockwise", "% larger", "px twisted in the corners")
        values = (answer(each, PIXELS).removesuffix(" px") for each in self.parts)
        return list(zip(words, values, strict=True))

    def lines(self) -> list[str]:
        """Return the sentences of the table and of stderr."""
        parts = [f"{value} {what}" for what, value in self.table()]
        return [
            f"pair    {self.summary}",
            f"        the right view lies {', '.join(parts)}",
            f"        {self.effect}; {NOT_SEEN}",
        ]


def health_of(
    rig: RigAssessment, calibration: Calibration | None = None, downscale: float = 1.0
) -> Health | None:
    """Return the health of the pair as it is at the end; None where no pair was measured.

    Parameters
    ----------
    rig : RigAssessment
    calibration : Calibration or None
    downscale : float
        The pairs were matched at 1/downscale of their size.

    Raises
    ------
    UsageError
        The calibration is of another view: see `Calibration.for_size`.
    """
    drive = rig.latest_drive(ALIGNMENT[0])
    found = None if drive is None else _measured(rig, drive)
    if found is None:
        return None
    quantities, size = found
    parts = tuple(each.now for each in quantities)
    if calibration is not None:
        calibration = for_matched(calibration, *size, downscale)
    used = min(each.segments[-1].used for each in quantities)  # after the last jump of any
    return Health(used, parts, size, _reach(parts, *size), calibration)


def _measured(
    rig: RigAssessment, drive: DriveAssessment
) -> tuple[list[SequenceAssessment], tuple[int, int]] | None:
    """Return how the right view lies over a drive, and the size of its views, px; None without pairs."""
    found = [drive.quantities[each.name] for each in ALIGNMENT if each.name in drive.quantities]
    if len(found) < len(ALIGNMENT) or any(each.now.value is None for each in found):
        return None
    sizes = [rig.frames.column(name)[drive.frames] for name in SIZE]
    if any(not np.isfinite(each).any() for each in sizes):
        return None
    width, height = (int(each[np.isfinite(each)][-1]) for each in sizes)
    return found, (width, height)


def _reach(parts: Sequence[Estimate], width: int, height: int) -> Estimate:
    """Return the largest shift of the four corners, its interval that of a sum of independent parts."""
    values = [each.value or 0.0 for each in parts]
    value = Misalignment.of_values(values, height, width).reach(height, width)
    halves = [each.ci95 for each in parts if each.ci95 is not None]
    if len(halves) < len(parts):
        return Estimate(value)
    shifts = Misalignment.of_values(halves, height, width).shifts(height, width)
    return Estimate(value, math.hypot(*shifts))


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was asked of the rig.

    Attributes
    ----------
    name : str
        The option that asked.
    ok : bool or None
        True or False where all that the interval allows lies on one side; None where it cannot be told.
    message : str
        What was found, and of which frames.
    """

    name: str
    ok: bool | None
    message: str


def check_options(gates: GateOptions) -> None:
    """Refuse expectations without a tolerance.

    Raises
    ------
    UsageError
        Says what to give.
    """
    angles = gates.expect_roll is not None or gates.expect_pitch is not None
    if angles and gates.within is None:
        raise UsageError("--expect-roll and --expect-pitch need --within DEG")
    if gates.expect_height is not None and gates.within is None and gates.within_height is None:
        raise UsageError("--expect-height needs --within-height M")
    if gates.within is not None and not angles and gates.expect_height is None:
        raise UsageError("--within needs --expect-roll, --expect-pitch or --expect-height")
    if gates.within_height is not None and gates.expect_height is None:
        raise UsageError("--within-height needs --expect-height")


def run_checks(
    rigs: Sequence[RigAssessment], gates: GateOptions, missing: str = "", change: Estimate | None = None
) -> list[Check]:
    """Check what was asked; want of data tells nothing.

    Parameters
    ----------
    rigs : sequence of RigAssessment
        That of the results, and of a later one; every one of them must pass.
    gates : GateOptions
    missing : str
        Why frames of the run are not there; empty when all are.
    change : Estimate or None
        Of the roll, against the later result.

    Returns
    -------
    list of Check
        In the order of the options.
    """
    checks = list(_checks(rigs, gates, change))
    return [Check("complete", None, missing), *checks] if checks and missing else checks


def status_of(checks: Sequence[Check]) -> ExitStatus:
    """Return the exit status of all checks."""
    states = {check.ok for check in checks}
    if False in states:
        return ExitStatus.CHECK_FAILED
    return ExitStatus.UNTOLD if None in states else ExitStatus.DONE


_Told = tuple[bool | None, str]  # `ok` and `message` of a check


def _checks(rigs: Sequence[RigAssessment], gates: GateOptions, change: Estimate | None) -> Iterator[Check]:
    def over_drives(told: Callable[..., Iterator[_Told]], *asked: Any) -> list[_Told]:
        return [each for rig in rigs for drive in rig.drives for each in told(rig, drive, *asked)]

    height = gates.within if gates.within_height is None else gates.within_height
    for quantity, wanted, within in (
        (ROLL, gates.expect_roll, gates.within),
        (PITCH, gates.expect_pitch, gates.within),
        (HEIGHT, gates.expect_height, height),
    ):
        if wanted is not None and within is not None:
            yield _worst(f"expect-{quantity.name}", over_drives(_expected, quantity, wanted, within))
    if gates.max_drift is not None:
        yield _worst("max-drift", over_drives(_drift, gates.max_drift))
    if gates.max_jump is not None:
        jumps = over_drives(_jumps, gates.max_jump)
        if change is not None:
            jumps.append(_limited("change against the other result", change, gates.max_jump))
        yield _worst("max-jump", jumps)
    if gates.max_misalignment is not None:
        yield _worst("max-misalignment", over_drives(_shifts, gates.max_misalignment))
    if gates.min_ok is not None:
        yield _worst("min-ok", [_share(rig, gates.min_ok) for rig in rigs])


def _worst(name: str, told: Sequence[_Told]) -> Check:
    """All drives of all results as one check: what is violated, or else what cannot be told."""
    for state in (False, None):
        chosen = dict.fromkeys(message for ok, message in told if ok is state)
        if chosen:
            return Check(name, state, "; ".join(chosen))
    return Check(name, *(told[-1] if told else (None, "there are no frames")))


def _expected(
    rig: RigAssessment, drive: DriveAssessment, quantity: Quantity, wanted: float, within: float
) -> Iterator[_Told]:
    """Tell of the last segment, and where it drifts of each of its ends."""
    found = drive.quantities.get(quantity.name)
    if found is None or not found.used:
        yield None, f"the {quantity.name} of {_frames(rig, drive)} is unknown: no frame that counts has one"
        return
    for frames, (value,) in _ends(rig, drive, [found]):
        of = "at" if found.drifts else "of"
        what = f"the {quantity.name} {of} {frames} is {answer(value, quantity)}"
        limit = f"{within:g}{quantity.unit} from {wanted:g}{quantity.unit}"
        off = difference(Estimate(wanted, 0.0), value, quantity)
        yield _compared(what, off, within, limit, too_few(found, quantity))


def _ends(
    rig: RigAssessment, drive: DriveAssessment, found: Sequence[SequenceAssessment]
) -> Iterator[tuple[str, list[Estimate]]]:
    """Yield the frames since the last jump, and what they say; where anything drifts, each end of them."""
    last = [each.segments[-1] for each in found]
    first, end = max(each.first for each in last), last[0].last
    if any(each.drifts for each in found):
        yield _frames(rig, drive, first, first), [each.begin for each in last]
        yield _frames(rig, drive, end, end), [each.end for each in last]
    else:
        yield _frames(rig, drive, first, end), [each.mean for each in last]


def _compared(what: str, found: Estimate, most: float, limit: str, why: str) -> _Told:
    """Compare with a limit how large an estimate is, either way; `why`: it may have no interval."""
    if found.value is None or found.ci95 is None:
        return None, f"{what}: {why}"
    off = abs(found.value)
    if off + found.ci95 <= most:
        return True, f"{what}, at most {limit}"
    if off - found.ci95 > most:
        return False, f"{what}, more than {limit}"
    return None, f"{what}, which may be more or less than {limit}"


def _drift(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Iterator[_Told]:
    found = drive.quantities[ROLL.name]
    yield _limited(f"drift over {_frames(rig, drive)}", found.drift, limit, too_few(found))


def _jumps(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Iterator[_Told]:
    found = drive.quantities[ROLL.name]
    if drive.differs:
        what = f"change from the drive before to {frame_name(rig, drive, 0)}"
        yield _limited(what, drive.change, limit)
    for jump in found.jumps:
        yield _limited(f"jump at {frame_name(rig, drive, jump.frame)}", jump.change, limit)
    if found.jumps:
        return
    frames, settled = _frames(rig, drive), found.now.ci95 is not None
    if settled and found.searched:
        yield True, f"{frames} hold no jump {found.from_ends} frames or more from their ends"
    elif settled and (spread := np.ptp(found.series.values[found.series.used])) <= limit:
        yield True, f"the rolls of {frames} spread over {spread:.2f}°, at most {limit:g}°"
    else:
        yield None, f"the jumps of {frames}: {too_few(found)}"


def _limited(what: str, found: Estimate, limit: float, why: str = "too few frames") -> _Told:
    """Tell of a change that must not be larger than a limit."""
    return _compared(f"the {what} is {answer(found, change=True)}", found, limit, f"{limit:g}°", why)


def _shifts(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Iterator[_Told]:
    """Tell of the pairs since the last jump, and where they drift of each end."""
    measured = _measured(rig, drive)
    if measured is None:
        yield None, f"how the views of {_frames(rig, drive)} lie: no pair was measured"
        return
    quantities, size = measured
    for frames, parts in _ends(rig, drive, quantities):
        reach = _reach(parts, *size)
        what = f"the largest vertical shift between the views of {frames} is {answer(reach, PIXELS)}"
        yield _compared(what, reach, limit, f"{limit:g} px", "too few pairs for an interval")


def _share(rig: RigAssessment, least: float) -> _Told:
    ok = int(rig.frames.ok.sum())
    share = ok / rig.count if rig.count else 0.0
    of = f" of {rig.frames.origins[0]}" if len(set(rig.frames.origins)) == 1 else ""
    frames, are = counted(rig.count, "frame"), "is" if rig.count == 1 else "are"
    message = f"{ok:,} of {frames}{of} {are} ok, {100 * share:.4g} %"
    if rig.count and share >= least:
        return True, message
    others = [rig.names[place] for place in np.flatnonzero(~rig.frames.ok).tolist()]
    named = f"; not: {listed(others)}" if others else ""
    return False, f"{message}, fewer than {100 * least:.4g} %{named}"


def _frames(rig: RigAssessment, drive: DriveAssessment, first: int = 0, last: int = -1) -> str:
    """Frames by the names of the first and the last."""
    names = [frame_name(rig, drive, place) for place in (first, last)]
    return names[0] if names[0] == names[1] else f"{names[0]} to {names[1]}"
