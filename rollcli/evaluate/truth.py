"""Known angles, read from a CSV with the columns `file` and `roll_deg`, and the stems that match frames."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from rollcli.errors import InputError, UsageError
from rollcli.files.bounded import as_utf8
from rollcli.files.inputs import stem_of
from rollcli.files.results import TEXT
from rollcli.files.storage import read_named

_NEEDED = ("file", "roll_deg")
_LANE = "lane_lo_deg", "lane_hi_deg"
_LENGTHS = "height_m", "focal_px", "baseline_m"
_NUMBERS = ("roll_deg", *_LANE, "pitch_deg", "curvature_per_m", *_LENGTHS)
_FORM = "known angles are a CSV with the columns file and roll_deg"

Named = TypeVar("Named")


@dataclass(frozen=True)
class KnownPose:
    """What is known of a rig: its roll, radians; pitch, degrees, and height, metres, or None.

    `focal_baseline` is its focal length times its baseline, px m: what depth times disparity is.

    `bends` says that the road does, so that pitch and height over the road ahead are others. `lane_deg` has
    the least and the greatest roll of parts of an uneven lane, where they are known.
    """

    theta: float
    pitch_deg: float | None = None
    height_m: float | None = None
    bends: bool = False
    focal_baseline: float | None = None
    lane_deg: tuple[float, ...] = ()


def by_stem(named: Iterable[tuple[str, str, Named]]) -> dict[str, Named]:
    """Return what has a name by the stem of that; of each is told where it stands, its name, and what it is.

    Raises
    ------
    UsageError
        Names two that have the same stem, and where the second of them is.
    """
    names = dict[str, str]()
    found = dict[str, Named]()
    for where, name, each in named:
        stem = stem_of(name)
        if names.get(stem) == name:
            raise UsageError(f"{where}: {name} is there a second time: leave one of them")
        if stem in names:
            raise UsageError(
                f"{where}: {names[stem]} and {name} have the same stem, and frames are matched by it: "
                "evaluate their folders apart"
            )
        names[stem], found[stem] = name, each
    return found


def read_truth(path: str | Path) -> dict[str, KnownPose]:
    """Read known angles, as `rollcli simulate` writes them, with what else is known of the rig.

    Parameters
    ----------
    path : str or Path
        CSV with the columns `file` and `roll_deg`, degrees; pitch and height are the optional columns
        `pitch_deg` and `height_m`. These hold for the road below the camera, and are left out where
        `curvature_per_m` says that the road ahead bends away from it.

    Returns
    -------
    dict of str to KnownPose
        By the frame's stem.

    Raises
    ------
    InputError
        The file cannot be read, has not these columns, or a line is not whole, holds no angle or one that
        cannot be.
    UsageError
        Two frames have the same stem.
    """
    known = by_stem(_rows(as_utf8(read_named(path), str(path)).decode(**TEXT), path))
    if not known:
        raise InputError(f"{path}: holds no angle")
    return known


def _rows(text: str, path: str | Path) -> Iterator[tuple[str, str, KnownPose]]:
    """Yield where each line is, its name, and what it says of the rig."""
    lines = csv.DictReader(io.StringIO(text, newline=""), strict=True, skipinitialspace=True)
    try:
        if missing := [name for name in _NEEDED if name not in (lines.fieldnames or ())]:
            raise InputError(f"{path}: has no column {', '.join(missing)}: {_FORM}")
        if twice := [name for name in ("file", *_NUMBERS) if (lines.fieldnames or ()).count(name) > 1]:
            raise InputError(f"{path}: has two columns {', '.join(twice)}: which one is meant?")
        for line in lines:
            where = f"{path}: line {lines.line_num}"
            if None in line or None in line.values():  # the file is cut, or a comma is a decimal point
                raise InputError(f"{where}: has not as many values as there are columns")
            if not line["file"]:
                raise InputError(f"{where}: file is empty: name the frame")
            yield where, line["file"], _known(line, where)
    except csv.Error as error:
        raise InputError(f"{path}: line {lines.reader.line_num}: is not CSV ({error}): {_FORM}") from error


def _known(line: Mapping[str, str], where: str) -> KnownPose:
    given = {
        name: _number(line[name], name, where) for name in _NUMBERS if line.get(name) or name == "roll_deg"
    }
    bends = given.get("curvature_per_m", 0.0) != 0
    pitch, height = (None if bends else given.get(name) for name in ("pitch_deg", "height_m"))
    rig = [given[name] for name in ("focal_px", "baseline_m") if name in given]
    lane = tuple(given[name] for name in _LANE if name in given)
    if lane != tuple(sorted(lane)):
        raise InputError(f"{where}: lane_lo_deg is above lane_hi_deg: give the lesser one first")
    scale = rig[0] * rig[1] if len(rig) == 2 else None
    return KnownPose(math.radians(given["roll_deg"]), pitch, height, bends, scale, lane)


def _number(text: str, name: str, where: str) -> float:
    angle, length = name.endswith("_deg"), name in _LENGTHS
    try:
        number = float("" if "_" in text else text)  # `1_0` is Python's notation
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or (angle and abs(number) > 90) or (length and number <= 0):
        kind = "an angle in degrees from -90 to 90" if angle else f"a number{' above 0' if length else ''}"
        raise InputError(f"{where}: {name} is {text!r}, not {kind}")
    return number
