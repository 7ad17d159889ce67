"""What drives say about the rig: each drive and each quantity, and what changed from drive to drive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError
from rollcli.rig.drive.noise import Estimate, Flags, Floats, t_quantile, with_interval
from rollcli.rig.drive.quantity import SequenceAssessment, assess_sequence
from rollcli.rig.quantities import COLUMNS, QUANTITIES, ROLL, Quantity

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


_TO_SD = 1 / 1.959963984540054


@dataclass(frozen=True, slots=True, eq=False)
class RigFrames:
    """The frames of a result, as columns.

    Attributes
    ----------
    files : sequence of str
    ok, suspect : ndarray of bool, shape (N,)
        A frame that is neither has failed.
    numbers : mapping of str to ndarray of float, shape (N,)
        `roll_deg`, `roll_ci95_deg` and so on; NaN where there is nothing. Columns may be missing.
    """

    files: Sequence[str]
    ok: Flags
    suspect: Flags
    numbers: Mapping[str, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class DriveAssessment:
    """One drive.

    Attributes
    ----------
    name : str
        Its folder; empty when all frames are one drive.
    frames : ndarray of int
        Its frames among all, from 0.
    quantities : mapping of str to SequenceAssessment
        "roll", and "pitch" and "height" where the result has them. Their frames count within the drive.
    change : Estimate
        By how much its first segment's roll is more than the last one's of the drive before.
    differs : bool
        Whether that is more than chance, with as many comparisons as there are.
    """

    name: str
    frames: NDArray[np.intp]
    quantities: Mapping[str, SequenceAssessment]
    change: Estimate = field(default_factory=Estimate)
    differs: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RigAssessment:
    """What the frames of a result say about the rig.

    Attributes
    ----------
    frames : RigFrames
    used : int
        Frames whose roll counts.
    suspect, failed : int
    outliers : int
        Frames called ok whose roll is far off their neighbours'; left out.
    include_suspect : bool
    drives : tuple of DriveAssessment
        In order; the last one is the rig as it is now.
    """

    frames: RigFrames
    used: int
    suspect: int
    failed: int
    outliers: int
    include_suspect: bool
    drives: tuple[DriveAssessment, ...]

    @property
    def count(self) -> int:
        """How many frames there are."""
        return len(self.frames.files)

    def latest_drive(self, quantity: Quantity = ROLL) -> DriveAssessment | None:
        """Return the last drive in which a quantity has any value, or None."""
        for drive in reversed(self.drives):
            found = drive.quantities.get(quantity.name)
            if found is not None and found.used:
                return drive
        return None

    def latest(self, quantity: Quantity = ROLL) -> SequenceAssessment | None:
        """Return the assessment of a quantity in the last drive in which it has any value, or None."""
        drive = self.latest_drive(quantity)
        return None if drive is None else drive.quantities[quantity.name]

    def now(self, quantity: Quantity = ROLL) -> Estimate:
        """Return the rig as it is: the mean of the last segment of the last drive."""
        found = self.latest(quantity)
        return found.now if found is not None else Estimate()


def assess_rig(rows: Any, *, include_suspect: bool = False, groups: str = AUTO) -> RigAssessment:
    """Assess how a rig is mounted, whether it drifts, and when it jumped.

    Parameters
    ----------
    rows : sequence of rows, or columns
        What `rollcli estimate` wrote: rows as mappings or as objects with attributes; or columns by name, as
        a dict of sequences or a DataFrame. Needed are `roll_deg` and `status`; used where they are there:
        `file`, `roll_ci95_deg`, `pitch_deg`, `pitch_ci95_deg`, `height_m`, `height_ci95_m`. Degrees and
        metres; None or NaN where there is nothing. In the order in which the frames were taken.
    include_suspect : bool
        Let suspect frames count too.
    groups : str
        "auto": frames of one folder are one drive; "none": all are one drive; else a pattern of folders.

    Returns
    -------
    RigAssessment

    Raises
    ------
    UsageError
        A column is missing, or columns differ in length.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> rolls = np.append(rng.normal(0.2, 0.1, 300), rng.normal(1.0, 0.1, 300))
    >>> rig = assess_rig({"roll_deg": rolls, "status": ["ok"] * 600})
    >>> [jump.frame for jump in rig.latest().jumps], round(rig.now().value, 1)
    ([300], 1.0)
    """
    return assess_frames(_frames(rows), include_suspect=include_suspect, groups=groups)


def assess_frames(frames: RigFrames, *, include_suspect: bool = False, groups: str = AUTO) -> RigAssessment:
    """Assess frames that are columns already; see `assess_rig`."""
    counted = frames.ok | frames.suspect if include_suspect else frames.ok
    drives: list[DriveAssessment] = []
    for name, places in split_drives(frames.files, groups):
        found = {
            quantity.name: _assessed(frames, places, counted, quantity)
            for quantity in QUANTITIES
            if quantity is ROLL or np.isfinite(frames.numbers.get(quantity.column, np.empty(0))).any()
        }
        drives.append(DriveAssessment(name, places, found))
    rolls = [drive.quantities[ROLL.name] for drive in drives]
    return RigAssessment(
        frames,
        used=sum(each.used for each in rolls),
        suspect=int(frames.suspect.sum()),
        failed=int((~(frames.ok | frames.suspect)).sum()),
        outliers=sum(each.outliers for each in rolls),
        include_suspect=include_suspect,
        drives=_compared(drives),
    )


def difference(before: Estimate, after: Estimate) -> Estimate:
    """How much larger `after` is, with Welch's degrees of freedom; no interval where one of them has none."""
    if before.value is None or after.value is None:
        return Estimate()
    change = after.value - before.value
    if before.error is None or after.error is None:
        return Estimate(change, needed=max(before.needed, after.needed))
    squares = (before.error**2, after.error**2)
    parts = squares[0] ** 2 / before.freedom + squares[1] ** 2 / after.freedom
    freedom = sum(squares) ** 2 / parts if parts > 0 else min(before.freedom, after.freedom)
    return with_interval(change, math.sqrt(sum(squares)), freedom)


