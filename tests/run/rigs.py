"""Assessments made by hand, whose numbers are chosen."""

import numpy as np

from rollcli.rig.drive.assess import DriveAssessment, RigAssessment, RigFrames
from rollcli.rig.drive.posterior import Estimate, Series
from rollcli.rig.drive.quantity import Jump, Segment, SequenceAssessment
from rollcli.rig.quantities import SIZE

UNKNOWN = Estimate()


def known(value, half):
    """A value with its interval."""
    return Estimate(value, half)


def short(value):
    """A value of too few frames for an interval."""
    return Estimate(value)


def sequence(count, *means, jumps=(), drift=UNKNOWN, drifts=False, values=None, used=None, outliers=0):
    """One quantity over `count` frames; `jumps` are frames with changes, between which the means hold."""
    bounds = [0, *(frame for frame, _ in jumps), count]
    segments = tuple(
        Segment(first, end - 1, end - first, mean, mean, mean)
        for first, end, mean in zip(bounds, bounds[1:], means, strict=False)
    )
    return SequenceAssessment(
        count,
        (count if means else 0) if used is None else used,
        outliers,
        segments,
        tuple(Jump(frame, change) for frame, change in jumps),
        drift,
        drifts,
        "jump" if jumps else "drift" if drifts else "stable" if means else "few",
        0.125,
        Series(
            np.zeros(count) if values is None else np.asarray(values, dtype=float),
            np.full(count, 0.01),
            np.ones(count, dtype=bool),
        ),
        1.0,
    )


def rig(*drives, changes=None, ok=None, suspect=None, include_suspect=False):
    """Drives by name, each with its quantities; frame 7 of the drive `a` is the file a/7."""
    files, made = [], []
    for place, (name, quantities) in enumerate(drives):
        count = quantities["roll"].frames
        change, differs = (changes or {}).get(name, (UNKNOWN, False))
        frames = np.arange(len(files), len(files) + count)
        made.append(DriveAssessment(name, frames, quantities, change, differs))
        files += [f"{name or place}/{each}" for each in range(count)]
    total = len(files)
    ok = np.ones(total, dtype=bool) if ok is None else np.asarray(ok)
    suspect = np.zeros(total, dtype=bool) if suspect is None else np.asarray(suspect)
    rolls = [quantities["roll"] for _, quantities in drives]
    return RigAssessment(
        RigFrames(files, ok, suspect, {name: np.full(total, 256.0) for name in SIZE}),
        sum(each.used for each in rolls),
        int(suspect.sum()),
        int((~ok & ~suspect).sum()),
        sum(each.outliers for each in rolls),
        include_suspect,
        tuple(made),
    )
