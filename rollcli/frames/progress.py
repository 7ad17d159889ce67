"""What a run says while it runs and at its end, and the exit status it comes to."""

import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rollcli.files.results import Row
from rollcli.frames.options import EncodingOptions, RunningOptions

if TYPE_CHECKING:
    from rollcli.frames.frame import Outcome

INTERRUPTED = 130
FRAMES_FAILED = 3
_LINE_EVERY_S = 30.0
_FAILURES_SHOWN = 5
_UNKNOWN_SIZE = {"ncols": 80, "nrows": 24}  # of a terminal that does not tell
_FRAMES = ("frames", "frame")
_MEANING = {
    "px": "pixels as stored",
    "kitti": "stored / 256",
    "cityscapes": "(stored - 1) / 256",
    "sgbm": "stored / 16",
}


class Report:
    """Counts, progress and messages of one run, all on stderr.

    A bar on a terminal; elsewhere a line every half minute; nothing but errors when quiet.

    Parameters
    ----------
    total : int
        Frames to do.
    running : RunningOptions
        How much to say.
    encoding : EncodingOptions
        An encoding that was found rather than given is said.
    statuses : sequence of str
        What a row can come to, besides "error".
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
        self._options, self._statuses = running, statuses
        self._auto = encoding.encoding == "auto" and encoding.scale is None
        self._kept = 0
        self._shown: set[str] = set()
        self._failures = 0
        self._start = self._last_line = time.monotonic()
        self._bar: Any = None

    def __enter__(self) -> "Report":
        if not self._options.quiet and sys.stderr.isatty():
            from tqdm import tqdm  # only where there is someone to look

            known = os.get_terminal_size(sys.stderr.fileno()).columns > 0
            size = {"dynamic_ncols": True} if known else _UNKNOWN_SIZE
            self._bar = tqdm(total=self.total, initial=self._kept, unit=" frames", leave=False, **size)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def keep(self, rows: tuple[Row, ...]) -> None:
        """Count the rows of an interrupted run."""
        self.counts.update(row.status for row in rows)
        self._kept = len(rows)

    @property
    def done(self) -> int:
        """Rows that are written, those of an interrupted run included."""
        return self.counts.total()

    @property
    def totals(self) -> dict[str, int]:
        """Frames by status."""
        return {"frames": self.done, **{status: self.counts[status] for status in ("ok", "suspect", "error")}}

    def say(self, message: str) -> None:
        """One line, even when quiet."""
        if self._bar is not None:
            self._bar.clear()
        sys.stderr.write(f"rollcli: {message}\n")
        if self._bar is not None:
            self._bar.refresh()

    def note(self, message: str, topic: str = "") -> None:
        """One line, the first time only (that something is said on the topic); not when quiet."""
        if (topic or message) not in self._shown and not self._options.quiet:
            self._shown.add(topic or message)
            self.say(message)

    def detail(self, message: str) -> None:
        """One line when verbose."""
        if self._options.verbose and not self._options.quiet:
            self.say(message)

    def add(self, outcome: "Outcome") -> None:
        """Count a row that is written, and say what there is to say about it."""
        row = outcome.row
        self.counts[row.status] += 1
        self._tell_input(outcome)
        if row.status == "error":
            self._tell_failure(row)
        elif row.status == "suspect":
            self.detail(f"{row.file}: suspect: {row.message}")
        self._progress()

    def _tell_input(self, outcome: "Outcome") -> None:
        """Once: how numbers were read, and which disparities were searched."""
        name, searched = outcome.row.file, outcome.searched
        if outcome.encoding and self._auto:
            how = f"{name}: read as {outcome.encoding} ({_MEANING[outcome.encoding]})"
            self.note(how, topic=outcome.encoding)
        if outcome.warning:
            self.note(f"{name}: warning: {outcome.warning}", topic="warning")
        if searched is not None:
            how = f"{name}: searched disparities from {searched[0]} to {searched[1]} px"
            if self._options.verbose:
                self.detail(how)
            else:
                self.note(how, topic="searched")

    def _tell_failure(self, row: Row) -> None:
        self._failures += 1
        if self._failures <= _FAILURES_SHOWN or self._options.verbose:
            self.say(row.message)
        elif self._failures == _FAILURES_SHOWN + 1:
            self.say("further failures are not named here; -v names all")

    def _progress(self) -> None:
        if self._bar is not None:
            self._bar.set_postfix(failed=self.counts["error"], refresh=False)
            self._bar.update()
        elif time.monotonic() - self._last_line >= _LINE_EVERY_S:
            self._last_line = time.monotonic()
            if not self._options.quiet:
                failed = self.counts["error"]
                self.say(f"{self.done} of {self.total} frames, {failed} failed, {self._speed()}")

    def _speed(self) -> str:
        seconds = time.monotonic() - self._start
        return f"{(self.done - self._kept) / max(seconds, 1e-9):.1f} frames/s"

    def summary(self) -> str:
        """The last line of a run."""
        counts, seconds = self.counts, time.monotonic() - self._start
        kept = f" ({self._kept} kept)" if self._kept else ""
        ends = [f"{counts[status]} {status}" for status in self._statuses]
        ends.append(f"{counts['error']} failed")
        of = f"{self.done} {_FRAMES[self.done == 1]}{kept}"
        return f"{of}: {', '.join(ends)}; {seconds:.1f} s, {self._speed()}"

    @property
    def status(self) -> int:
        """The exit status of a run that came to its end."""
        return FRAMES_FAILED if self.counts["error"] else 0
