"""Assessments made by hand, whose numbers are chosen."""

import numpy as np

from rollcli.rig.drive.assess import DriveAssessment, RigAssessment, RigFrames
from rollcli.rig.drive.noise import Estimate, Noise
from rollcli.rig.drive.quantity import Jump, Segment, SequenceAssessment

UNKNOWN = Estimate()


def known(value, half):
    """A value with its interval."""
    return Estimate(value, half, half / 2, 20.0)


def short(value, needed):
    """A value of too few frames for an interval."""
    return Estimate(value, needed=needed)


def sequence(count, *means, jumps=(), drift=UNKNOWN, drifts=False, values=None, used=None, outliers=0):
    """One quantity over `count` frames; `jumps` are frames with changes, between which the means hold."""
    bounds = [0, *(frame for frame, _ in jumps), count]
    segments = tuple(
        Segment(first, end - 1, end - first, mean)
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
        Noise(1.0, 0.0, 0.0, 1.0),
        np.zeros(count) if values is None else np.asarray(values, dtype=float),
        np.ones(count),
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
        RigFrames(files, ok, suspect, {}),
        sum(each.used for each in rolls),
        int(suspect.sum()),
        int((~ok & ~suspect).sum()),
        sum(each.outliers for each in rolls),
        include_suspect,
        tuple(made),
    )
