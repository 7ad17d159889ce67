"""What goes wrong in a run, by its cause: each is said once, and at the end how many frames it was met in."""

import re
from dataclasses import dataclass

from rollcli.files.results import Row
from rollcli.frames.frame import named_message

_NUMBER = re.compile(r"\d[\d.]*(?:e[-+]?\d+)?")
_CAUSES = 5  # that are said; a batch where every frame fails differently is no list to read


def cause_of(message: str) -> str:
    """Return what messages of one cause share: the text without its numbers."""
    return _NUMBER.sub("#", message)


@dataclass
class _Cause:
    first: Row
    frames: int = 1
    alike: bool = True  # whether all messages are the same, to the number


class Causes:
    """Groups the messages of frames; those that differ in numbers alone have one cause."""

    def __init__(self) -> None:
        self._causes: dict[str, _Cause] = {}
        self._others = 0

    def add(self, row: Row) -> str:
        """Take the row of a frame, with its message; return what is to be said of it now, or nothing."""
        key = cause_of(row.message)
        cause = self._causes.get(key)
        if cause is not None:
            cause.frames += 1
            cause.alike &= row.message == cause.first.message
            return ""
        if len(self._causes) == _CAUSES:
            self._others += 1
            return ""
        self._causes[key] = _Cause(row)
        return named_message(row)

    def repeated(self) -> list[str]:
        """Make a line of each cause that several frames had, and one of the causes that were not said."""
        lines = []
        for cause in self._causes.values():
            if cause.frames > 1:
                what = (
                    f": {cause.first.message}" if cause.alike else f", such as {named_message(cause.first)}"
                )
                lines.append(f"{cause.frames} frames{what}")
        if self._others:
            frames = "frame" if self._others == 1 else "frames"
            lines.append(f"{self._others} further {frames}: other causes, which -v names")
        return lines
