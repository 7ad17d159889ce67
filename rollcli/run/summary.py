"""What a run comes to: counts by status, how the views of pairs lay, and what the frames say about the rig.

Progress, the record of the run and the exit status read it.
"""

import math
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median
from typing import NamedTuple

from rollcli.errors import ExitStatus
from rollcli.files.results import ALIGNMENT_COLUMNS, STATUSES, Row
from rollcli.rig.calibration import Calibration
from rollcli.rig.quantities import COLUMNS
from rollcli.stereo.misalignment_words import advice_of

_MOST_FRAMES = 1_000_000  # that the rig's roll is told of: their names and numbers take 150 MB


_NO_ANGLE = bytes([STATUSES.index("error")])


class Figures(NamedTuple):
    """What the summary takes of consecutive rows.

    Attributes
    ----------
    status : bytes
        Of each row, its position in `STATUSES`.
    numbers : mapping of str to array of float
        Those of `COLUMNS` in which a row has a value; NaN where it has none.
    """

    status: bytes
    numbers: "Mapping[str, array[float]]"

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "Figures":
        """Take them of rows."""
        columns = {name: [getattr(row, name) for row in rows] for name in COLUMNS}
        return cls(
            bytes(STATUSES.index(row.status) for row in rows),
            {
                name: array("d", (math.nan if value is None else value for value in values))
                for name, values in columns.items()
                if any(value is not None for value in values)
            },
        )

    @property
    def first_error(self) -> int:
        """The position of the first row without an angle; -1 where there is none."""
        return self.status.find(_NO_ANGLE)


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
        self._too_many = False
        self._files: list[str] = []
        self._status = bytearray()
        self._numbers = {name: array("d") for name in COLUMNS}

    def add(self, files: Sequence[str], figures: Figures) -> None:
        """Take the next rows."""
        self._count(figures)
        self._append(files, figures)

    def add_row(self, row: Row) -> None:
        """Take the next row."""
        self.add([row.file], Figures.of([row]))

    def leave_places(self, files: Sequence[str]) -> None:
        """Leave the places of rows whose frames will be done, until `replace`."""
        self._append(files, Figures(_NO_ANGLE * len(files), {}))

    def replace(self, positions: Sequence[int], figures: Figures) -> None:
        """Take rows in the places at these positions, from 0, that have been left to them."""
        self._count(figures)
        for at, position in enumerate(positions):
            if position < len(self._files):
                self._status[position] = figures.status[at]
                for name, column in figures.numbers.items():
                    self._numbers[name][position] = column[at]

    def _count(self, figures: Figures) -> None:
        for place, status in enumerate(STATUSES):
            if found := figures.status.count(place):
                self.counts[status] += found

    def _append(self, files: Sequence[str], figures: Figures) -> None:
        self._too_many |= len(self._files) + len(files) > _MOST_FRAMES
        if self._too_many:
            return
        self._files.extend(files)
        self._status.extend(figures.status)
        missing = array("d", [math.nan]) * len(files)
        for name, column in self._numbers.items():
            column.extend(figures.numbers.get(name, missing))

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
    def advice(self) -> str:
        """What to do about how the views lay, in a sentence; empty where the median is level."""
        lay = [self._median(name) for name in ALIGNMENT_COLUMNS]
        return "" if lay[0] is None else advice_of(*(value or 0.0 for value in lay))

    def alignment(self) -> dict[str, float | int | str] | None:
        """Return the medians of how the views lay, for the run's record; None where no pair was measured."""
        lay = {name: self._median(name) for name in ALIGNMENT_COLUMNS}
        frames = len(self._known(ALIGNMENT_COLUMNS[0]))
        rounded = {name: round(value, 4) + 0.0 for name, value in lay.items() if value is not None}
        return {"frames": frames, **rounded, "advice": self.advice} if frames else None

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
        known = self._known(name)
        return median(known) if known else None

    def _known(self, name: str) -> list[float]:
        return [each for each in self._numbers[name] if not math.isnan(each)]
