"""What a chart says of a frame under the pointer."""

import html
import textwrap

from rollcli.files.results import Row

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
