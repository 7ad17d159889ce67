"""Known angles, read from a CSV with the columns `file` and `roll_deg`, and the stems that match frames."""

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rollcli.errors import InputError, UsageError
from rollcli.files.bounded import as_utf8
from rollcli.files.inputs import stem_of
from rollcli.files.results import TEXT
from rollcli.files.storage import read_named

_NEEDED = ("file", "roll_deg")
_LANE = "lane_lo_deg", "lane_hi_deg"
_READ = (*_NEEDED, *_LANE, "pitch_deg", "height_m", "curvature_per_m", "focal_px", "baseline_m")


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


def by_stem(names: Sequence[str], where: str) -> dict[str, int]:
    """Return the place of each name by its stem.

    Raises
    ------
    UsageError
        Names two that have the same stem; `where` says where they are.
    """
    places: dict[str, int] = {}
    for place, name in enumerate(names):
        first = places.setdefault(stem_of(name), place)
        if first != place:
            raise UsageError(
                f"{where}: {names[first]} and {name} have the same stem, and frames are matched by it: "
                "evaluate their folders apart"
            )
    return places


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
        The file cannot be read, has not these columns, or a line is not whole or holds no angle.
    UsageError
        Two frames have the same stem.
    """
    rows = list(_rows(as_utf8(read_named(path), str(path)).decode(**TEXT), path))
    if not rows:
        raise InputError(f"{path}: holds no angle")
    places = by_stem([name for name, _ in rows], str(path))
    return {stem: rows[place][1] for stem, place in places.items()}


def _rows(text: str, path: str | Path) -> Iterator[tuple[str, KnownPose]]:
    """Yield each line's name, and what it says of the rig."""
    lines = csv.DictReader(io.StringIO(text, newline=""), strict=True, skipinitialspace=True)
    try:
        if missing := [name for name in _NEEDED if name not in (lines.fieldnames or ())]:
            raise InputError(f"{path}: has no column {', '.join(missing)}: known angles are a CSV with both")
        if twice := [name for name in _READ if (lines.fieldnames or ()).count(name) > 1]:
            raise InputError(f"{path}: has two columns {', '.join(twice)}: which one is meant?")
        for line in lines:
            where = f"{path}: line {lines.line_num}"
            if None in line or None in line.values():  # the file is cut, or a comma is a decimal point
                raise InputError(f"{where}: has not as many values as there are columns")
            yield line["file"], _known(line, where)
    except csv.Error as error:
        raise InputError(f"{path}: line {lines.line_num}: is not CSV: {error}") from error


def _known(line: Mapping[str, str], where: str) -> KnownPose:
    bends = bool(line.get("curvature_per_m")) and _number(line, "curvature_per_m", where) != 0
    pitch, height = (
        _number(line, name, where) if line.get(name) and not bends else None
        for name in ("pitch_deg", "height_m")
    )
    rig = [_number(line, name, where) for name in ("focal_px", "baseline_m") if line.get(name)]
    scale = rig[0] * rig[1] if len(rig) == 2 else None
    lane = tuple(_number(line, name, where) for name in _LANE if line.get(name))
    return KnownPose(math.radians(_number(line, "roll_deg", where)), pitch, height, bends, scale, lane)


def _number(line: Mapping[str, str], name: str, where: str) -> float:
    text, angle = line[name], name.endswith("_deg")
    try:
        number = float("" if "_" in text else text)  # `1_0` is Python's notation
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or (angle and abs(number) > 90):
        kind = "an angle in degrees from -90 to 90" if angle else "a number"
        raise InputError(f"{where}: {name} is {text!r}, not {kind}")
    return number
