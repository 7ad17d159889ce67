"""What drives say about the rig: each drive and each quantity, and what changed from drive to drive."""

import math
import os.path
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import UsageError
from rollcli.rig.drive.posterior import TUNING, Estimate, Flags, Floats
from rollcli.rig.drive.quantity import Segment, SequenceAssessment, assess_sequence
from rollcli.rig.quantities import ALIGNMENT, BOUNDS, COLUMNS, QUANTITIES, ROLL, SIZE, Quantity

AUTO, NONE = "auto", "none"
_FRAMES_OF_A_DRIVE = 8  # folders of fewer frames on average are not drives but single frames
_APART = 4.0  # standard deviations within a group; medians of a hundred groups of one rig are 3.5 apart
_LEAST_SPREAD = 0.05  # degrees
# drive.mcap#/stereo/disparity@1700000000123456789, with .1 where a stamp is there twice; drive.mp4#000123
_FRAME = re.compile(r"(?i)(.*?\.(?!(?:zip|tar)#)\w+)#(?:.*@([0-9]{1,20})|[0-9]+$|rest$)")
_IN_ARCHIVE = re.compile(r"(?i)(?<=\.(?:zip|tar))#(?=[^/]*$)")  # of run.zip#0001.png, in no folder there
_NS = 1e-9
_LEAST_S = 1e-6  # from frame to frame: the stamps of a recorder that has no clock count its frames


def drive_of(file: str) -> str:
    """Return the recording that a frame is of, or its folder or archive.

    The files into which rosbag2 splits a recording, ``run/run_0.mcap`` and so on, are one, the folder.
    """
    found = _FRAME.match(file) if "#" in file else None
    if found is None:
        return _IN_ARCHIVE.sub("/", file).rpartition("/")[0]
    folder, _, name = found[1].rpartition("/")
    split = re.fullmatch(r"(.+)_[0-9]+\.\w+", name)
    return folder if split is not None and split[1] == folder.rpartition("/")[2] else found[1]


def split_drives(
    files: Sequence[str], groups: str, kinds: Sequence[str], rolls: Floats
) -> list[tuple[str, NDArray[np.intp]]]:
    """Group frames into drives.

    Parameters
    ----------
    files : sequence of str
        Paths with "/" separators, in the order of the frames.
    groups : str
        "auto": frames of one folder, archive or recording are one drive, unless these hold hardly a frame and
        their rolls do not differ beyond their spread; "none": all are one; else a pattern such as
        "data/run*": the folders that it matches are drives, with all below them.
    kinds : sequence of str
        Of each frame what else tells those of a folder apart, such as their size; or empty.
    rolls : ndarray of float, shape (N,)
        Degrees; NaN where a frame does not count.

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
    folders = list(map(drive_of, files))
    heads = {folder: _head(folder, pattern) if pattern else "" for folder in dict.fromkeys(folders)}
    if pattern and not any(heads.values()):
        raise UsageError(f"--groups {groups}: matches no folder of the frames, such as {next(iter(heads))}")
    drives = defaultdict[tuple[str, str], list[int]](list)
    for place, (folder, kind) in enumerate(zip(folders, kinds, strict=True)):
        drives[heads[folder] or folder, kind].append(place)
    few = groups == AUTO and len(files) < _FRAMES_OF_A_DRIVE * len(drives)
    if few and not _differ([rolls[places] for places in drives.values()]):
        return [("", np.arange(len(files)))]
    names = (f"{folder} ({kind})" if kind and folder else folder or kind for folder, kind in drives)
    return list(zip(names, map(np.array, drives.values()), strict=True))


def _differ(groups: Sequence[NDArray[np.float64]]) -> bool:
    """Tell whether groups of rolls are further apart than the frames of a group are."""
    known = [found for each in groups if len(found := each[np.isfinite(each)]) > 1]
    if len(known) < 2:
        return False
    spread = math.sqrt(float(np.mean([np.var(each, ddof=1) for each in known])))
    return float(np.ptp([np.median(each) for each in known])) > _APART * max(spread, _LEAST_SPREAD)


def _head(folder: str, pattern: str) -> str:
    """Return the first folders of a path, as many as the pattern has, where they match; else nothing."""
    pattern = pattern.rstrip("/")
    head = "/".join(folder.split("/")[: pattern.count("/") + 1])
    return head if fnmatchcase(head, pattern) else ""


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
    origins : sequence of str
        Which result each frame is from, where they are of several runs that are not one; else empty.
    """

    files: Sequence[str]
    ok: Flags
    suspect: Flags
    numbers: Mapping[str, Floats]
    origins: Sequence[str] = ()

    def column(self, name: str) -> Floats:
        """Return one of the numbers of each frame; NaN alone where the result has no such column."""
        return self.numbers.get(name, np.full(len(self.files), np.nan))


