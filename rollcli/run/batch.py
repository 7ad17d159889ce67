"""What workers do with frames, whatever the command, and what they hand back of consecutive ones.

That is few bytes, and the rows themselves only if it must: a worker that has all the rows of a part writes
it. The others come back as lines, and the dispatcher writes them. Import-light: a worker alone loads what
reads, estimates and draws.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from typing import Any, NamedTuple

from rollcli.errors import UsageError
from rollcli.files.atomic import remove_leftovers, sync_files
from rollcli.files.containers import file_of
from rollcli.files.results import column_types, encode_parquet, format_header, format_row, run_path
from rollcli.files.storage import create, write_bytes
from rollcli.files.stores.locations import is_url, public_name, tasks_in_hand
from rollcli.files.stores.objects import object_owner
from rollcli.run.frame import Frame, FrameResult, ReadAs, failed_frame
from rollcli.run.options import EstimateOptions, FramesOptions
from rollcli.run.outputs import files_of, local_files, write_outputs
from rollcli.run.progress import Figures
from rollcli.run.result_file import inputs_line, part_paths
from rollcli.run.workers.chunks import Span, Work, Workers


def do_frame(frame: Frame, options: FramesOptions) -> FrameResult:
    """Do the work on a frame, on a worker."""
    from rollcli.run.frame_task import run_frame

    return run_frame(frame, options)


def work_on(frames: Iterable[Frame], options: FramesOptions, **further: Any) -> Work[Frame, FrameResult]:
    """Say what is done with frames; `further` are fields of `Work`."""

    def lost(frame: Frame, reason: str) -> FrameResult:
        write_outputs(frame, {}, options)  # its files of an earlier run go
        return failed_frame(frame, reason)

    def clear(some: Iterable[Frame]) -> None:
        if not options.retry_of:  # halves of files go when the row is written, with marks needed until then
            remove_leftovers(files_of(some, options.writes))

    def prepare(frame: Frame) -> Frame:
        from rollcli.run.read import decoded  # loads NumPy, which other runs leave to the workers

        return decoded(frame, options)

    videos = any(frame.of_videos for frame in frames)
    do = partial(do_frame, options=options)
    return Work(do, lost, clear, prepare=prepare if videos else None, **further)


def workers_for(frames: Sequence[Frame], options: FramesOptions, parts: Iterable[str] = ()) -> Workers:
    """Say which workers do the frames, what they write, and what they must see.

    `parts`: the folder of those parts of a result that they write.
    """
    files = tuple(file_of(path) for frame in (*frames[:1], *frames[-1:]) for path in frame.reads())
    folders, running = options.folders, options.running
    threads = tasks_in_hand((*files, *folders))
    return Workers(running.jobs, running.scheduler, files, (*folders, *parts), threads)


@dataclass(frozen=True)
class Batch:
    """The results of consecutive frames.

    Attributes
    ----------
    figures : Figures
    in_parts : int
        How many rows, from the first on, stand in parts that the worker has written.
    lines : list of bytes
        The other rows as they stand in the result.
    notes : list of bytes
        What the frames of these were read from, where the result keeps it; see `result_file.inputs_line`.
    read_as : ReadAs
    told : list of FrameResult
        Those of which the user is told.
    """

    figures: Figures
    in_parts: int
    lines: list[bytes]
    notes: list[bytes]
    read_as: ReadAs
    told: list[FrameResult]

    def __len__(self) -> int:
        return len(self.figures.status)


class Step(NamedTuple):
    """Frames that workers do in one go.

    Attributes
    ----------
    frames : sequence of Frame
    positions : sequence of int
        Of their rows in the result, increasing; none where the images of kept rows are made again.
    retries : bool
        Whether the rows take the place of kept ones.
    """

    frames: Sequence[Frame]
    positions: Sequence[int] = ()
    retries: bool = False


def check_owned(output: str, run: str) -> None:
    """Check that no other run has begun since on a result in an object store, which has no locks.

    The run that begins last goes on, and those before it end: they may hang, or have lost their network.

    Raises
    ------
    UsageError
        Another one has.
    """
    if is_url(output) and object_owner(run_path(output)) not in (run, ""):
        raise UsageError(
            f"{public_name(output)}: another run has begun to write this result, so this one ends; "
            "give each an --output of its own"
        )


class BatchOptions(NamedTuple):
    """What a worker is told of the rows that it makes, and how parts of a result are written of them.

    Attributes
    ----------
    told : EstimateOptions
        What it is told of the frames, and how rows are written.
    further : tuple of str
        Columns beside those of every result.
    output : str
        The folder of the parts that it writes; empty: all rows come back.
    numbers : sequence of int
        The parts of the step, in order.
    frames : int
        How many frames the step has.
    of_rows : mapping
        What Parquet's metadata say of the rows.
    """

    told: EstimateOptions
    further: tuple[str, ...] = ()
    output: str = ""
    numbers: Sequence[int] = ()
    frames: int = 0
    of_rows: Mapping[str, Any] = {}

    def write(self, number: int, lines: Sequence[bytes], notes: Sequence[bytes]) -> None:
        """Write what a part was made from, then the part, whole, unless there is one.

        Raises
        ------
        UsageError
            Another run has written it, or has begun to write this result.
        OutputError
            It cannot be written.
        """
        location, inputs = part_paths(self.output, self.told.result.form, number)
        check_owned(self.output, self.told.run)
        write_bytes(inputs, b"".join(notes), durable=True)
        if not create(location, self.encoded(number, lines), self.told.run):
            raise UsageError(
                f"{location}: another run has written this part; give each an --output of its own"
            )

    def encoded(self, number: int, lines: Sequence[bytes]) -> bytes:
        """Make the bytes of a part of its lines."""
        form = self.told.result.form
        if form == "parquet":
            return encode_parquet(column_types(self.further), list(map(json.loads, lines)), self.of_rows)
        header = format_header(form, self.further) if number == 0 else b""
        return header + b"".join(lines)


def join_results(frames: Span[Frame], results: Sequence[FrameResult], options: BatchOptions) -> Batch:
    """Make one record of the results of consecutive frames, and write those parts that they fill.

    The run's record says how frames were read before their rows are in the result. Where it does not say so
    of these by now (`frames.told`), they come back.

    Raises
    ------
    UsageError, OutputError
        A part cannot be written.
    """
    failed = (number for number, each in enumerate(results, 1) if each.row.status == "error")
    end = next(failed, None) if options.told.result.fail_fast else None
    results = results[:end]
    figures = Figures.of([result.row for result in results])
    read_as = reduce(ReadAs.joined, {each.read_as for each in results}, ReadAs())
    # those of Parquet are JSON until a part is full
    lines = [format_row(result.row, options.told.result.form, options.further) for result in results]
    known: ReadAs = frames.told
    made = zip(frames, results, strict=False) if options.told.notes else ()
    notes = [result.inputs or inputs_line(frame, {}) for frame, result in made]
    in_parts = 0
    if options.output and end is None and known.joined(read_as) == known:
        in_parts = _write_parts(frames, figures.status, lines, notes, options)
    told = list(results) if options.told.running.verbose else list(_told(results))
    return Batch(figures, in_parts, lines[in_parts:], notes[in_parts:], read_as, told)


def _write_parts(
    frames: Span[Frame], status: bytes, lines: Sequence[bytes], notes: Sequence[bytes], options: BatchOptions
) -> int:
    """Write the parts that the lines fill, if they begin with one; return how many lines that were."""
    part_rows, writes, written = options.told.result.part_rows, options.told.writes, 0
    while frames.first % part_rows == 0 and written < len(lines):
        first = frames.first + written
        end = written + min(part_rows, options.frames - first)
        if end > len(lines):
            break
        sync_files(local_files(frames[written:end], status[written:end], writes))
        options.write(options.numbers[first // part_rows], lines[written:end], notes[written:end])
        written = end
    return written


def _told(results: Sequence[FrameResult]) -> Iterator[FrameResult]:
    """Yield the results that say something which those before them do not."""
    known: set[str] = {""}
    for result in results:
        says = {*result.read_as.encodings, "searched" if result.read_as.searched else ""} - known
        if says or result.warning or result.row.status == "error":
            known |= says
            yield result
