"""Whether the rig is what it should be: one check for each thing that was asked.

A check is told when all that the interval allows lies on one side of its limit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rollcli.errors import ExitStatus, UsageError
from rollcli.files.naming import listed
from rollcli.rig.drive.assess import DriveAssessment, RigAssessment
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.quantities import HEIGHT, PITCH, ROLL, Quantity
from rollcli.rig.words import answer, frame_name, too_few
from rollcli.run.options import GateOptions
from rollcli.run.rig_health import PIXELS, Health


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
    rig: RigAssessment,
    gates: GateOptions,
    missing: str = "",
    change: Estimate | None = None,
    health: Health | None = None,
) -> list[Check]:
    """Check what was asked; want of data tells nothing.

    Parameters
    ----------
    rig : RigAssessment
    gates : GateOptions
    missing : str
        Why frames of the run are not there; empty when all are.
    change : Estimate or None
        Of the roll, against a later result.
    health : Health or None
        How the views of its pairs lie; None where there are none.

    Returns
    -------
    list of Check
        In the order of the options.
    """
    checks = list(_checks(rig, gates, change, health))
    if checks and missing:
        checks.insert(0, Check("complete", None, missing))
    return checks


def status_of(checks: Sequence[Check]) -> ExitStatus:
    """Return the exit status of all checks."""
    states = {check.ok for check in checks}
    if False in states:
        return ExitStatus.CHECK_FAILED
    return ExitStatus.UNTOLD if None in states else ExitStatus.DONE


def _checks(
    rig: RigAssessment, gates: GateOptions, change: Estimate | None, health: Health | None
) -> Iterator[Check]:
    height = gates.within if gates.within_height is None else gates.within_height
    for quantity, wanted, within in (
        (ROLL, gates.expect_roll, gates.within),
        (PITCH, gates.expect_pitch, gates.within),
        (HEIGHT, gates.expect_height, height),
    ):
        if wanted is not None and within is not None:
            name = f"expect-{quantity.name}"
            found = [_expected(rig, d, quantity, wanted, within) for d in rig.drives]
            yield _worst(name, [check for each in found for check in each])
    if gates.max_drift is not None:
        yield _worst("max-drift", [_drift(rig, drive, gates.max_drift) for drive in rig.drives])
    if gates.max_jump is not None:
        jumps = [_jumps(rig, drive, gates.max_jump) for drive in rig.drives]
        if change is not None:
            jumps.append(_limited("max-jump", "change against the other result", change, gates.max_jump))
        yield _worst("max-jump", jumps)
    if gates.max_misalignment is not None:
        yield _misalignment(health, gates.max_misalignment)
    if gates.min_ok is not None:
        yield _share(rig, gates.min_ok)


def _worst(name: str, checks: list[Check]) -> Check:
    """All drives as one check: what is violated, or else what cannot be told."""
    for state in (False, None):
        chosen = [check for check in checks if check.ok is state]
        if chosen:
            return Check(name, state, "; ".join(dict.fromkeys(check.message for check in chosen)))
    return checks[-1] if checks else Check(name, None, "there are no frames")


def _expected(
    rig: RigAssessment, drive: DriveAssessment, quantity: Quantity, wanted: float, within: float
) -> Iterator[Check]:
    """Yield a check of the last segment, and where it drifts one of each of its ends."""
    name = f"expect-{quantity.name}"
    found = drive.quantities.get(quantity.name)
    if found is None or not found.used:
        frames = _frames(rig, drive)
        yield Check(name, None, f"the {quantity.name} of {frames} is unknown: no frame counts")
        return
    last = found.segments[-1]
    if found.drifts:
        ends = [
            (_frames(rig, drive, at, at), value)
            for at, value in ((last.first, last.begin), (last.last, last.end))
        ]
    else:
        ends = [(_frames(rig, drive, last.first, last.last), last.mean)]
    for frames, value in ends:
        limit = f"{within:g}{quantity.unit} from {wanted:g}{quantity.unit}"
        what = f"the {quantity.name} {'at' if found.drifts else 'of'} {frames} is {answer(value, quantity)}"
        if value.ci95 is None or value.value is None:
            yield Check(name, None, f"{what}: {too_few(found)}")
        else:
            off = abs(value.value - wanted)
            yield _told(name, what, off, value.ci95, within, limit)


def _told(name: str, what: str, size: float, half: float, most: float, limit: str) -> Check:
    """Compare a size and its half-width with a limit."""
    if size + half <= most:
        return Check(name, True, f"{what}, at most {limit}")
    if size - half > most:
        return Check(name, False, f"{what}, more than {limit}")
    return Check(name, None, f"{what}, which may be more or less than {limit}")


def _drift(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Check:
    found = drive.quantities[ROLL.name]
    return _limited("max-drift", f"drift over {_frames(rig, drive)}", found.drift, limit, too_few(found))


def _jumps(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Check:
    found, name = drive.quantities[ROLL.name], "max-jump"
    frames = _frames(rig, drive)
    if not found.jumps:
        if found.now.ci95 is None:
            return Check(name, None, f"the jumps of {frames}: {too_few(found)}")
        return Check(name, True, f"{frames} hold no jump")
    checks = [
        _limited(name, f"jump at {frame_name(rig, drive, jump.frame)}", jump.change, limit)
        for jump in found.jumps
    ]
    return _worst(name, checks)


def _limited(name: str, what: str, found: Estimate, limit: float, why: str = "too few frames") -> Check:
    """Check a change that must not be larger than a limit."""
    if found.value is None or found.ci95 is None:
        return Check(name, None, f"the {what}: {why}")
    said = f"the {what} is {answer(found, change=True)}"
    return _told(name, said, abs(found.value), found.ci95, limit, f"{limit:g}°")


def _misalignment(health: Health | None, limit: float) -> Check:
    name = "max-misalignment"
    if health is None:
        return Check(name, None, "how the views lie: no pair was measured")
    reach = health.reach
    what = f"the largest vertical shift between the views is {answer(reach, PIXELS)}"
    if reach.value is None or reach.ci95 is None:
        return Check(name, None, f"{what}: too few pairs for an interval")
    return _told(name, what, reach.value, reach.ci95, limit, f"{limit:g} px")


def _share(rig: RigAssessment, least: float) -> Check:
    ok = int(rig.frames.ok.sum())
    share = ok / rig.count if rig.count else 0.0
    message = f"{ok:,} of {rig.count:,} frames are ok, {100 * share:.4g} %"
    if rig.count and share >= least:
        return Check("min-ok", True, message)
    others = [rig.names[place] for place in np.flatnonzero(~rig.frames.ok).tolist()]
    named = f"; not: {listed(others)}" if others else ""
    return Check("min-ok", False, f"{message}, fewer than {100 * least:.4g} %{named}")


def _frames(rig: RigAssessment, drive: DriveAssessment, first: int = 0, last: int = -1) -> str:
    """Frames by the names of the first and the last."""
    names = [frame_name(rig, drive, place) for place in (first, last)]
    return names[0] if names[0] == names[1] else f"{names[0]} to {names[1]}"
