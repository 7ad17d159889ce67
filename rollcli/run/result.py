"""Where the rows of a run go: to a stream, or to a file with the record of the run beside it."""

import contextlib
import io
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, islice

from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import is_there, remove_leftovers
from rollcli.files.locking import not_resumable
from rollcli.files.results import format_header, parse_rows, run_path
from rollcli.files.stores.locations import base_name
from rollcli.files.stream import STDOUT, is_stream, open_stream
from rollcli.run.batch import Batch, Step
from rollcli.run.frame import Frame
from rollcli.run.outputs import local_images, remove_image_leftovers
from rollcli.run.parts import PartsOutput, kept_in_parts, open_parts
from rollcli.run.plan import Plan
from rollcli.run.progress import RunSummary
from rollcli.run.result_file import (
    DurableRows,
    Inputs,
    ResultFile,
    data_of,
    has_rows,
    inputs_path,
    is_inputs,
    kept_rows,
    open_result,
    row_lines,
)
from rollcli.run.resume import (
    KeptRows,
    RecordedOutput,
    RunRecord,
    arranged,
    is_replaceable_record,
    new_record,
)


class StreamOutput:
    """Rows to stdout, a pipe or a device."""

    record = None

    def __init__(self, write: Callable[[bytes], None], plan: Plan) -> None:
        self.kept = KeptRows(plan)
        self._write, self._plan = write, plan
        self._write(format_header(plan.format, plan.further))

    def passes(self) -> Iterator[Step]:
        """Yield all frames."""
        yield Step(self._plan.frames, range(len(self._plan.frames)))

    def append(self, frames: Sequence[Frame], batch: Batch) -> None:
        """Write the rows; they have left this process when this returns."""
        self._write(b"".join(batch.lines))

    def finish(self, summary: RunSummary) -> None:
        """Do nothing: a stream has no record."""

    def restore(self, frames: Sequence[Frame], batch: Batch) -> None:
        """Do nothing: a stream keeps no rows."""

    def replace(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Do nothing: a stream keeps no rows."""

    def commit(self) -> None:
        """Do nothing: no row waits."""

    def hint(self) -> str:
        """Return nothing: a stream cannot be resumed."""
        return ""


class FileOutput(RecordedOutput):
    """Rows to a locked file, FILE.inputs and FILE.run.json beside it; images are durable before their row."""

    def __init__(self, file: ResultFile, inputs: ResultFile, record: RunRecord, kept: KeptRows) -> None:
        super().__init__(record, kept)
        self._file, self._inputs, self._rows = file, inputs, DurableRows(file, inputs)

    def passes(self) -> Iterator[Step]:
        """Yield the frames after the rows that are kept."""
        frames = self._plan.frames
        yield Step(frames[self.kept.count :], range(self.kept.count, len(frames)))

    def append(self, frames: Sequence[Frame], batch: Batch) -> None:
        """Add the rows, after the record knows how their frames were read; they may wait for others."""
        self.record.saw(batch.read_as)
        images = local_images(frames, batch.figures.status, self._plan.options.images)
        self._rows.append(batch.lines, batch.notes, images)

    def _keep_images(self, images: Iterable[str]) -> None:
        self._rows.append((), (), images)

    def commit(self) -> None:
        """Force the images and rows that were added to the disk."""
        self._rows.commit()
        if self._replacing:
            rows = {at: row for at, (row, _) in self._replacing.items()}
            lines = {at: line for at, (_, line) in self._replacing.items()}
            writes = [(self._file, rows, self._plan.format), (self._inputs, lines, "jsonl")]
            # a run that is killed in between leaves rows that the same command makes again: where it updates,
            # those whose lines tell of other contents, and else those that still are errors
            for file, new, form in writes if self._plan.options.result.update else reversed(writes):
                file.replace(new, form)
            self._end_replacing()

    def finish(self, summary: RunSummary) -> None:
        """Write it into the record."""
        self.record.write(summary)

    def hint(self) -> str:
        """Say that --resume continues, if rows were written and their file still is there."""
        rows = self.kept.count + self._rows.written
        return f"; {rows} rows are kept, continue with --resume" if rows and self._file.is_there() else ""


Output = StreamOutput | FileOutput | PartsOutput


@contextlib.contextmanager
def open_output(plan: Plan) -> Iterator[Output]:
    """Begin a result, or continue that of an interrupted run.

    Raises
    ------
    UsageError
        A result exists and neither --resume nor --overwrite is given, another run is writing it, or it
        cannot be resumed.
    OutputError
        It cannot be written.
    """
    if plan.in_parts and plan.output != STDOUT:
        with open_parts(plan) as parts:
            yield parts
        return
    _check_permitted(plan)
    if is_stream(plan.output):
        with open_stream(plan.output) as write:
            yield StreamOutput(write, plan)
    else:
        with open_result(plan.output) as file:
            _check_permitted(plan)  # again, now that no other run can write it
            with open_result(inputs_path(plan.output)) as inputs:
                yield _begin(file, inputs, plan)


def frames_to_do(plan: Plan) -> Iterator[Frame]:
    """Yield the frames that a run would work on, without opening the result for writing.

    Raises
    ------
    UsageError
        As `open_output`.
    """
    if plan.in_parts:
        kept = kept_in_parts(plan)
    else:
        _check_permitted(plan)
        kept = _parsed(data_of(plan.output) if plan.options.result.resume else b"", plan)[1]
    undone = (plan.frames[position] for position in (*kept.again, *kept.holes))
    return chain(kept.incomplete, undone, plan.frames[kept.count :])


def _parsed(data: bytes, plan: Plan) -> tuple[bytes, KeptRows]:
    """Take in the rows of a file as far as they count, in the order of the frames; return their bytes too."""
    data = kept_rows(data, plan.output, plan.format)
    if not data:
        return b"", KeptRows(plan)
    update, gone = plan.options.result.update, 0
    inputs = Inputs(data_of(inputs_path(plan.output)), updates=update)
    if update:
        data, gone = arranged(data, plan)
    kept = KeptRows(plan, parse_rows(data, plan.output), inputs)
    kept.gone = gone
    lines = row_lines(io.BytesIO(data), plan.format)
    return b"".join(islice(lines, kept.count + (plan.format == "csv"))), kept


def _begin(file: ResultFile, inputs: ResultFile, plan: Plan) -> FileOutput:
    options = plan.options
    before = file.read() if options.result.resume else b""
    try:
        data, kept = _parsed(before, plan)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    record = new_record(plan, kept)
    if options.result.resume or options.running.overwrite:
        first = 0 if options.result.retry_failed else kept.count
        remove_image_leftovers(kept.not_failed(first), options.images)
    written = (plan.output, inputs_path(plan.output))
    remove_leftovers([run_path(plan.output), *map(os.path.realpath, written)])
    # in this order, a run that is killed in between can be resumed: an empty file counts as a new one
    if not before.startswith(data):
        file.rewrite([data])  # before the other: a row without its line counts for nothing
    file.truncate(len(data) if kept.count else 0)
    lines = bytes(kept.inputs.lines) if kept.inputs else b""
    if not inputs.read().startswith(lines):
        inputs.rewrite([lines])
    inputs.truncate(len(lines))
    record.write()
    if not kept.count:
        file.append(format_header(plan.format, plan.further))
    return FileOutput(file, inputs, record, kept)


def _check_permitted(plan: Plan) -> None:
    """Refuse to touch a result that exists, unless --resume or --overwrite is given."""
    name = plan.output
    if is_stream(name) or plan.options.running.overwrite:
        return
    if has_rows(name):
        if not plan.options.result.resume:
            raise UsageError(
                f"{name}: exists already; give --resume to continue it or --overwrite to replace it"
            )
        if not is_there(inputs_path(name)):
            raise not_resumable(name, f"there is no {base_name(inputs_path(name))}")
        return
    for path, is_ours in ((inputs_path(name), is_inputs), (run_path(name), is_replaceable_record)):
        if not is_ours(path):
            raise UsageError(
                f"{path}: exists already and is not of a run; give another --output, or --overwrite to "
                "replace it"
            )
