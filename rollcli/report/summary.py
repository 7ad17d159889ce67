"""What a result says as a whole, in numbers and in words."""

import posixpath
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from rollcli.files.results import Row
from rollcli.rig.drive.assess import drive_of
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.quantities import ROLL, Quantity
from rollcli.rig.words import answer
from rollcli.run.resume import recorded_encodings


def summarize(rows: Sequence[Row]) -> dict[str, Any]:
    """Take the figures of a result, degrees, by their names in the template; None of what is not there."""
    rolls = [row.roll_deg for row in rows if row.roll_deg is not None]
    widths = [row.roll_ci95_deg for row in rows if row.roll_ci95_deg is not None]
    return {
        "frames": len(rows),
        "counts": Counter(row.status for row in rows),
        "middle": np.percentile(rolls, (5, 95)).tolist() if rolls else None,
        "extremes": (min(rolls), max(rolls)) if rolls else None,
        "half_width": float(np.median(widths)) if widths else None,
    }


def degrees(angle: float, digits: int = 2) -> str:
    """Return an angle to read: with its sign, a true minus, and its unit."""
    text = f"{angle:+.{digits}f}" if round(angle, digits) else f"{abs(angle):.{digits}f}"
    return text.replace("-", "−") + "°"


def with_interval(value: float | None, half_width: float | None, quantity: Quantity = ROLL) -> str:
    """Return a value with the half-width of its interval, to read: with a true minus, and its unit."""
    return "–" if value is None else answer(Estimate(value, half_width), quantity).replace("-", "−")


def input_folders(rows: Sequence[Row]) -> list[str]:
    """List the recordings or folders of the frames, in order of appearance; "." is where `estimate` ran."""
    names = [name for row in rows for name in (row.file, row.right_file) if name]
    return list(dict.fromkeys(drive_of(name) or posixpath.dirname(name) or "." for name in names))


def written_at(result: str) -> str:
    """Return when the result was written, UTC, in words; "" for a stream or an object store.

    The page holds no date of its own: the same result gives the same page.
    """
    try:
        seconds = Path(result).stat().st_mtime
    except (OSError, ValueError):
        return ""
    return datetime.fromtimestamp(seconds, timezone.utc).strftime("%Y-%m-%d %H:%M UTC")


def common_run(runs: Sequence[Mapping[str, Any] | None]) -> Mapping[str, Any] | None:
    """Return what the records of several runs have in common, and every version and encoding of theirs."""
    if len(runs) == 1 or None in runs:
        return runs[0] if len(runs) == 1 else None
    known = [each for each in runs if each is not None]
    encodings = [name for each in known for name in recorded_encodings(each)]
    options = _in_common([each.get("options", {}) for each in known])
    versions = ", ".join(dict.fromkeys(str(each["rollcli"]) for each in known if each.get("rollcli")))
    found = {**_in_common(known), "options": options, "encoding": list(dict.fromkeys(encodings))}
    return {**found, "rollcli": versions} if versions else found


def _in_common(runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {name: value for name, value in runs[0].items() if all(each.get(name) == value for each in runs)}


def option_lines(run: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return the options that the run was given, by their names on the command line, as they are typed."""
    options = (run or {}).get("options", {})
    given = {name: value for name, value in options.items() if value is not False and value not in (None, [])}
    return [(f"--{name}", _shown(value, _BETWEEN.get(name, ","))) for name, value in given.items()]


_BETWEEN = {"polygon": " ", "heights-range": ":", "invalid": " --invalid "}  # values of an option; else ","


def _shown(value: Any, between: str = ",") -> str:
    if value is True:  # of an option that is given alone
        return ""
    if isinstance(value, list):
        return between.join(map(_shown, value))
    return f"{value:.15g}" if isinstance(value, float) else str(value)