def _assessed(
    frames: RigFrames, places: NDArray[np.intp], counted: Flags, quantity: Quantity
) -> SequenceAssessment:
    """One quantity of one drive."""
    nothing = np.full(len(frames.files), np.nan)
    values = np.where(counted, frames.numbers.get(quantity.column, nothing), np.nan)[places]
    halves = frames.numbers.get(quantity.ci_column, nothing)[places]
    if quantity is ROLL:
        values = _unwrapped(values)
    return assess_sequence(values, halves * _TO_SD)


def _unwrapped(rolls: Floats) -> Floats:
    """Bring all within 90 degrees of the middle one: -89 and 89 degrees are two degrees apart."""
    twice = np.radians(2 * rolls[np.isfinite(rolls)])
    if not len(twice) or np.abs(twice).max() < math.pi / 2:
        return rolls
    middle = math.degrees(math.atan2(np.median(np.sin(twice)), np.median(np.cos(twice)))) / 2
    return middle + (rolls - middle + 90) % 180 - 90


def _compared(drives: Sequence[DriveAssessment]) -> tuple[DriveAssessment, ...]:
    """Each drive with how much its roll differs from the drive before it that has one."""
    result: list[DriveAssessment] = []
    before = Estimate()
    chance = 0.05 / max(1, len(drives) - 1)
    for drive in drives:
        roll = drive.quantities[ROLL.name]
        first = roll.segments[0].mean if roll.segments else Estimate()
        change = difference(before, first)
        wide = t_quantile(change.freedom, chance) * change.error if change.error is not None else math.inf
        differs = change.value is not None and abs(change.value) > wide
        result.append(DriveAssessment(drive.name, drive.frames, drive.quantities, change, differs))
        before = roll.now if roll.now.value is not None else before
    return tuple(result)


def _frames(rows: Any) -> RigFrames:
    """Columns of whatever was given."""
    column = _columns_of(rows)
    rolls, status = column("roll_deg"), column("status")
    missing = [name for name, found in (("roll_deg", rolls), ("status", status)) if found is None]
    if missing:
        raise UsageError(f"the rows have no column {', '.join(missing)}")
    files = column("file")
    files = [f"frame {place}" for place in range(len(status))] if files is None else list(map(str, files))
    states = np.array(list(map(str, status)), dtype=str)
    numbers = {name: _floats(found) for name in COLUMNS if (found := column(name)) is not None}
    if len({len(states), len(files), *map(len, numbers.values())}) > 1:
        raise UsageError("the columns differ in length")
    unknown = sorted(set(states.tolist()) - {"ok", "suspect", "error"})
    if unknown:
        raise UsageError(f"{unknown[0]!r} is no status: ok, suspect, error")
    return RigFrames(files, states == "ok", states == "suspect", numbers)


def _columns_of(rows: Any) -> Any:
    """Return a function from a column's name to its values, or to None."""
    if isinstance(rows, Mapping) or hasattr(rows, "columns"):
        return lambda name: list(rows[name]) if name in rows else None
    listed = list(rows)

    def column(name: str) -> list[Any] | None:
        if not listed:
            return []
        if isinstance(listed[0], Mapping):
            return [row.get(name) for row in listed] if any(name in row for row in listed) else None
        return [getattr(row, name) for row in listed] if hasattr(listed[0], name) else None

    return column


def _floats(values: Sequence[Any]) -> Floats:
    """NaN for None, and for the empty cells of a CSV."""
    try:
        return np.array([np.nan if each is None or each == "" else float(each) for each in values])
    except (TypeError, ValueError) as error:
        raise UsageError(f"the rows hold what is no number: {error}") from error
