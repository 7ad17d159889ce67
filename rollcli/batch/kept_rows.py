"""The rows of an interrupted run: what a resume has to know of them."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from rollcli.batch.answer import RigAnswer
from rollcli.batch.options import EstimateOptions
from rollcli.batch.plan import Plan
from rollcli.files.results import Row
from rollcli.frames.frame import Frame
from rollcli.frames.outputs import MadeImages
from rollcli.frames.rig_alignment import RigAlignment


class Mismatch(NamedTuple):
    """The first row that is not of the frame in its place; and whether no row is of that frame."""

    row_file: str
    frame_file: str
    frame_is_new: bool


class KeptRows:
    """Takes in the rows in their order, and holds none of them: there may be a million.

    Attributes
    ----------
    count : int
        How many they are.
    errors : list of int
        Positions, from 0, of those without an angle.
    incomplete : list of Frame
        Frames whose images are missing or empty, whatever the cause.
    totals : Counter of str
        How many have each status, apart from those whose frames are done again.
    alignment : RigAlignment
    answer : RigAnswer
    mismatch : Mismatch or None
    """

    def __init__(self, plan: Plan, options: EstimateOptions, rows: Iterable[Row] = ()) -> None:
        self.count = 0
        self.errors: list[int] = []
        self.incomplete: list[Frame] = []
        self.totals: Counter[str] = Counter()
        self.alignment, self.answer = RigAlignment(), RigAnswer()
        self.mismatch: Mismatch | None = None
        self._frames, self._images = plan.frames, options.images
        self._retries = options.result.retry_failed
        self._made: MadeImages | None = None
        for row in rows:
            self.add(row)

    @property
    def failed(self) -> list[int]:
        """Positions of the rows whose frames are done again."""
        return self.errors if self._retries else []

    def not_failed(self, first: int = 0) -> Iterator[Frame]:
        """Yield the frames from a position on whose row is not `error`, or not there yet.

        Marks beside images of the others are needed until these are done again.
        """
        failed = set(self.errors)
        return (
            self._frames[position] for position in range(first, len(self._frames)) if position not in failed
        )

    def add(self, row: Row) -> None:
        """Take in the next row."""
        if self.count < len(self._frames):
            frame = self._frames[self.count]
            self._compare(row, frame)
            if row.status != "error" and not self._has_images(frame):
                self.incomplete.append(frame)
        if row.status == "error":
            self.errors.append(self.count)
        if row.status != "error" or not self._retries:
            self.totals[row.status] += 1
            self.alignment.add(row)
        self.answer.add(row)
        self.count += 1

    def _compare(self, row: Row, frame: Frame) -> None:
        found = self.mismatch
        if found is None and (row.file, row.right_file) != (frame.file, frame.right_file):
            self.mismatch = Mismatch(row.file, frame.file, row.file != frame.file)
        elif found is not None and row.file == found.frame_file:
            self.mismatch = found._replace(frame_is_new=False)

    def _has_images(self, frame: Frame) -> bool:
        if not self._images.folders():
            return True
        self._made = self._made or MadeImages(self._images)
        return self._made.has_all(frame)
