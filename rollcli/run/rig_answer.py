"""The last lines of a run: what its frames say about the rig."""

import math
from array import array
from statistics import median

from rollcli.files.results import STATUSES, Row
from rollcli.rig.calibration import Calibration
from rollcli.rig.quantities import COLUMNS

_MOST_FRAMES = 1_000_000  # their names and numbers take 150 MB


class RigAnswer:
    """Keeps of each row what the answer needs, of a million rows at most.

    Import-light: the dispatcher loads NumPy only for the answer, once the workers have ended.
    """

    def __init__(self) -> None:
        self._too_many = False
        self._files: list[str] = []
        self._status = bytearray()
        self._numbers = {name: array("d") for name in COLUMNS}

    def add(self, row: Row) -> None:
        """Take a row that is written."""
        if len(self._files) == _MOST_FRAMES:
            self._too_many = True
        if self._too_many:
            return
        self._files.append(row.file)
        self._status.append(STATUSES.index(row.status))
        for name, column in self._numbers.items():
            column.append(_number(row, name))

    def replace(self, position: int, row: Row) -> None:
        """Take a row that is written in the place of the one at a position, from 0."""
        if position >= len(self._files):
            return
        self._status[position] = STATUSES.index(row.status)
        for name, column in self._numbers.items():
            column[position] = _number(row, name)

    def line(self) -> str:
        """Return the answer in one line, such as `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
        if self._too_many:
            return f"more than {_MOST_FRAMES:,} frames: rollcli rig RESULT says what they say of the rig"
        from rollcli.rig.drive.assess import assess_rig
        from rollcli.rig.words import one_line

        statuses = [STATUSES[each] for each in self._status]
        return one_line(assess_rig({"file": self._files, "status": statuses, **self._numbers}))

    def pose_note(self, calibration: Calibration | None) -> str:
        """Return what the intervals of pitch and height leave out; empty where no frame has a pitch."""
        pitch, height = self._median("pitch_deg"), self._median("height_m")
        if calibration is None or pitch is None:
            return ""
        from rollcli.rig.pose import taken_as_exact

        return taken_as_exact(calibration, math.radians(pitch), height)

    def _median(self, name: str) -> float | None:
        known = [each for each in self._numbers[name] if not math.isnan(each)]
        return median(known) if known else None


def _number(row: Row, name: str) -> float:
    value: float | None = getattr(row, name)
    return math.nan if value is None else value
