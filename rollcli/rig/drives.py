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
    folders: dict[str, str] = {}
    members: dict[str, list[int]] = {}
    for place, file in enumerate(files):
        folder = file.replace("\\", "/").rpartition("/")[0]
        name = folders.get(folder)
        if name is None:
            name = folders[folder] = _matching(folder, pattern) if pattern else folder
        members.setdefault(name, []).append(place)
    if pattern and set(members) <= set(folders) and not any(_matches(folder, pattern) for folder in folders):
        raise UsageError(f"--groups {groups}: matches no folder of the frames, such as {next(iter(folders))}")
    if groups == AUTO and len(files) < _FRAMES_OF_A_DRIVE * len(members):
        return [("", np.arange(len(files)))]
    return [(name, np.array(places)) for name, places in members.items()]


def _matching(folder: str, pattern: str) -> str:
    """Return the first folders of a path, as many as the pattern has, where they match; else all of them."""
    depth = len(PurePosixPath(pattern).parts)
    head = "/".join(PurePosixPath(folder).parts[:depth])
    return head if fnmatchcase(head, pattern.rstrip("/")) else folder


def _matches(folder: str, pattern: str) -> bool:
    depth = len(PurePosixPath(pattern).parts)
    return fnmatchcase("/".join(PurePosixPath(folder).parts[:depth]), pattern.rstrip("/"))
