"""A correction for all pairs of a rig, as `rollcli rig --correction` writes it."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, astuple, replace
from typing import Any, NamedTuple

from rollcli.errors import UsageError, as_usage, reading
from rollcli.rig.quantities import ALIGNMENT
from rollcli.stereo.misalignment import ColumnSupport, Misalignment

_VALUES = [each.column for each in ALIGNMENT]
_BEND = "right_bend_px"  # in the first and the last row; files of before it came have none
_OFFSET_CI95 = "right_lower_ci95_px"
_COLUMNS = ("scale", "twist", "pitch", "slope_error", "pitch_error")  # as of a `ColumnSupport`
_EARLIER = {"pitch_error": 0.0}  # files of before it came have none
_REACH = 1.96  # standard errors: of an interval of 95 %
LARGEST = (100.0, 45.0, 50.0, 100.0, 100.0)  # of each; what is more is damage


class DriveRows(NamedTuple):
    """What the rows of a drive's pairs say together, px of the size matched at.

    Attributes
    ----------
    columns : ColumnSupport
    curve : float
        As in a `Misalignment`, 1/pixels.
    """

    columns: ColumnSupport
    curve: float

    def as_text(self, height: int, width: int) -> dict[str, Any]:
        """Return what `read_correction` reads of it, for views of this size."""
        bend = Misalignment(curve=self.curve).shifts(height, width)[5]
        named = zip(_COLUMNS, astuple(self.columns), strict=True)
        return {_BEND: round(bend, 6), "columns": {name: float(f"{value:.6g}") for name, value in named}}


class Correction(NamedTuple):
    """How the right views of a rig lie, of one size.

    Attributes
    ----------
    lies : Misalignment
    columns : ColumnSupport or None
        None where the pairs of the drive could not be looked at together.
    offset_error : float
        Standard error of the offset, px; infinite where the drive does not tell it.
    width, height : int
        Of the views, px.
    """

    lies: Misalignment
    columns: ColumnSupport | None
    offset_error: float
    width: int
    height: int

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON holds it: what `of_record` reads."""
        columns = self.columns and asdict(self.columns)
        error = self.offset_error if math.isfinite(self.offset_error) else None
        return {**self._asdict(), "lies": asdict(self.lies), "columns": columns, "offset_error": error}

    @staticmethod
    def of_record(record: Mapping[str, Any]) -> "Correction":
        """Read it back; `TypeError` or `KeyError` where it is none."""
        columns, error = record["columns"], record["offset_error"]
        lies, columns = Misalignment(**record["lies"]), columns and ColumnSupport(**columns)
        error = math.inf if error is None else float(error)
        return Correction(lies, columns, error, int(record["width"]), int(record["height"]))

    def resized(self, width: int, height: int) -> "Correction":
        """Return the same of views of another size, whose sides are rounded to whole pixels.

        Raises
        ------
        UsageError
            They are no scaled ones, as after a crop, which has another centre.
        """
        if abs(width * self.height - height * self.width) > max(width + height, self.width + self.height):
            raise UsageError(
                f"--align: the correction is for {self.width}x{self.height} px, the views have "
                f"{width}x{height}: give the correction of their own drive; only scaled views are allowed for"
            )
        factor = width / self.width
        columns = self.columns and self.columns.resized(factor)
        return Correction(self.lies.resized(factor), columns, factor * self.offset_error, width, height)

    def of_pair(self, offset: float, error: float) -> Misalignment:
        """Return how one pair lies whose own offset, px, was measured with this standard error.

        The offset wanders with the temperature, by 0.5 px on a day of KITTI; the rest is the rig's.
        """
        share = 1 / (1 + (error / self.offset_error) ** 2) if self.offset_error else 0.0
        return replace(self.lies, offset=self.lies.offset + share * (offset - self.lies.offset))


def read_correction(path: str) -> Correction:
    """Read what `rollcli rig --correction` wrote.

    Raises
    ------
    UsageError
        The file cannot be read, or is no correction.
    """
    from rollcli.files.bounded import MOST_SETTINGS, read_given
    from rollcli.files.storage import read_bytes
    from rollcli.files.stores.locations import is_url

    try:
        with as_usage(), reading(f"--align {path}"):
            # not by `read_named`, for which "-" is standard input: workers have none
            data = read_bytes(path, most=MOST_SETTINGS) if is_url(path) else read_given(path, MOST_SETTINGS)
        found = json.loads(data)
        values, bend = [float(found[name]) for name in _VALUES], float(found.get(_BEND, 0.0))
        width, height = int(found["width"]), int(found["height"])
        columns = None
        if found.get("columns") is not None:
            told = _EARLIER | found["columns"]
            columns = ColumnSupport(*(float(told[name]) for name in _COLUMNS))
        reach = found.get(_OFFSET_CI95)
        offset_error = math.inf if reach is None else float(reach) / _REACH
    except (ValueError, KeyError, TypeError, RecursionError, OverflowError) as error:
        raise UsageError(f"--align {path}: is no correction that `rollcli rig --correction` wrote") from error
    fits = all(
        math.isfinite(each) and abs(each) <= most for each, most in zip([*values, bend], LARGEST, strict=True)
    )
    fits &= columns is None or all(map(math.isfinite, astuple(columns)))
    if not (fits and offset_error >= 0 and width > 0 and height > 0):
        raise UsageError(f"--align {path}: holds numbers that no rig has")
    lies = replace(Misalignment.of_values(values, height, width), curve=bend / (height / 2) ** 2)
    return Correction(lies, columns, offset_error, width, height)
