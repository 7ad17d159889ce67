"""What a run comes to: counts by status, how the views of pairs lay, and what the frames say about the rig.

Progress, the record of the run and the exit status read it.
"""

import math
from array import array
from collections import Counter
from statistics import median

from rollcli.errors import ExitStatus
from rollcli.files.results import ALIGNMENT_COLUMNS, STATUSES, Row
from rollcli.rig.calibration import Calibration
from rollcli.rig.quantities import COLUMNS
from rollcli.stereo.misalignment_words import advice_of

_MOST_FRAMES = 1_000_000  # that the rig's roll is told of: their names and numbers take 150 MB


class RunSummary:
    """Takes in the rows of a run in their order, those of an interrupted run first.

    Import-light: the dispatcher loads NumPy only for the rig's roll, once the workers have ended.

    Attributes
    ----------
    counts : Counter of str
        How many rows have each status, apart from those whose frames are done again.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._alignment = {name: array("d") for name in ALIGNMENT_COLUMNS}
        self._too_many = False
        self._files: list[str] = []
        self._status = bytearray()
        self._numbers = {name: array("d") for name in COLUMNS}

    def add(self, row: Row, *, is_retried: bool = False) -> None:
        """Take the next row; of one whose frame is done again the place alone, until `replace`."""
        if not is_retried:
            self._count(row)
        self._too_many |= len(self._files) == _MOST_FRAMES
        if self._too_many:
            return
        self._files.append(row.file)
        self._status.append(STATUSES.index(row.status))
        for name, column in self._numbers.items():
            column.append(_number(row, name))

    def replace(self, position: int, row: Row) -> None:
        """Take the row of a frame that was done again, in the place of the one at a position, from 0."""
        self._count(row)
        if position >= len(self._files):
            return
        self._status[position] = STATUSES.index(row.status)
        for name, column in self._numbers.items():
            column[position] = _number(row, name)

    def _count(self, row: Row) -> None:
        self.counts[row.status] += 1
        for name, column in self._alignment.items():
            value = getattr(row, name)
            if value is not None:
                column.append(value)

    @property
    def frames(self) -> int:
        """The number of frames that are done."""
        return self.counts.total()

    @property
    def totals(self) -> dict[str, int]:
        """The number of frames, and by status."""
        return {"frames": self.frames, **{status: self.counts[status] for status in STATUSES}}

    @property
    def status(self) -> ExitStatus:
        """The exit status of a run that came to its end."""
        return ExitStatus.FRAMES_FAILED if self.counts["error"] else ExitStatus.DONE

    @property
    def _median_alignment(self) -> dict[str, float]:
        """The median of each column over the pairs; empty where no pair was measured."""
        return {name: median(column) for name, column in self._alignment.items() if column}

    @property
    def advice(self) -> str:
        """What to do about how the views lay, in a sentence; empty where the median is level."""
        found = self._median_alignment
        return advice_of(*(found[name] for name in ALIGNMENT_COLUMNS)) if found else ""

    def alignment(self) -> dict[str, float | int | str] | None:
        """Return how the views lay, for the run's record; None where no pair was measured."""
        found = self._median_alignment
        if not found:
            return None
        frames = len(self._alignment[ALIGNMENT_COLUMNS[0]])
        rounded = {name: round(value, 4) + 0.0 for name, value in found.items()}
        return {"frames": frames, **rounded, "advice": self.advice}

    def rig_roll(self) -> str:
        """Return the rig's roll in one line, such as `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
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
