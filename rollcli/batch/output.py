"""Where the rows of a run go: to a stream, or to a file with the record of the run beside it."""

import contextlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

from rollcli.batch.options import EstimateOptions
from rollcli.batch.plan import Plan
from rollcli.batch.result_file import ResultFile, has_rows, kept_rows, open_result
from rollcli.batch.resume import check_resumable, unknown_inputs
from rollcli.batch.run_record import RunRecord
from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import remove_leftovers
from rollcli.files.results import Row, format_header, format_row, parse_rows, read_run, run_path
from rollcli.files.resumable import not_resumable
from rollcli.files.stream import (
    STDOUT,
    STDOUT_NAME,
    is_stream,
    open_stream,
    stdout_descriptor,
    write_stream,
)
from rollcli.frames.frame import FrameResult
from rollcli.frames.outputs import remove_image_leftovers


class Output(Protocol):
    """Takes the results of frames in their order.

    Attributes
    ----------
    kept : tuple of Row
        The rows of an interrupted run, which is resumed.
    keep_open : int or None
        A descriptor for workers to inherit.
    resumable : bool
        Whether an interrupted run can be resumed.
    """

    kept: tuple[Row, ...]
    keep_open: int | None
    resumable: bool

    def append(self, result: FrameResult) -> None:
        """Write the row; it has left this process when this returns."""

    def finish(self, totals: Mapping[str, int], alignment: Mapping[str, Any] | None) -> None:
        """Say that all rows are written, how many of each status, and how the views of pairs lay."""

    def hint(self, rows: int) -> str:
        """Say how to continue after an error; empty when nothing can be continued."""


class StreamOutput:
    """Rows to stdout, a pipe or a device."""

    kept: tuple[Row, ...] = ()
    keep_open: int | None = None
    resumable = False

    def __init__(self, descriptor: int, name: str, plan: Plan) -> None:
        self._descriptor, self._name, self._plan = descriptor, name, plan
        self._write(format_header(plan.format, plan.timing))

    def append(self, result: FrameResult) -> None:
        """Write the row."""
        self._write(format_row(result.row, self._plan.format, self._plan.timing))

    def finish(self, totals: Mapping[str, int], alignment: Mapping[str, Any] | None) -> None:
        """Do nothing: a stream has no record."""

    def hint(self, rows: int) -> str:
        """Return nothing: a stream cannot be resumed."""
        return ""

    def _write(self, data: bytes) -> None:
        write_stream(self._descriptor, data, self._name)


class FileOutput:
    """Rows to a locked file, and FILE.run.json beside it."""

    resumable = True

    def __init__(self, file: ResultFile, record: RunRecord, plan: Plan, kept: tuple[Row, ...]) -> None:
        self.kept = kept
        self.keep_open: int | None = file.descriptor
        self._file, self._record, self._plan = file, record, plan

    def append(self, result: FrameResult) -> None:
        """Write the row, whole or not at all, after the record knows how its frame was read."""
        self._record.saw(result.encoding, result.searched)
        self._file.append(format_row(result.row, self._plan.format, self._plan.timing))

    def finish(self, totals: Mapping[str, int], alignment: Mapping[str, Any] | None) -> None:
        """Write both into the record."""
        self._record.write(totals, alignment)

    def hint(self, rows: int) -> str:
        """Say that --resume continues, if rows were written and their file still is there."""
        return f"; {rows} rows are kept, continue with --resume" if rows and self._file.is_there() else ""


@contextlib.contextmanager
def open_output(plan: Plan, options: EstimateOptions) -> Iterator[Output]:
    """Begin a result, or continue that of an interrupted run.

    Raises
    ------
    UsageError
        A result exists and neither --resume nor --overwrite is given, another run is writing it, or it
        cannot be resumed.
    OutputError
        It cannot be written.
    """
    _check_permitted(plan.output, options)
    if plan.output == STDOUT:
        yield StreamOutput(stdout_descriptor(), STDOUT_NAME, plan)
    elif is_stream(plan.output):
        descriptor = open_stream(plan.output)
        try:
            yield StreamOutput(descriptor, plan.output, plan)
        finally:
            os.close(descriptor)
    else:
        with open_result(plan.output) as file:
            _check_permitted(plan.output, options)  # again, now that no other run can write it
            yield _begin(file, plan, options)


def count_kept_rows(plan: Plan, options: EstimateOptions) -> int:
    """Count the rows that a resume would keep, without opening the result for writing.

    Raises
    ------
    UsageError
        As `open_output`.
    """
    _check_permitted(plan.output, options)
    if not options.result.resume:
        return 0
    try:
        data = Path(plan.output).read_bytes()
    except OSError:
        return 0
    kept = kept_rows(data, plan.output, plan.format)
    return len(parse_rows(kept, plan.output)) if kept else 0


def _begin(file: ResultFile, plan: Plan, options: EstimateOptions) -> FileOutput:
    kept = kept_rows(file.read(), plan.output, plan.format) if options.result.resume else b""
    rows, earlier = _parse_kept(kept, plan)
    record = RunRecord(plan, options, unknown_inputs(earlier))
    if rows:
        record.continue_from(check_resumable(rows, earlier, record, plan))
    if options.result.resume or options.running.overwrite:
        remove_image_leftovers(plan.frames[len(rows) :], options.images)
    remove_leftovers([run_path(plan.output)])
    # in this order, a run that is killed in between can be resumed: an empty file counts as a new one
    file.truncate(len(kept) if rows else 0)
    record.write({})
    if not rows:
        file.append(format_header(plan.format, plan.timing))
    return FileOutput(file, record, plan, rows)


def _parse_kept(kept: bytes, plan: Plan) -> tuple[tuple[Row, ...], Mapping[str, object] | None]:
    """Parse the rows of an interrupted run, and read its record."""
    if not kept:
        return (), None
    try:
        rows = parse_rows(kept, plan.output)
        return rows, read_run(plan.output) if rows else None
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error


def _check_permitted(name: str, options: EstimateOptions) -> None:
    """Refuse to touch a result that exists, unless --resume or --overwrite is given."""
    resume, overwrite = options.result.resume, options.running.overwrite
    if resume and overwrite:
        raise UsageError("give either --resume or --overwrite")
    if is_stream(name):
        if resume:
            raise UsageError("--resume needs a result file: name it with --output")
        return
    if not (resume or overwrite) and has_rows(name):
        raise UsageError(f"{name}: exists already; give --resume to continue it or --overwrite to replace it")
