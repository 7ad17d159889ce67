"""What a run says while it runs and at its end, and its exit status.

It belongs to `frames`, since every command that works through frames reports on them in the same way.
"""

import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from types import TracebackType
from typing import Any

from rollcli.errors import ExitStatus
from rollcli.files.results import Row
from rollcli.frames.frame import FrameResult
from rollcli.frames.options import EncodingOptions, RunningOptions
from rollcli.messages import say

_LINE_EVERY_S = 30.0
_FAILURES_SHOWN = 5
_UNKNOWN_SIZE = {"ncols": 80, "nrows": 24}  # of a terminal that does not tell its size
_MEANING = {
    "px": "pixels as stored",
    "kitti": "stored / 256",
    "cityscapes": "(stored - 1) / 256",
    "sgbm": "stored / 16",
}


class Progress:
    """Counts the frames of a run, and says on stderr how far it is.

    Shows a bar on a terminal; elsewhere writes a line every half minute; when quiet, writes errors alone.

    Parameters
    ----------
    total : int
        Frames to do.
    running : RunningOptions
        How much to say.
    encoding : EncodingOptions
        An encoding that was found rather than given is named once.
    statuses : sequence of str
        The statuses of rows that the summary counts, besides "error".
    """

    def __init__(
        self,
        total: int,
        running: RunningOptions,
        encoding: EncodingOptions,
        statuses: Sequence[str] = ("ok", "suspect"),
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.total, self.stopped_early = total, False
        self._running, self._statuses = running, statuses
        self._auto = encoding.encoding == "auto" and encoding.scale is None
        self._kept = 0
        self._shown: set[str] = set()
        self._failures = 0
        self._start = self._last_line = time.monotonic()
        self._bar: Any = None

    def __enter__(self) -> "Progress":
        if not self._running.quiet and sys.stderr.isatty():
            from tqdm import tqdm  # loaded only where a person reads it

            self._bar = tqdm(
                total=self.total, initial=self._kept, unit=" frames", leave=False, **_terminal_size()
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def keep(self, rows: tuple[Row, ...]) -> None:
        """Count the rows that an interrupted run has left."""
        self.counts.update(row.status for row in rows)
        self._kept = len(rows)

    @property
    def done(self) -> int:
        """The number of rows that are written, those of an interrupted run included."""
        return self.counts.total()

    @property
    def totals(self) -> dict[str, int]:
        """The number of frames by status."""
        return {"frames": self.done, **{status: self.counts[status] for status in ("ok", "suspect", "error")}}

    def say(self, message: str) -> None:
        """Write one line, even when quiet."""
        if self._bar is not None:
            self._bar.clear()
        say(message)
        if self._bar is not None:
            self._bar.refresh()

    def note(self, message: str, topic: str = "") -> None:
        """Write one line unless quiet; the same message, or another one of the same topic, only once."""
        if (topic or message) not in self._shown and not self._running.quiet:
            self._shown.add(topic or message)
            self.say(message)

    def detail(self, message: str) -> None:
        """Write one line when verbose."""
        if self._running.verbose and not self._running.quiet:
            self.say(message)

    def add(self, result: FrameResult) -> None:
        """Count a row that is written, and say what the user should know about it."""
        row = result.row
        self.counts[row.status] += 1
        self._tell_input(result)
        if row.status == "error":
            self._tell_failure(row)
        elif row.status == "suspect":
            self.detail(f"{row.file}: suspect: {row.message}")
        self._show()

    def _tell_input(self, result: FrameResult) -> None:
        """Say once how numbers were read, and which disparities were searched."""
        name, searched = result.row.file, result.searched
        if result.encoding and self._auto:
            how = f"{name}: read as {result.encoding} ({_MEANING[result.encoding]})"
            self.note(how, topic=result.encoding)
        if result.warning:
            self.note(f"{name}: warning: {result.warning}", topic="warning")
        if searched is not None:
            how = f"{name}: searched disparities from {searched[0]} to {searched[1]} px"
            if self._running.verbose:
                self.detail(how)
            else:
                self.note(how, topic="searched")

    def _tell_failure(self, row: Row) -> None:
        self._failures += 1
        if self._failures <= _FAILURES_SHOWN or self._running.verbose:
            self.say(row.message)
        elif self._failures == _FAILURES_SHOWN + 1:
            self.say("further failures are not named here; -v names all")

    def _show(self) -> None:
        if self._bar is not None:
            self._bar.set_postfix(failed=self.counts["error"], refresh=False)
            self._bar.update()
        elif time.monotonic() - self._last_line >= _LINE_EVERY_S:
            self._last_line = time.monotonic()
            if not self._running.quiet:
                failed = self.counts["error"]
                self.say(f"{self.done} of {self.total} frames, {failed} failed, {self._speed()}")

    def _speed(self) -> str:
        seconds = time.monotonic() - self._start
        return f"{(self.done - self._kept) / max(seconds, 1e-9):.1f} frames/s"

    def summary(self) -> str:
        """Make the last line of a run: how many frames came to what, and how fast."""
        counts, seconds = self.counts, time.monotonic() - self._start
        kept = f" ({self._kept} kept)" if self._kept else ""
        by_status = [f"{counts[status]} {status}" for status in self._statuses]
        by_status.append(f"{counts['error']} failed")
        frames = f"{self.done} frame{'' if self.done == 1 else 's'}{kept}"
        return f"{frames}: {', '.join(by_status)}; {seconds:.1f} s, {self._speed()}"

    @property
    def status(self) -> ExitStatus:
        """The exit status of a run that came to its end."""
        return ExitStatus.FRAMES_FAILED if self.counts["error"] else ExitStatus.DONE


def _terminal_size() -> dict[str, Any]:
    """Choose the size of the bar: the terminal's, if that tells one."""
    try:
        known = os.get_terminal_size(sys.stderr.fileno()).columns > 0
    except OSError:  # the terminal is gone
        known = False
    return {"dynamic_ncols": True} if known else _UNKNOWN_SIZE
