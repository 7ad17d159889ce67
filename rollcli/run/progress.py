"""What a run comes to, and what is said while its frames run: a bar or lines, counts, causes of failure.

`RunSummary` is what progress, the record of the run and the exit status read.
"""

import math
import os
import sys
import time
from array import array
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from statistics import median
from typing import Any, NamedTuple

from rollcli.errors import ExitStatus
from rollcli.files.results import ALIGNMENT_COLUMNS, STATUSES, Row
from rollcli.messages import say
from rollcli.rig.calibration import Calibration
from rollcli.rig.quantities import COLUMNS, SIZE
from rollcli.run.frame import FrameResult
from rollcli.run.options import FramesOptions, RunningOptions
from rollcli.stereo.correction import Correction
from rollcli.stereo.misalignment import advice_of

_MOST_FRAMES = 1_000_000  # that the rig's roll is told of: their names and numbers take 150 MB


class Figures(NamedTuple):
    """What the summary takes of consecutive rows.

    Attributes
    ----------
    status : bytes
        Of each row, its position in `STATUSES`.
    numbers : array of float
        The values of `COLUMNS`, row by row; NaN where a row has none.
    """

    status: bytes
    numbers: "array[float]"

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "Figures":
        """Take them of rows."""
        values = (getattr(row, name) for row in rows for name in COLUMNS)
        numbers = array("d", (math.nan if value is None else value for value in values))
        return cls(bytes(STATUSES.index(row.status) for row in rows), numbers)


class RunSummary:
    """Takes in the rows of a run, in any order.

    Import-light: the dispatcher loads NumPy only for the rig's roll, once the workers have ended.

    Attributes
    ----------
    counts : Counter of str
        How many rows have each status.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._files: list[str] = []
        self._places = array("Q")
        self._status = bytearray()
        self._numbers = array("d")  # see `Figures.numbers`

    def add(self, files: Sequence[str], figures: Figures, places: Sequence[int]) -> None:
        """Take rows, which stand at these places of the result, from 0."""
        self.counts.update(STATUSES[place] for place in figures.status)
        if self._too_many:
            return
        self._files.extend(files)
        self._places.extend(places)
        self._status.extend(figures.status)
        self._numbers.extend(figures.numbers)

    def add_row(self, row: Row, place: int = 0) -> None:
        """Take a row; those of one place stay in the order in which they come."""
        self.add([row.file], Figures.of([row]), [place])

    @property
    def _too_many(self) -> bool:
        return self.frames > _MOST_FRAMES

    @property
    def frames(self) -> int:
        """The number of frames that are done."""
        return self.counts.total()

    @property
    def totals(self) -> dict[str, int]:
        """The number of frames, and by status."""
        return {"frames": self.frames, **{status: self.counts[status] for status in STATUSES}}

    @property
    def status(self) -> ExitStatus:
        """The exit status of a run that came to its end."""
        return ExitStatus.FRAMES_FAILED if self.counts["error"] else ExitStatus.DONE

    def alignment(
        self, told: Correction | None = None, *, matched: bool = True
    ) -> dict[str, float | int | str] | None:
        """Return the medians of how the views lay, for the run's record; None where no pair was measured.

        Their `advice` is what to do about it, in a sentence; empty where the median is level, or lies as a
        correction that was `told` says, and where this run has not `matched` them: what did has told it.
        """
        lay = {name: self._median(name) for name in ALIGNMENT_COLUMNS}
        frames = len(self._known(ALIGNMENT_COLUMNS[0]))
        rounded = {name: round(value, 4) + 0.0 for name, value in lay.items() if value is not None}
        left = [value or 0.0 for value in lay.values()]
        width, height = (round(self._median(name) or 0) for name in SIZE)
        if told is not None and frames and width and height:
            level = told.resized(width, height).lies.values(height, width)
            left = [value - known for value, known in zip(left, level, strict=True)]
        advice = advice_of(*left) if matched else ""
        return {"frames": frames, **rounded, "advice": advice} if frames else None

    def rig_roll(self) -> str:
        """Return the rig's roll in one line, such as `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
        if self._too_many:
            return f"more than {_MOST_FRAMES:,} frames: rollcli rig RESULT says what they say of the rig"
        import numpy as np

        from rollcli.rig.drive.assess import RigFrames, assess_frames
        from rollcli.rig.words import one_line

        order = np.argsort(self._places, kind="stable")
        status = np.asarray(self._status)[order]
        ok, suspect = (status == STATUSES.index(name) for name in ("ok", "suspect"))
        numbers = np.asarray(self._numbers).reshape(-1, len(COLUMNS))[order].T
        columns = dict(zip(COLUMNS, np.ascontiguousarray(numbers), strict=True))
        return one_line(assess_frames(RigFrames([self._files[at] for at in order], ok, suspect, columns)))

    def pose_note(self, calibration: Calibration | None, downscale: float) -> str:
        """Return what the intervals of pitch and height leave out; empty where no frame has a pitch.

        Maps were matched at 1/downscale of their images' size.
        """
        pitch, height, width, rows = map(self._median, ("pitch_deg", "height_m", *SIZE))
        if calibration is None or pitch is None or width is None or rows is None:
            return ""
        from rollcli.rig.pose import taken_as_exact

        if calibration.width is None:  # its numbers are for the images as they are
            scale = 1 / downscale
            calibration = replace(calibration, width=round(width / scale), height=round(rows / scale))
        else:
            scale = width / calibration.width
        return taken_as_exact(calibration, math.radians(pitch), height, scale)

    def _median(self, name: str) -> float | None:
        known = self._known(name)
        return median(known) if known else None

    def _known(self, name: str) -> list[float]:
        values = self._numbers[COLUMNS.index(name) :: len(COLUMNS)]
        return [each for each in values if not math.isnan(each)]


