"""What a report was asked to be, and which charts a result has.

Light, since the command line imports this to show its help, and files are checked before any chart is made.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rollcli.rig.quantities import QUANTITIES, ROLL
from rollcli.run.options import RunningOptions

if TYPE_CHECKING:
    from rollcli.files.results import Row

GALLERY = 12
HISTOGRAM = "histogram"
ALIGNED = "alignment"


@dataclass(frozen=True)
class ReportOptions:
    """Everything that `rollcli report` was asked.

    `results` are one result, the shards of one run, or results of several; `output` is the page, `svg`, `pdf`
    and `png` are folders for its charts; `gallery` is how many frames the page shows in pictures; `fetch`
    follows rows to any store.
    """

    results: tuple[str, ...]
    output: str | None = None
    svg: str | None = None
    pdf: str | None = None
    png: str | None = None
    images: str | None = None
    title: str | None = None
    gallery: int = GALLERY
    fetch: bool = False
    running: RunningOptions = field(default_factory=RunningOptions)

    def chart_paths(self, name: str) -> dict[str, str]:
        """Return where a chart is written, by format."""
        folders = {"svg": self.svg, "pdf": self.pdf, "png": self.png}
        return {kind: f"{folder.rstrip('/')}/{name}.{kind}" for kind, folder in folders.items() if folder}


def chart_names(rows: "Sequence[Row]") -> list[str]:
    """Return the names of the charts, `roll` first.

    Pitch and height have charts where a calibration has given them, the histogram where more than one frame
    has an angle, and how the right view lies where more than one pair was measured.
    """
    there = {each.name: any(getattr(row, each.column) is not None for row in rows) for each in QUANTITIES}
    over_frames = [name for name, some in there.items() if some or name == ROLL.name]
    angles = sum(row.roll_deg is not None for row in rows)
    pairs = sum(row.right_lower_px is not None for row in rows)
    return [*over_frames, *([HISTOGRAM] if angles > 1 else []), *([ALIGNED] if pairs > 1 else [])]
