"""How the cameras of a rig lie against each other, over the frames of a run; import-light."""

from array import array
from dataclasses import astuple
from statistics import median

from rollcli.files.results import Row
from rollcli.imaging.misalignment import Misalignment
from rollcli.imaging.misalignment_words import NOT_LEVELLED, TOO_LITTLE, advice_of, read_note


class RigAlignment:
    """Collects what rows say was corrected; a pair that was matched as it is counts as level.

    One that could not be levelled, or not be checked, says nothing: what was tried is no measurement.
    """

    def __init__(self) -> None:
        self._parts = [array("d") for _ in astuple(Misalignment())]
        self._size = (0, 0)
        self._corrected = 0

    def add(self, row: Row) -> None:
        """Take in a row; those of maps and those without an angle say nothing."""
        if not row.right_file or row.height is None or row.width is None:
            return
        if NOT_LEVELLED in row.message or TOO_LITTLE in row.message:
            return
        self._size = row.height, row.width
        found = read_note(row.message, *self._size)
        self._corrected += found != Misalignment()
        for part, value in zip(self._parts, astuple(found), strict=True):
            part.append(value)

    @property
    def median(self) -> Misalignment:
        """The median of each part over the frames."""
        return Misalignment(*(median(part) if part else 0.0 for part in self._parts))

    @property
    def advice(self) -> str:
        """What to do about it, in a sentence; empty where the median is level."""
        return advice_of(self.median, *self._size)

    def summary(self) -> dict[str, float | int | str] | None:
        """Return the entry of the run's record; None where no pair was corrected."""
        if not self._corrected:
            return None
        found = self.median
        return {
            "frames": len(self._parts[0]),
            "corrected": self._corrected,
            "right_lower_px": round(found.offset, 3),
            "right_camera_roll_deg": round(found.rotation_deg, 4),
            "right_larger_percent": round(100 * found.scale, 4),
            "rows_skewed_px": round(found.shifts(*self._size)[3], 3),
            "advice": self.advice,
        }