_LINE_EVERY_S = 30.0
_UNKNOWN_SIZE = {"ncols": 80, "nrows": 24}  # of a terminal that does not tell its size


class TaskProgress:
    """Shows a bar on a terminal; elsewhere writes a line every half minute.

    Parameters
    ----------
    total : int
        Frames to do.
    running : RunningOptions
        How much to say.
    """

    def __init__(self, total: int, running: RunningOptions) -> None:
        self.total, self.kept = total, 0
        self._quiet, self._verbose = running.quiet, running.verbose
        self._finished = 0
        self._shown: set[str] = set()
        self._start = self._last_line = time.monotonic()
        self._bar: Any = None

    def __enter__(self) -> "TaskProgress":
        if not self._quiet and sys.stderr.isatty():
            from tqdm import tqdm  # loaded only where a person reads it

            tqdm.monitor_interval = 0  # its thread would keep workers from being forked
            how: dict[str, Any] = {"unit": " frames", "leave": False, "miniters": 1, **_terminal_size()}
            self._bar = tqdm(total=self.total, initial=self.kept, **how)
        return self

    def __exit__(self, *raised: object) -> None:
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

    def advance(self, frames: int = 1) -> None:
        """Count frames, and show them when there is something to show."""
        self._finished += frames
        if self._bar is not None:
            self._bar.set_postfix(self.counted(), refresh=False)
            self._bar.update(frames)
        elif time.monotonic() - self._last_line >= _LINE_EVERY_S:
            self._last_line = time.monotonic()
            if not self._quiet:
                counted = "".join(f", {number} {what}" for what, number in self.counted().items())
                self.say(f"{self.done} of {self.total} frames{counted}, {self.speed()}{self._left()}")

    def counted(self) -> dict[str, int]:
        """Name what else is shown beside the number of frames."""
        return {}

    def frames(self) -> str:
        """Say how many frames are done, and how many of them were kept."""
        kept = f" ({self.kept} kept)" if self.kept else ""
        return f"{self.done} frame{'' if self.done == 1 else 's'}{kept}"

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


_CAUSES = 5  # that are said; a batch where every frame fails differently is no list to read


