"""The options of the page, and the names of its charts. Import-light, for the help."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rollcli.files.results import Row
from rollcli.rig.quantities import QUANTITIES, ROLL
from rollcli.run.options import RunningOptions

GALLERY = 12


@dataclass(frozen=True)
class ReportOptions:
    """Everything that `rollcli report` was asked.

    `output` is the page, `png` and `svg` are folders for its charts; `gallery` is how many frames the page
    shows in pictures; `fetch` follows rows to any store.
    """

    result: str
    output: str | None = None
    png: str | None = None
    svg: str | None = None
    images: str | None = None
    title: str | None = None
    gallery: int = GALLERY
    fetch: bool = False
    running: RunningOptions = field(default_factory=RunningOptions)

    def chart_paths(self, name: str) -> dict[str, str]:
        """Return where a chart is written, by format."""
        folders = {"svg": self.svg, "png": self.png}
        return {kind: f"{folder.rstrip('/')}/{name}.{kind}" for kind, folder in folders.items() if folder}


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
