"""How far a run of tasks is, said on stderr."""

import os
import sys
import time
from types import TracebackType
from typing import Any

from rollcli.messages import say

_LINE_EVERY_S = 30.0
_UNKNOWN_SIZE = {"ncols": 80, "nrows": 24}  # of a terminal that does not tell its size


class TaskProgress:
    """Shows a bar on a terminal; elsewhere writes a line every half minute.

    Parameters
    ----------
    total : int
        Frames to do.
    quiet, verbose : bool
        Whether to write errors alone, or details too.
    """

    def __init__(self, total: int, *, quiet: bool = False, verbose: bool = False) -> None:
        self.total, self.kept = total, 0
        self._quiet, self._verbose = quiet, verbose
        self._finished = 0
        self._shown: set[str] = set()
        self._start = self._last_line = time.monotonic()
        self._bar: Any = None

    def __enter__(self) -> "TaskProgress":
        if not self._quiet and sys.stderr.isatty():
            from tqdm import tqdm  # loaded only where a person reads it

            self._bar = tqdm(
                total=self.total, initial=self.kept, unit=" frames", leave=False, **_terminal_size()
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    @property
    def done(self) -> int:
        """The number of frames that are done, those of an interrupted run included."""
        return self.kept + self._finished

    @property
    def seconds(self) -> float:
        """The time since the start, seconds."""
        return time.monotonic() - self._start

    def say(self, message: str) -> None:
        """Write one line, even when quiet."""
        if self._bar is not None:
            self._bar.clear()
        say(message)
        if self._bar is not None:
            self._bar.refresh()

    def note(self, message: str, topic: str = "") -> None:
        """Write one line unless quiet; the same message, or another one of the same topic, only once."""
        if (topic or message) not in self._shown and not self._quiet:
            self._shown.add(topic or message)
            self.say(message)

    def detail(self, message: str) -> None:
        """Write one line when verbose."""
        if self._verbose and not self._quiet:
            self.say(message)

    def advance(self) -> None:
        """Count a frame, and show it when there is something to show."""
        self._finished += 1
        if self._bar is not None:
            self._bar.set_postfix(self.counted(), refresh=False)
            self._bar.update()
        elif time.monotonic() - self._last_line >= _LINE_EVERY_S:
            self._last_line = time.monotonic()
            if not self._quiet:
                counted = "".join(f", {number} {what}" for what, number in self.counted().items())
                self.say(f"{self.done} of {self.total} frames{counted}, {self.speed()}{self._left()}")

    def counted(self) -> dict[str, int]:
        """Name what else is shown beside the number of frames."""
        return {}

    def speed(self) -> str:
        """Say how many frames were done in a second, those of an interrupted run left out."""
        return f"{self._finished / max(self.seconds, 1e-9):.1f} frames/s"

    def _left(self) -> str:
        """Say how long the rest takes at this speed."""
        seconds = self.seconds / self._finished * (self.total - self.done)
        return f", about {_rough(seconds)} left" if seconds else ""


def _rough(seconds: float) -> str:
    """Say how long something takes, in the unit of which there are a few."""
    for name, size in (("h", 3600), ("min", 60)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.0f} {name}"
    return f"{seconds:.0f} s"


def _terminal_size() -> dict[str, Any]:
    """Choose the size of the bar: the terminal's, if that tells one."""
    try:
        known = os.get_terminal_size(sys.stderr.fileno()).columns > 0
    except OSError:  # the terminal is gone
        known = False
    return {"dynamic_ncols": True} if known else _UNKNOWN_SIZE