class Causes:
    """Groups the messages of frames by the codes of their causes."""

    def __init__(self) -> None:
        self._lines: dict[str, str] = {}  # of the first frame that had it
        self._frames: Counter[str] = Counter()
        self._others = 0

    def add(self, code: str, line: str) -> str:
        """Take the line that names a frame and says what it has; return it if it is to be said now."""
        if code not in self._lines and len(self._lines) == _CAUSES:
            self._others += 1
            return ""
        self._frames[code] += 1
        return self._lines.setdefault(code, line) if self._frames[code] == 1 else ""

    def repeated(self) -> list[str]:
        """Make a line of each cause that several frames had, and one of the causes that were not said."""
        several = ((code, count) for code, count in self._frames.items() if count > 1)
        lines = [f"{count} frames, such as {self._lines[code]}" for code, count in several]
        if self._others:
            frames = "frame" if self._others == 1 else "frames"
            lines.append(f"{self._others} further {frames}: other causes, which -v names")
        return lines


_MEANING = {  # of what "auto" stands for
    "px": "pixels as stored",
    "kitti": "stored / 256",
    "sgbm": "stored / 16",
}


class Progress(TaskProgress):
    """Says on stderr how far a run is.

    Parameters
    ----------
    total : int
        Frames to do.
    options : FramesOptions
        How much to say. An encoding that was found rather than given is named once.
    statuses : sequence of str
        The statuses of rows that the last line counts, besides "error".
    summary : RunSummary or None
        What the rows of an interrupted run come to, which this one goes on with.
    """

    def __init__(
        self, total: int, options: FramesOptions, statuses: Sequence[str], summary: RunSummary | None = None
    ) -> None:
        super().__init__(total, options.running)
        self.summary = summary or RunSummary()
        self.kept = self.summary.frames
        self._statuses, self._told, self._matched = statuses, options.stereo.correction, options.paired
        self._auto = options.encoding.encoding == "auto" and options.encoding.scale is None
        self._failures, self._warnings = Causes(), Causes()

    def counted(self) -> dict[str, int]:
        """Name the failures."""
        return {"failed": self.summary.counts["error"]}

    def add(self, result: FrameResult) -> None:
        """Count a frame that is done, and say what the user should know about it."""
        self.add_rows([result.row.file], Figures.of([result.row]), [self.done], [result])

    def add_rows(
        self, files: Sequence[str], figures: Figures, places: Sequence[int], told: Iterable[FrameResult]
    ) -> None:
        """Count rows that are written, and say what the user should know about some of their frames."""
        self.summary.add(files, figures, places)
        for result in told:
            self._tell_input(result)
            if result.row.status == "error":
                first = self._failures.add(result.cause, result.said)
                if first or self._verbose:
                    self.say(result.said)
            elif result.row.status == "suspect":
                self.detail(f"{result.row.file}: suspect: {result.row.message}")
        self.advance(len(files))

    def _tell_input(self, result: FrameResult) -> None:
        """Say once how numbers were read, and which disparities were searched."""
        name, searched = result.row.file, result.read_as.searched
        for encoding in result.read_as.encodings if self._auto else ():
            self.note(f"{name}: read as {encoding} ({_MEANING[encoding]})", topic=encoding)
        if warning := result.warning:
            code = " ".join(filter(result.warnings.get, result.warnings))
            line = f"{name}: warning: {warning}"
            first = self._warnings.add(code, line)
            if first or self._verbose:
                self.note(line)
        if searched is not None:
            how = f"{name}: searched disparities from {searched[0]} to {searched[1]} px"
            self.note(how, topic="" if self._verbose else "searched")

    def tell_end(self) -> None:
        """Say which causes of warnings and failures were met more than once, and the summary."""
        if not self._verbose:
            for line in self._warnings.repeated():
                self.note(line)
            for line in self._failures.repeated():
                self.say(line)
        counts = self.summary.counts
        by_status = [f"{counts[status]} {status}" for status in self._statuses]
        by_status.append(f"{counts['error']} failed")
        self.note(f"{self.frames()}: {', '.join(by_status)}; {self.seconds:.1f} s, {self.speed()}")
        if advice := (self.summary.alignment(self._told, matched=self._matched) or {}).get("advice"):
            beside = "" if self._told is None else "beside what --align says, "
            self.note(f"median over the pairs: {beside}{advice}")
