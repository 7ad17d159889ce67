"""Where the rows of a run go: to a stream, or to a file with the record of the run beside it."""

import contextlib
import io
import os
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path

from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import is_there, remove_leftovers, sync_files
from rollcli.files.locking import exists_already, not_resumable
from rollcli.files.results import format_header, parse_rows, run_path
from rollcli.files.storage import is_stream, open_stream
from rollcli.files.stores.locations import base_name
from rollcli.run.batch import Batch
from rollcli.run.frame import Frame
from rollcli.run.parts import kept_in_parts, open_parts
from rollcli.run.plan import Plan
from rollcli.run.result_file import (
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
    Output,
    RunRecord,
    arranged,
    checked_record,
    is_replaceable_record,
    new_record,
)


class StreamOutput(Output):
    """Rows to stdout, a pipe or a device."""

    def __init__(self, write: Callable[[bytes], None], plan: Plan) -> None:
        super().__init__(RunRecord(plan), KeptRows(plan))
        self._write = write
        self._write(format_header(plan.format, plan.further))

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Write the rows; they have left this process when this returns."""
        self._write(b"".join(batch.lines))


_MOST_IMAGES = 512
_LONGEST_S = 1.0  # a row waits no longer for the others of its group
_SHARE = 100  # a group lasts so many times as long as the last one took to sync: 1 % of the time at most


class FileOutput(Output):
    """Rows to a locked file, FILE.inputs and FILE.run.json beside it; images are durable before their row.

    Rows without images are written at once; a killed run loses none of them. What a row was made from is
    written before it (see `result_file`), and counts without it for nothing.
    """

    def __init__(self, file: ResultFile, inputs: ResultFile, record: RunRecord, kept: KeptRows) -> None:
        super().__init__(record, kept)
        self._file, self._inputs, self._written = file, inputs, 0
        self._rows: list[bytes] = []  # which wait for their images
        self._folders: set[Path] = set()  # whose names are on the disk
        self._last, self._wait_s = time.monotonic(), 0.0

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Add the rows, which may wait for others."""
        self._take_images(frames, batch.figures.status, batch.lines, batch.notes)

    def _take_images(
        self, frames: Sequence[Frame], status: bytes, rows: Sequence[bytes] = (), notes: Sequence[bytes] = ()
    ) -> None:
        self._inputs.append(b"".join(notes))
        super()._take_images(frames, status)
        self._rows += rows
        if not self._images:
            self._write()
        if time.monotonic() - self._last >= self._wait_s or len(self._images) >= _MOST_IMAGES:
            self._sync()

    def _sync(self) -> None:
        """Force the images to the disk, then write the rows and force them too."""
        start = time.monotonic()
        if self._images:
            sync_files(self._images, self._folders)
            self._images.clear()
        self._write()
        self._inputs.sync()
        self._file.sync()
        self._last = time.monotonic()
        self._wait_s = min(_SHARE * (self._last - start), _LONGEST_S)

    def _write(self) -> None:
        rows, self._rows = self._rows, []  # first: what follows an interrupt must not write one again
        if rows:
            self._file.append(b"".join(rows))
            self._written += len(rows)

    def commit(self) -> None:
        """Force the images and rows that were added to the disk."""
        self._sync()
        if self._new_rows:
            writes = [
                (self._file, self._new_rows, self._plan.format),
                (self._inputs, self._new_notes, "jsonl"),
            ]
            # a run that is killed in between leaves rows that the same command makes again: where it updates,
            # those whose lines tell of other contents, and else those that still are errors
            for file, new, form in writes if self._plan.options.result.update else reversed(writes):
                file.replace(new, form)
            self._end_replacing()

    def hint(self) -> str:
        """Say that --resume continues, if rows were written and their file still is there."""
        rows = self.kept.count + self._written
        return f"; {rows} rows are kept, continue with --resume" if rows and self._file.is_there() else ""


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
    if plan.in_parts:
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


def kept_of(plan: Plan) -> KeptRows:
    """Take in the rows that a run would keep, without opening the result for writing.

    Raises
    ------
    UsageError
        As `open_output`.
    """
    if plan.in_parts:
        return kept_in_parts(plan)
    _check_permitted(plan)
    kept, *_ = _parsed(data_of(plan.output) if plan.options.result.resume else b"", plan)
    checked_record(plan, kept)
    return kept


def _parsed(data: bytes, plan: Plan) -> tuple[KeptRows, bytes, bytes]:
    """Take in the rows of a file as far as they count, in the order of the frames.

    Returns
    -------
    kept : KeptRows
    rows, inputs : bytes
        Those of the rows that are kept, and of the lines of their inputs; both are empty where none is.
    """
    data, kept = kept_rows(data, plan.output, plan.format), KeptRows(plan)
    if not data:
        return kept, b"", b""
    update = plan.options.result.update
    inputs = Inputs(data_of(inputs_path(plan.output)), updates=update)
    if update:
        data, kept.gone = arranged(data, plan)
    kept.take(parse_rows(data, plan.output), inputs)
    lines = row_lines(io.BytesIO(data), plan.format)
    rows = b"".join(islice(lines, kept.count + (plan.format == "csv"))) if kept.count else b""
    return kept, rows, bytes(inputs.lines)


def _begin(file: ResultFile, inputs: ResultFile, plan: Plan) -> FileOutput:
    try:
        kept, rows, lines = _parsed(file.read() if plan.options.result.resume else b"", plan)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    record = new_record(plan, kept)
    remove_leftovers(chain(plan.files, map(os.path.realpath, plan.files)))
    # in this order, a run that is killed in between can be resumed: an empty file counts as a new one, and a
    # row without its line for nothing
    file.keep(rows)
    inputs.keep(lines)
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
            raise exists_already(name)
        if not is_there(inputs_path(name)):
            raise not_resumable(name, f"there is no {base_name(inputs_path(name))}")
        return
    for path, is_ours in ((inputs_path(name), is_inputs), (run_path(name), is_replaceable_record)):
        if not is_ours(path):
            raise UsageError(
                f"{path}: exists already and is not of a run; give another --output, or --overwrite to "
                "replace it"
            )
