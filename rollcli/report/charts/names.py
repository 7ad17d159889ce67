"""Which charts a result has. Import-light: files are checked before any chart is made."""

from collections.abc import Sequence

from rollcli.files.results import Row
from rollcli.rig.quantities import QUANTITIES, ROLL

HISTOGRAM = "histogram"


def chart_names(rows: Sequence[Row]) -> list[str]:
    """Return the names of the charts, `roll` first.

    Pitch and height have charts where a calibration has given them, the histogram where more than
    one frame has an angle.
    """
    there = {each.name: any(getattr(row, each.column) is not None for row in rows) for each in QUANTITIES}
    over_frames = [name for name, some in there.items() if some or name == ROLL.name]
    angles = sum(row.roll_deg is not None for row in rows)
    return [*over_frames, *([HISTOGRAM] if angles > 1 else [])]
