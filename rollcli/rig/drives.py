"""Which frames are one drive: those of one folder, unless the user says otherwise."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError

AUTO, NONE = "auto", "none"
_FRAMES_OF_A_DRIVE = 8  # folders of fewer frames on average are not drives but single frames


def split_drives(files: Sequence[str], groups: str = AUTO) -> list[tuple[str, NDArray[np.intp]]]:
    """Group frames into drives.

    Parameters
    ----------
    files : sequence of str
        Paths with "/" separators, in the order of the frames.
    groups : str
        "auto": frames of one folder are one drive, unless folders hold hardly a frame each; "none": all are
        one; else a pattern such as "data/run*": the folders that it matches are drives, with all below them.

    Returns
    -------
    list of (str, ndarray of int)
        Name and frames of each drive, in the order of their first frames.

    Raises
    ------
    UsageError
        The pattern matches no folder.
    """
    if groups == NONE or not files:
        return [("", np.arange(len(files)))] if files else []
    pattern = "" if groups == AUTO else groups
    folders = [file.rpartition("/")[0] for file in files]
    names = {folder: _matching(folder, pattern) if pattern else folder for folder in dict.fromkeys(folders)}
    if pattern and not any(_matches(folder, pattern) for folder in names):
        raise UsageError(f"--groups {groups}: matches no folder of the frames, such as {next(iter(names))}")
    drives = {name: number for number, name in enumerate(dict.fromkeys(names.values()))}
    if groups == AUTO and len(files) < _FRAMES_OF_A_DRIVE * len(drives):
        return [("", np.arange(len(files)))]
    of_folder = {folder: drives[name] for folder, name in names.items()}
    numbers = np.fromiter(map(of_folder.__getitem__, folders), np.intp, len(files))
    order = np.argsort(numbers, kind="stable")
    ends = np.searchsorted(numbers[order], np.arange(1, len(drives)))
    return list(zip(drives, np.split(order, ends), strict=True))


def _matching(folder: str, pattern: str) -> str:
    """Return the first folders of a path, as many as the pattern has, where they match; else all of them."""
    depth = len(PurePosixPath(pattern).parts)
    head = "/".join(PurePosixPath(folder).parts[:depth])
    return head if fnmatchcase(head, pattern.rstrip("/")) else folder


def _matches(folder: str, pattern: str) -> bool:
    depth = len(PurePosixPath(pattern).parts)
    return fnmatchcase("/".join(PurePosixPath(folder).parts[:depth]), pattern.rstrip("/"))
