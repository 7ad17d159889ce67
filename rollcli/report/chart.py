"""A chart, how a page holds it, and which charts a result has.

Import-light: files are checked before any chart is made.
"""

import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rollcli.files.results import Row
from rollcli.rig.quantities import QUANTITIES, ROLL

HISTOGRAM = "histogram"
ALIGNED = "alignment"


@dataclass(frozen=True)
class Chart:
    """A chart as plotly's script takes it; prints itself in a template.

    Attributes
    ----------
    name : str
        Its id on the page, and the name of the picture that a reader saves.
    label : str
        What it shows, for those who cannot see it.
    data : sequence of mapping
        The traces. No NaN: None where there is no value. A colour may be "@" and a name of the page's own
        colours, such as "@c1", "@ok" or "@muted": these follow light and dark mode.
    layout : mapping
        Titles, ranges, kinds of axes; fonts, margins and colours are the page's.
    still : str
        HTML that shows it until plotly has drawn it, or where no script runs.
    """

    name: str
    label: str
    data: Sequence[Mapping[str, Any]]
    layout: Mapping[str, Any] = field(default_factory=dict)
    still: str = ""

    def __html__(self) -> str:
        """Return the chart's place and its content."""
        content = script_json({"data": self.data, "layout": self.layout})
        name = html.escape(self.name)
        label = html.escape(self.label)
        return (
            f'<div class="chart" id="{name}" role="img" aria-label="{label}">{self.still}</div>'
            f'<script type="application/json" data-chart="{name}">{content}</script>'
        )


def script_json(value: Any) -> str:
    """Return JSON for a script element, which file names in it cannot end."""
    content = json.dumps(value, allow_nan=False)
    for mark in "<>&\u2028\u2029":
        content = content.replace(mark, f"\\u{ord(mark):04x}")
    return content


def chart_names(rows: Sequence[Row]) -> list[str]:
    """Return the names of the charts, `roll` first.

    Pitch and height have charts where a calibration has given them, the histogram where more than one frame
    has an angle, and how the right view lies where more than one pair was measured.
    """
    there = {each.name: any(getattr(row, each.column) is not None for row in rows) for each in QUANTITIES}
    over_frames = [name for name, some in there.items() if some or name == ROLL.name]
    angles = sum(row.roll_deg is not None for row in rows)
    pairs = sum(row.right_lower_px is not None for row in rows)
    return [*over_frames, *([HISTOGRAM] if angles > 1 else []), *([ALIGNED] if pairs > 1 else [])]
