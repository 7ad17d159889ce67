"""What a run says while it runs and at its end, and its exit status.

It belongs to `frames`, since every command that works through frames reports on them in the same way.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from rollcli.errors import ExitStatus
from rollcli.files.results import Row
from rollcli.frames.causes import Causes
from rollcli.frames.frame import FrameResult, named_message
from rollcli.frames.options import EncodingOptions, RunningOptions
from rollcli.frames.rig_alignment import RigAlignment
from rollcli.parallel.progress import TaskProgress

_MEANING = {
    "px": "pixels as stored",
    "kitti": "stored / 256",
    "cityscapes": "(stored - 1) / 256",
    "sgbm": "stored / 16",
}


class Progress(TaskProgress):
    """Counts the frames of a run, and says on stderr how far it is.

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
        super().__init__(total, quiet=running.quiet, verbose=running.verbose)
        self.counts: Counter[str] = Counter()
        self.stopped_early = False
        self._statuses = statuses
        self._auto = encoding.encoding == "auto" and encoding.scale is None
        self.alignment = RigAlignment()
        self._failures, self._warnings = Causes(), Causes()

    def __enter__(self) -> "Progress":
        super().__enter__()
        return self

    def keep(self, totals: Mapping[str, int], alignment: RigAlignment) -> None:
        """Count the rows that an interrupted run has left, by their status, and go on with its alignment."""
        self.counts.update(totals)
        self.kept += sum(totals.values())
        self.alignment = alignment

    def counted(self) -> dict[str, int]:
        """Name the failures."""
        return {"failed": self.counts["error"]}

    @property
    def totals(self) -> dict[str, int]:
        """The number of frames by status."""
        return {"frames": self.done, **{status: self.counts[status] for status in ("ok", "suspect", "error")}}

    def add(self, result: FrameResult) -> None:
        """Count a row that is written, and say what the user should know about it."""
        row = result.row
        self.counts[row.status] += 1
        self.alignment.add(row)
        self._tell_input(result)
        if row.status == "error":
            self._tell_failure(row)
        elif row.status == "suspect":
            self.detail(f"{row.file}: suspect: {row.message}")
        self.advance()

    def _tell_input(self, result: FrameResult) -> None:
        """Say once how numbers were read, and which disparities were searched."""
        name, searched = result.row.file, result.searched
        if result.encoding and self._auto:
            how = f"{name}: read as {result.encoding} ({_MEANING[result.encoding]})"
            self.note(how, topic=result.encoding)
        if result.warning:
            self._tell_warning(replace(result.row, message=f"warning: {result.warning}"))
        if searched is not None:
            how = f"{name}: searched disparities from {searched[0]} to {searched[1]} px"
            if self._verbose:
                self.detail(how)
            else:
                self.note(how, topic="searched")

    def _tell_warning(self, row: Row) -> None:
        line = self._warnings.add(row)
        if self._verbose:
            self.detail(named_message(row))
        elif line:
            self.note(line)

    def _tell_failure(self, row: Row) -> None:
        line = self._failures.add(row)
        if self._verbose:
            self.say(named_message(row))
        elif line:
            self.say(line)

    def tell_end(self) -> None:
        """Say which causes of warnings and failures were met more than once, and the summary."""
        if not self._verbose:
            for line in self._warnings.repeated():
                self.note(line)
            for line in self._failures.repeated():
                self.say(line)
        self.note(self.summary())

    def summary(self) -> str:
        """Make the last line of a run: how many frames came to what, and how fast."""
        counts = self.counts
        kept = f" ({self.kept} kept)" if self.kept else ""
        by_status = [f"{counts[status]} {status}" for status in self._statuses]
        by_status.append(f"{counts['error']} failed")
        frames = f"{self.done} frame{'' if self.done == 1 else 's'}{kept}"
        return f"{frames}: {', '.join(by_status)}; {self.seconds:.1f} s, {self.speed()}"

    @property
    def status(self) -> ExitStatus:
        """The exit status of a run that came to its end."""
        return ExitStatus.FRAMES_FAILED if self.counts["error"] else ExitStatus.DONE
