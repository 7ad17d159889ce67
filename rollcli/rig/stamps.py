"""Frames of recordings: which recording a frame is of, and when it was taken, as its name says."""

import re
from collections.abc import Sequence
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray

# drive.mcap#/stereo/disparity@1700000000123456789, with .1 where a stamp is there twice; drive.mp4#000123
_FRAME = re.compile(
    r"(.*?\.(?:bag|db3|mcap|mp4|avi|mkv|mov))#(?:.*@([0-9]{1,20})(?:\.[0-9]+)?)?", re.IGNORECASE
)
_NS = 1e-9


def drive_of(file: str) -> str:
    """Return the recording that a frame is of, or its folder.

    The files into which rosbag2 splits a recording, ``run/run_0.mcap`` and so on, are one, the folder.
    """
    found = _FRAME.match(file) if "#" in file else None
    if found is None:
        return file.rpartition("/")[0]
    path = PurePosixPath(found[1])
    split = re.fullmatch(r"(.+)_[0-9]+", path.stem)
    return str(path.parent) if split is not None and split[1] == path.parent.name else found[1]


def seconds_of(files: Sequence[str]) -> NDArray[np.float64]:
    """Return when frames were taken, s since the first stamp, shape (N,); NaN for names without a stamp."""
    stamps = [_stamp(file) for file in files]
    first = next((each for each in stamps if each is not None), 0)
    return np.array([np.nan if each is None else (each - first) * _NS for each in stamps])


def _stamp(file: str) -> int | None:
    found = _FRAME.match(file) if "#" in file else None
    return None if found is None or found[2] is None else int(found[2])


def hours_between(seconds: NDArray[np.float64]) -> float | None:
    """Return how long frames took, hours; None where their names have no stamps, or these do not ascend."""
    known = seconds[np.isfinite(seconds)]
    if len(known) < 2 or known[-1] <= known[0]:
        return None
    return float(known[-1] - known[0]) / 3600
