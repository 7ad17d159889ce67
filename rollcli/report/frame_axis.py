"""The axis of frames: their time where names tell it, else their number."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rollcli.files.results import Row
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.stamps import seconds_of

_FEW = 10  # frames, each with a tick
_UNITS = (
    ("h", 3600.0, 2 * 3600.0),
    ("min", 60.0, 120.0),
    ("s", 1.0, 0.0),
)  # name, seconds, from which time on
_DECIMALS = 7  # of hours less than a thousandth of a second
_LEAST_SHARE = 0.5  # of the time, that drives take: else the pauses between them would be all that is seen


@dataclass(frozen=True)
class FrameAxis:
    """Where each frame stands along a chart.

    Attributes
    ----------
    places : sequence of float, or None
        Of each frame, in the unit; None: the numbers of frames, from 1.
    unit : str
        "s", "min" or "h" since the first frame; empty for numbers.
    """

    count: int
    places: Sequence[float] | None = None
    unit: str = ""

    def at(self, number: float) -> float:
        """Return the place of a frame, counted from 1; of half a number the middle between two."""
        if self.places is None:
            return number
        lower = int(number)
        upper = lower + (number > lower)
        return (self.places[lower - 1] + self.places[upper - 1]) / 2

    def layout(self) -> dict[str, Any]:
        """Return the axis as plotly takes it."""
        if self.places is not None:
            first, last = self.places[0], self.places[-1]
            margin = 0.01 * (last - first)
            return {
                "title": {"text": f"time, {self.unit}"},
                "range": [first - margin, last + margin],
                "zeroline": False,
            }
        margin = max(0.5, 0.01 * self.count)
        return {
            "title": {"text": "frame"},
            "range": [1 - margin, self.count + margin],
            "zeroline": False,
            "tickformat": ",d",
            **({"dtick": 1} if self.count <= _FEW else {}),  # there are no half frames
        }


def frame_axis(rows: Sequence[Row], rig: RigAssessment | None = None) -> FrameAxis:
    """Return the axis of rows: time where all frames have stamps that ascend, and pauses do not fill it.

    What stands for the broken end of a recording has no stamp, and stands where the frame before it does.
    """
    seconds = seconds_of([row.file for row in rows])
    known = np.isfinite(seconds)
    ends = np.array([row.file.endswith("#rest") for row in rows], bool)
    if not (len(rows) and known[0] and (known | ends).all()):
        return FrameAxis(len(rows))
    seconds = seconds[np.maximum.accumulate(np.where(known, np.arange(len(rows)), 0))]
    drives = [seconds[drive.frames] for drive in rig.drives] if rig is not None else [seconds]
    taken = sum(float(np.ptp(each)) for each in drives if len(each))
    whole = float(seconds[-1] - seconds[0])
    if (np.diff(seconds) < 0).any() or not taken > _LEAST_SHARE * whole:
        return FrameAxis(len(rows))
    unit, size, _ = next(each for each in _UNITS if whole >= each[2])
    return FrameAxis(len(rows), np.round(seconds / size, _DECIMALS).tolist(), unit)
