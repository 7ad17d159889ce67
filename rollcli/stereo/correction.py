"""A correction for all pairs of a rig, as `rollcli rig --correction` writes it."""

import json
import math
from dataclasses import astuple
from functools import lru_cache

from rollcli.errors import UsageError, as_usage, reading
from rollcli.files.bounded import MOST_SETTINGS, read_given
from rollcli.stereo.misalignment import ColumnSupport, Misalignment

_VALUES = ("right_lower_px", "right_clockwise_deg", "right_larger_percent", "right_twist_px")
_COLUMNS = ("scale", "twist", "pitch", "slope_error")  # as of a `ColumnSupport`
_LARGEST = (100.0, 45.0, 50.0, 100.0)  # of each; what is more is damage
CONTRADICTS = "the views do not lie as the correction says"
"""The doubt of a pair that was levelled as a file says, and is not level then."""


def columns_as_text(columns: ColumnSupport) -> dict[str, float]:
    """Return what `read_correction` reads of the columns."""
    return {name: float(f"{value:.6g}") for name, value in zip(_COLUMNS, astuple(columns), strict=True)}


@lru_cache(maxsize=8)
def read_correction(path: str) -> tuple[Misalignment, ColumnSupport | None, int]:
    """Return how the right view lies, what of it is in the columns, and the width of the views, px.

    The columns are None where the pairs of the drive could not be looked at together.

    Raises
    ------
    UsageError
        The file cannot be read, or is no correction.
    """
    try:
        with as_usage(), reading(f"--align {path}"):
            found = json.loads(read_given(path, MOST_SETTINGS))
        values = [float(found[name]) for name in _VALUES]
        width, height = int(found["width"]), int(found["height"])
        told = found.get("columns")
        columns = ColumnSupport(*(float(told[name]) for name in _COLUMNS)) if told is not None else None
    except (ValueError, KeyError, TypeError, RecursionError, OverflowError) as error:
        raise UsageError(f"--align {path}: is no correction that `rollcli rig --correction` wrote") from error
    fits = all(math.isfinite(each) and abs(each) <= most for each, most in zip(values, _LARGEST, strict=True))
    fits &= columns is None or all(map(math.isfinite, astuple(columns)))
    if not (fits and width > 0 and height > 0):
        raise UsageError(f"--align {path}: holds numbers that no rig has")
    return Misalignment.of_values(values, height, width), columns, width
