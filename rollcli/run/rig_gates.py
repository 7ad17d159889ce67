"""Whether the rig is what it should be: one check for each thing that was asked."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rollcli.errors import UsageError
from rollcli.files.naming import listed
from rollcli.rig.drive.assess import DriveAssessment, RigAssessment
from rollcli.rig.drive.noise import Estimate
from rollcli.rig.quantities import HEIGHT, PITCH, ROLL, Quantity
from rollcli.rig.words import answer, too_few
from rollcli.run.rig_options import GateOptions


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was asked of the rig.

    Attributes
    ----------
    name : str
        The option that asked.
    ok : bool
    message : str
        What was found, and of which frames.
    close : bool
        Whether the interval reaches across the limit: it could as well be the other way.
    """

    name: str
    ok: bool
    message: str
    close: bool = False


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
    rig: RigAssessment, gates: GateOptions, missing: str, change: Estimate | None = None
) -> list[Check]:
    """Check what was asked; want of data is a failure.

    Parameters
    ----------
    rig : RigAssessment
    gates : GateOptions
    missing : str
        Why frames of the run are not there; empty when all are.
    change : Estimate or None
        Of the roll, against a later result.

    Returns
    -------
    list of Check
        In the order of the options.
    """
    checks = list(_checks(rig, gates, change))
    if checks and missing:
        checks.insert(0, Check("complete", False, missing))
    return checks


def _checks(rig: RigAssessment, gates: GateOptions, change: Estimate | None) -> Iterator[Check]:
    height = gates.within if gates.within_height is None else gates.within_height
    for quantity, wanted, within in (
        (ROLL, gates.expect_roll, gates.within),
        (PITCH, gates.expect_pitch, gates.within),
        (HEIGHT, gates.expect_height, height),
    ):
        if wanted is not None and within is not None:
            yield _worst([_expected(rig, d, quantity, wanted, within) for d in rig.drives], quantity)
    if gates.max_drift is not None:
        yield _worst([_drift(rig, drive, gates.max_drift) for drive in rig.drives], ROLL)
    if gates.max_jump is not None:
        found = [_jumps(rig, drive, gates.max_jump) for drive in rig.drives]
        if change is not None:
            found.append(_limited("max-jump", "change against the other result", change, gates.max_jump))
        yield _worst(found, ROLL)
    if gates.min_ok is not None:
        yield _share(rig, gates.min_ok)


def _worst(checks: list[Check], quantity: Quantity) -> Check:
    """All drives as one check: the failures, or else what is close to one."""
    failed = [check for check in checks if not check.ok]
    chosen = failed or [check for check in checks if check.close] or checks[-1:]
    if not chosen:
        return Check(f"expect-{quantity.name}", False, "there are no frames")
    message = "; ".join(check.message for check in chosen)
    return Check(chosen[0].name, not failed, message, any(check.close for check in chosen))


def _expected(
    rig: RigAssessment, drive: DriveAssessment, quantity: Quantity, wanted: float, within: float
) -> Check:
    name = f"expect-{quantity.name}"
    found = drive.quantities.get(quantity.name)
    if found is None or not found.used:
        return Check(name, False, f"the {quantity.name} of {_frames(rig, drive)} is unknown: no frame counts")
    last = found.segments[-1]
    frames = _frames(rig, drive, last.first, last.last)
    if last.mean.ci95 is None or last.mean.value is None:
        return Check(name, False, f"the {quantity.name} of {frames} has no interval: {too_few(found)}")
    off = abs(last.mean.value - wanted)
    limit = f"{within:g}{quantity.unit} from {wanted:g}{quantity.unit}"
    close = abs(off - within) < last.mean.ci95
    said = "at most" if off <= within else "more than"
    message = f"the {quantity.name} of {frames} is {answer(last.mean, quantity)}, {said} {limit}"
    return Check(name, off <= within, message + _reaches(close), close)


def _drift(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Check:
    found = drive.quantities[ROLL.name]
    frames = _frames(rig, drive)
    if found.drift.ci95 is None:
        why = "no frame counts" if not found.used else f"it takes about {found.drift.needed:,} frames"
        return Check("max-drift", False, f"the drift over {frames} is unknown: {why}")
    return _limited("max-drift", f"drift over {frames}", found.drift, limit)


def _jumps(rig: RigAssessment, drive: DriveAssessment, limit: float) -> Check:
    found = drive.quantities[ROLL.name]
    frames = _frames(rig, drive)
    if not found.used:
        return Check("max-jump", False, f"the jumps of {frames} are unknown: no frame counts")
    if found.jumps:
        largest = max(found.jumps, key=lambda jump: abs(jump.change.value or 0.0))
        file = rig.frames.files[drive.frames[largest.frame]]
        return _limited("max-jump", f"jump at {file}", largest.change, limit)
    if found.now.ci95 is None:
        return Check("max-jump", False, f"the jumps of {frames} are unknown: {too_few(found)}")
    return Check("max-jump", True, f"{frames} hold no jump")


def _limited(name: str, what: str, found: Estimate, limit: float) -> Check:
    """Check a change that must not be larger than a limit."""
    if found.value is None or found.ci95 is None:
        return Check(name, False, f"the {what} has no interval: too few frames")
    size = abs(found.value)
    close = abs(size - limit) < found.ci95
    said = "at most" if size <= limit else "more than"
    message = f"the {what} is {answer(found, change=True)}, {said} {limit:g}°"
    return Check(name, size <= limit, message + _reaches(close), close)


def _share(rig: RigAssessment, least: float) -> Check:
    ok = int(rig.frames.ok.sum())
    share = ok / rig.count if rig.count else 0.0
    message = f"{ok:,} of {rig.count:,} frames are ok, {100 * share:.4g} %"
    if rig.count and share >= least:
        return Check("min-ok", True, message)
    others = [rig.frames.files[place] for place in np.flatnonzero(~rig.frames.ok).tolist()]
    named = f"; not: {listed(others)}" if others else ""
    return Check("min-ok", False, f"{message}, fewer than {100 * least:.4g} %{named}")


def _reaches(close: bool) -> str:
    return ", but its interval reaches across the limit" if close else ""


def _frames(rig: RigAssessment, drive: DriveAssessment, first: int = 0, last: int = -1) -> str:
    """Frames by the names of the first and the last."""
    names = [rig.frames.files[drive.frames[place]] for place in (first, last)]
    return names[0] if names[0] == names[1] else f"{names[0]} to {names[1]}"
