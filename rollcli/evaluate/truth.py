"""Known angles, read from a CSV with the columns `file` and `roll_deg`, and the stems that match frames."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from rollcli.errors import InputError, UsageError
from rollcli.files.matching import stem_of
from rollcli.files.results import TEXT

_NEEDED = ("file", "roll_deg")


def by_stem(names: Iterable[str], where: str) -> dict[str, int]:
    """Return the place of each name by its stem.

    Raises
    ------
    UsageError
        Names two that have the same stem; `where` says where they are.
    """
    places: dict[str, int] = {}
    listed = list(names)
    for place, name in enumerate(listed):
        first = places.setdefault(stem_of(name), place)
        if first != place:
            raise UsageError(
                f"{where}: {listed[first]} and {name} have the same stem, and frames are matched by it: "
                "evaluate their folders apart"
            )
    return places


def read_truth(path: str | Path) -> dict[str, float]:
    """Read known angles, as `rollcli simulate` writes them.

    Parameters
    ----------
    path : str or Path
        CSV with the columns `file` and `roll_deg`, degrees; further ones are left out.

    Returns
    -------
    dict of str to float
        Radians, by the frame's stem.

    Raises
    ------
    InputError
        The file cannot be read, has not these columns, or a line holds no angle.
    UsageError
        Two frames have the same stem.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from error
    rows = list(_rows(data.removeprefix(b"\xef\xbb\xbf").decode(**TEXT), path))
    if not rows:
        raise InputError(f"{path}: holds no angle")
    places = by_stem((name for name, _ in rows), str(path))
    return {stem: rows[place][1] for stem, place in places.items()}


def _rows(text: str, path: str | Path) -> Iterator[tuple[str, float]]:
    """Yield each line's name, and its angle in radians."""
    lines = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    try:
        missing = [name for name in _NEEDED if name not in (lines.fieldnames or ())]
        if missing:
            raise InputError(f"{path}: has no column {', '.join(missing)}: known angles are a CSV with both")
        for line in lines:
            yield line["file"] or "", _angle(line["roll_deg"], f"{path}: line {lines.line_num}")
    except csv.Error as error:
        raise InputError(f"{path}: line {lines.line_num}: is not CSV: {error}") from error


def _angle(text: str | None, where: str) -> float:
    try:
        degrees = float(text or "")
    except ValueError:
        degrees = math.nan
    if not math.isfinite(degrees):
        raise InputError(f"{where}: roll_deg is {text!r}, not an angle in degrees")
    return math.radians(degrees)
