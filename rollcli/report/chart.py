"""One chart of the page: its traces as plotly takes them, and its labels."""

import html
import json
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rollcli.files.results import Row


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


_LONGEST = 44  # characters in a line, so that a label fits a narrow screen
_LINES = 5  # of a reason; the table and the gallery show all of it


def label(row: Row, value: str) -> str:
    """Return the name of a frame, its value, and why it is suspect or has failed.

    plotly takes tags and entities in a label for its own, so names and reasons are escaped.
    """
    name = row.file if len(row.file) <= _LONGEST else f"…{row.file[1 - _LONGEST :]}"
    lines = [name, *([value] if value else [])]
    if row.status != "ok":
        lines.append("failed" if row.status == "error" else "suspect")
        lines += textwrap.wrap(row.message, _LONGEST, max_lines=_LINES, placeholder=" …")
    return "<br>".join(map(html.escape, lines))