@dataclass(frozen=True, slots=True, eq=False)
class DriveAssessment:
    """One drive.

    Attributes
    ----------
    name : str
        Its folder or recording; empty when all frames are one drive.
    frames : ndarray of int
        Its frames among all, from 0.
    quantities : mapping of str to SequenceAssessment
        "roll", and "pitch", "height" and the parts of `ALIGNMENT` where the result has them. Their frames
        count within the drive.
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


@dataclass(frozen=True, eq=False)
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

    @cached_property
    def names(self) -> list[str]:
        """The files, without the folders that all have in common."""
        return short_names(self.frames.files)

    def name_of(self, drive: DriveAssessment) -> str:
        """Return the name of a drive, without the folders that all files have in common."""
        before = self.frames.files[0].removesuffix(self.names[0]) if self.count else ""
        return drive.name.removeprefix(before)

    @cached_property
    def seconds(self) -> Floats:
        """When each frame was taken, s since the first stamp; NaN where its name has none."""
        found = [_FRAME.match(file) if "#" in file else None for file in self.frames.files]
        stamps = [None if each is None or each[2] is None else int(each[2]) for each in found]
        first = next((each for each in stamps if each is not None), 0)
        seconds = np.array([np.nan if each is None else (each - first) * _NS for each in stamps])
        known = seconds[np.isfinite(seconds)]
        if known.size and np.ptp(known) < _LEAST_S * known.size:
            seconds[:] = np.nan
        return seconds

    def drift_per_hour(self, drive: DriveAssessment | None, quantity: Quantity = ROLL) -> Estimate:
        """Return the drift of a drive over its time; unknown where names have no stamps that ascend."""
        found = None if drive is None else drive.quantities.get(quantity.name)
        seconds = self.seconds[drive.frames] if drive is not None else np.empty(0)
        steps = np.diff(seconds[np.isfinite(seconds)])  # none where names have no stamps
        if found is None or found.drift.value is None or not steps.any() or steps.min() < 0:
            return Estimate()
        hours = float(steps.sum()) / 3600
        half = found.drift.ci95
        return Estimate(found.drift.value / hours, None if half is None else half / hours)

    @property
    def count(self) -> int:
        """How many frames there are."""
        return len(self.frames.files)

    def latest_drive(self, quantity: Quantity = ROLL) -> DriveAssessment | None:
        """Return the last drive in which a quantity has any value, or None."""
        having = (each for each in reversed(self.drives) if quantity.name in each.quantities)
        return next((each for each in having if each.quantities[quantity.name].used), None)

    def latest(self, quantity: Quantity = ROLL) -> SequenceAssessment | None:
        """Return the assessment of a quantity in the last drive in which it has any value, or None."""
        drive = self.latest_drive(quantity)
        return None if drive is None else drive.quantities[quantity.name]

    def now(self, quantity: Quantity = ROLL) -> Estimate:
        """Return the rig as it is: the mean of the last segment of the last drive, with a drift its end."""
        found = self.latest(quantity)
        return found.now if found is not None else Estimate()


@np.errstate(all="ignore")
def assess_rig(
    rows: Any, *, include_suspect: bool = False, groups: str = AUTO, origins: Sequence[str] = ()
) -> RigAssessment:
    """Assess how a rig is mounted, whether it drifts, and when it jumped.

    Parameters
    ----------
    rows : sequence of rows, or columns
        What `rollcli estimate` wrote: rows as mappings or as objects with attributes; or columns by name, as
        a dict of sequences or a DataFrame. Needed are `roll_deg` and `status`; used where they are there:
        `file`, `roll_ci95_deg`, `pitch_deg`, `pitch_ci95_deg`, `height_m`, `height_ci95_m`, `width`,
        `height` and the four columns of how a right view lay. Degrees, metres and pixels; None or NaN where
        there is nothing. In the order in which the frames were taken.
    include_suspect : bool
        Let suspect frames count too.
    groups : str
        "auto": frames of one folder are one drive; "none": all are one drive; else a pattern of folders.
    origins : sequence of str
        Which result each row is from, where they are of several runs that are not one; else empty.

    Returns
    -------
    RigAssessment
        `now()` is the roll, degrees: its `value`, and `ci95`, half-width of the 95 % interval; None where
        there is none. `latest()` has `segments`, `jumps` and `drift` of the last drive.
        `drives[-1].quantities["pitch"]` has these of the pitch, and its `now`; so of "height".

    Raises
    ------
    UsageError
        A column is missing, columns differ in length, or a value cannot be one of its column.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> rolls = np.append(rng.normal(0.2, 0.1, 300), rng.normal(1.0, 0.1, 300))
    >>> rig = assess_rig({"roll_deg": rolls, "status": ["ok"] * 600})
    >>> [jump.frame for jump in rig.latest().jumps], round(rig.now().value, 1)
    ([300], 1.0)
    """
    frames = replace(_frames(rows), origins=origins)
    if len(origins) not in (0, len(frames.files)):
        raise UsageError(f"{len(origins)} origins of {len(frames.files)} rows: give one for each, or none")
    return assess_frames(frames, include_suspect=include_suspect, groups=groups)


def assess_frames(frames: RigFrames, *, include_suspect: bool = False, groups: str = AUTO) -> RigAssessment:
    """Assess frames that are columns already; see `assess_rig`."""
    measured = frames.ok | frames.suspect  # how the views lie is told where the angle is not, too
    counted = measured if include_suspect else frames.ok
    drives: list[DriveAssessment] = []
    rolls = np.where(counted, frames.column(ROLL.column), np.nan)
    for name, places in split_drives(frames.files, groups, _kinds(frames), rolls):
        found = {
            quantity.name: _assessed(frames, places, measured if quantity in ALIGNMENT else counted, quantity)
            for quantity in (*QUANTITIES, *ALIGNMENT)
            if quantity is ROLL or np.isfinite(frames.column(quantity.column)).any()
        }
        drives.append(DriveAssessment(name, places, found))
    found_rolls = [drive.quantities[ROLL.name] for drive in drives]
    return RigAssessment(
        frames,
        used=sum(each.used for each in found_rolls),
        suspect=int(frames.suspect.sum()),
        failed=int((~(frames.ok | frames.suspect)).sum()),
        outliers=sum(each.outliers for each in found_rolls),
        include_suspect=include_suspect,
        drives=_compared(drives),
    )


def difference(before: Estimate, after: Estimate, quantity: Quantity) -> Estimate:
    """How much larger `after` is; no interval where one of them has none."""
    if before.value is None or after.value is None:
        return Estimate()
    change = math.remainder(after.value - before.value, quantity.period)
    if before.ci95 is None or after.ci95 is None:
        return Estimate(change)
    return Estimate(change, math.hypot(before.ci95, after.ci95))


def short_names(files: Sequence[str]) -> list[str]:
    """Return paths without the folders that all have in common."""
    folders = {tuple(file.split("/")[:-1]) for file in files}
    common = os.path.commonprefix(list(folders))  # noqa: RUF071 (of tuples, part by part)
    skipped = sum(len(part) + 1 for part in common[: len(common) - (len(folders) == 1)])
    return [file[skipped:] for file in files]


def _kinds(frames: RigFrames) -> list[str]:
    """Return what tells frames of one folder apart: the result, and the size where there are several."""
    sides = [frames.column(name) for name in SIZE]
    origins = frames.origins or [""] * len(frames.files)
    if all(len(np.unique(each[np.isfinite(each)])) < 2 for each in sides):
        return list(origins)
    sizes = [f"{wide:.0f}x{high:.0f}" if wide == wide else "" for wide, high in np.transpose(sides).tolist()]
    keys = list(zip(map(drive_of, frames.files), origins, strict=True))
    # a frame that could not be read has no size: it is of the drive of those before it, or behind it
    last = dict(reversed([each for each in zip(keys, sizes, strict=True) if each[1]]))
    for place, key in enumerate(keys):
        sizes[place] = last[key] = sizes[place] or last.get(key, "")
    return [" ".join(filter(None, each)) for each in zip(origins, sizes, strict=True)]


def _assessed(
    frames: RigFrames, places: NDArray[np.intp], counted: Flags, quantity: Quantity
) -> SequenceAssessment:
    """One quantity of one drive."""
    values = np.where(counted, frames.column(quantity.column), np.nan)[places]
    halves = frames.column(quantity.ci_column)[places]
    if quantity is ROLL:
        values = _unwrapped(values)
    found = assess_sequence(values, halves * _TO_SD, quantity.scale)
    return replace(found, segments=tuple(_wrapped(each, quantity) for each in found.segments))


def _wrapped(segment: Segment, quantity: Quantity) -> Segment:
    """Bring values that were unwrapped back to within half a period of 0."""
    parts = (segment.mean, segment.begin, segment.end)
    values = (difference(Estimate(0.0, 0.0), each, quantity) for each in parts)
    return Segment(segment.first, segment.last, segment.used, *values)


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
    before, reach = Estimate(), 0.0
    # with as many comparisons as there are, fewer of each may be wrong
    sterner = NormalDist().inv_cdf(1 - 0.025 / max(1, len(drives) - 1)) * _TO_SD
    for drive in drives:
        roll = drive.quantities[ROLL.name]
        first = roll.segments[0].begin if roll.segments else Estimate()
        change = difference(before, first, ROLL)
        wide = sterner * (change.ci95 if change.ci95 is not None else math.hypot(reach, _spread(roll)))
        differs = change.value is not None and abs(change.value) > wide
        result.append(replace(drive, change=change, differs=differs))
        if roll.used:
            before, reach = roll.now, _spread(roll)
    return tuple(result)


def _spread(found: SequenceAssessment) -> float:
    """How far a few frames are apart, and a car sways: what there is where there is no interval."""
    used = found.series.values[found.series.used]
    return max(TUNING.sway, float(np.ptp(used))) if len(used) > 1 else math.inf


def _frames(rows: Any) -> RigFrames:
    """Columns of whatever was given."""
    rows = rows.to_pydict() if hasattr(rows, "to_pydict") else rows  # PyArrow, as it reads Parquet
    if not (isinstance(rows, Mapping) or hasattr(rows, "columns")):
        rows = _columns(list(rows))
    if missing := [name for name in ("roll_deg", "status") if name not in rows]:
        raise UsageError(f"the rows have no column {', '.join(missing)}")
    states = np.array(list(map(str, rows["status"])), dtype=str)
    named = rows["file"] if "file" in rows else (f"frame {place}" for place in range(len(states)))
    files = list(map(str, named))
    numbers = {name: _floats(rows[name]) for name in COLUMNS if name in rows}
    for name, (low, high) in BOUNDS.items():
        values = numbers.get(name, np.empty(0))
        outside = values[(values < low) | (values > high)]
        if outside.size:
            raise UsageError(f"{outside[0]:g} is no value for {name}")
    if len({len(states), len(files), *map(len, numbers.values())}) > 1:
        raise UsageError("the columns differ in length")
    unknown = sorted(set(states.tolist()) - {"ok", "suspect", "error"})
    if unknown:
        raise UsageError(f"{unknown[0]!r} is no status: ok, suspect, error")
    return RigFrames(files, states == "ok", states == "suspect", numbers)


def _columns(rows: Sequence[Any]) -> dict[str, list[Any]]:
    """Return the columns of rows that are mappings or have attributes."""
    names = ("status", "file", *COLUMNS)
    if rows and not isinstance(rows[0], Mapping):
        rows = [{name: getattr(row, name) for name in names if hasattr(row, name)} for row in rows]
    there = [name for name in names if not rows or any(name in row for row in rows)]
    return {name: [row.get(name) for row in rows] for name in there}


def _floats(values: Sequence[Any]) -> Floats:
    """NaN for None, for the NA of pandas' own types, and for the empty cells of a CSV."""
    try:
        return np.array([np.nan if _is_blank(each) else float(each) for each in values])
    except (TypeError, ValueError) as error:
        raise UsageError(f"the rows hold what is no number: {error}") from error


def _is_blank(value: Any) -> bool:
    # a number of NumPy takes 8 microseconds to tell that it is no text
    return value is None or type(value).__name__ == "NAType" or (isinstance(value, str) and not value)
