"""Where the rows of a run go: to a stream, to a file with the record of the run beside it, or into parts.

A folder of immutable parts is for Parquet, and for object stores, which cannot append. A part holds a fixed
number of rows, and only the last part holds fewer: neither the workers nor their speed change a byte. It is
written whole, by the worker that has all of its rows, and these count as done when it exists. Parts of CSV
and JSON Lines, put together in their order, are the very file that a run on a local disk writes.
"""

import contextlib
import io
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path

from rollcli.errors import InputError, OutputError, UsageError
from rollcli.extras import require_extra
from rollcli.files import results
from rollcli.files.atomic import is_file, is_folder, is_there, remove_leftovers, sync_files
from rollcli.files.locking import exists_already, locked_folder, not_resumable
from rollcli.files.storage import is_stream, list_names, open_stream, read_bytes, remove, write_bytes
from rollcli.files.stores.locations import base_name, is_url, public_name
from rollcli.messages import counted
from rollcli.run import outputs
from rollcli.run.batch import Batch, BatchOptions, Step
from rollcli.run.frame import Frame
from rollcli.run.options import EstimateOptions
from rollcli.run.plan import Plan
from rollcli.run.progress import RunSummary
from rollcli.run.result_file import (
    PART_INPUTS,
    Inputs,
    ResultFile,
    data_of,
    has_rows,
    inputs_path,
    is_inputs,
    kept_rows,
    open_result,
    part_paths,
    row_lines,
    split_lines,
)
from rollcli.run.resume import KeptRows, RunRecord, arranged, is_replaceable_record, new_record


class Output:
    """Where the rows of a run go: a stream, a file or a folder of parts.

    Attributes
    ----------
    record : RunRecord
        FILE.run.json.
    kept : KeptRows
        What is known of the rows of an interrupted run, which is resumed.
    """

    def __init__(self, record: RunRecord, kept: KeptRows) -> None:
        self.record, self.kept, self._plan = record, kept, record.plan
        self._rows_there = kept.count - len(kept.holes)
        # what takes the place of kept rows, by their positions, and of the lines of their inputs
        self._new_rows: dict[int, bytes] = {}
        self._new_notes: dict[int, bytes] = {}
        self._images: list[str] = []  # which must be on the disk before the rows that come next
        self._folders: set[Path] = set()  # whose names are on the disk

    def rows_of(self, step: Step, told: EstimateOptions) -> BatchOptions:
        """Say what workers are told of the rows of a step."""
        return BatchOptions(told, self._plan.further)

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Add the rows of these positions, which may wait for others."""

    def commit(self) -> None:
        """Force to the disk what was added: what a stream was given has left this process."""

    def finish(self, summary: RunSummary) -> None:
        """Write the summary into the record."""
        self.record.write(summary)

    def hint(self) -> str:
        """Say that --resume continues, if rows are kept; a stream keeps none."""
        there = self._rows_there
        return f"; {counted(there, 'row')} kept, continue with --resume" if there else ""

    def restore(self, frames: Sequence[Frame], batch: Batch) -> None:
        """Take the images of incomplete frames, which were made again.

        Raises
        ------
        OutputError
            They could not be made: a row no longer holds.
        """
        for row in (result.row for result in batch.told):
            if row.status == "error":
                raise OutputError(f"the images of {row.file} cannot be made again: {row.message}")
        self._take_images(frames, batch.figures.status)

    def replace(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Take rows in the place of kept ones, and their images; positions increase.

        `commit` writes them all at once.
        """
        self._new_rows.update(zip(positions, batch.lines, strict=True))
        self._new_notes.update(zip(positions, batch.notes, strict=True))
        self._take_images(frames, batch.figures.status)

    def _take_images(self, frames: Sequence[Frame], status: bytes) -> None:
        self._images += outputs.local_files(frames, status, self._plan.options.writes)

    def _sync_images(self) -> None:
        """Force the images to the disk."""
        if self._images:
            sync_files(self._images, self._folders)
            self._images.clear()

    def _end_replacing(self) -> None:
        """Forget the rows that are written, and what told their images from those of other programs."""
        outputs.remove_marks([self._plan.frames[at] for at in self._new_rows], self._plan.options.writes)
        self._new_rows.clear()
        self._new_notes.clear()


class StreamOutput(Output):
    """Rows to stdout, a pipe or a device."""

    def __init__(self, write: Callable[[bytes], None], plan: Plan) -> None:
        super().__init__(RunRecord(plan), KeptRows(plan))
        self._write = write
        self._write(results.format_header(plan.format, plan.further))

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Write the rows; they have left this process when this returns."""
        self._write(b"".join(batch.lines))


_MOST_IMAGES = 512
_LONGEST_S = 1.0  # a row waits no longer for the others of its group, which are forced to the disk at once


class FileOutput(Output):
    """Rows to a locked file, FILE.inputs and FILE.run.json beside it; images are durable before their row.

    Rows without images are written at once; a killed run loses none of them. What a row was made from is
    written before it (see `result_file`), and counts without it for nothing.
    """

    def __init__(self, file: ResultFile, inputs: ResultFile, record: RunRecord, kept: KeptRows) -> None:
        super().__init__(record, kept)
        self._file, self._inputs = file, inputs
        self._rows: list[bytes] = []  # which wait for their images
        self._last = time.monotonic()

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
        if time.monotonic() - self._last >= _LONGEST_S or len(self._images) >= _MOST_IMAGES:
            self._sync()

    def _sync(self) -> None:
        """Force the images to the disk, then write the rows and force them too."""
        self._sync_images()
        self._write()
        self._inputs.sync()
        self._file.sync()
        self._last = time.monotonic()

    def _write(self) -> None:
        rows, self._rows = self._rows, []  # first: what follows an interrupt must not write one again
        if rows:
            self._file.append(b"".join(rows))
            self._rows_there += len(rows)

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
        """Say that --resume continues, if the file still is there."""
        return super().hint() if self._file.is_there() else ""


_CHECK_S = 10.0  # a request of 50 ms now and then


class PartsOutput(Output):
    """Rows to a folder of parts, FILE.inputs and FILE.run.json beside it.

    Workers write the parts of which they have all rows. This process writes the others.
    """

    def __init__(self, record: RunRecord, kept: KeptRows) -> None:
        super().__init__(record, kept)
        self._part_rows = record.plan.options.result.part_rows
        of_rows = {key: value for key, value in record.fixed.items() if key != "inputs"}
        told = replace(record.plan.options.told, run=record.run)
        self._rows = BatchOptions(told, self._plan.further, told.at(self._plan.output), of_rows=of_rows)
        self._waiting: list[tuple[int, bytes, bytes]] = []  # positions, rows, and the lines of their inputs
        self._checked = time.monotonic()

    def rows_of(self, step: Step, told: EstimateOptions) -> BatchOptions:
        """Say which parts the workers write of which they have all rows."""
        if step.retries or not step.positions:
            return super().rows_of(step, told)
        numbers = tuple(position // self._part_rows for position in step.positions[:: self._part_rows])
        return self._rows._replace(told=told, numbers=numbers, frames=len(step.positions))

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Take the rows; every full part is written."""
        if time.monotonic() - self._checked > _CHECK_S:
            self.record.check_owned()
            self._checked = time.monotonic()
        done = batch.in_parts
        self._rows_there += done
        self._waiting += zip(positions[done:], batch.lines, batch.notes, strict=True)
        self._take_images(frames[done:], batch.figures.status[done:])
        while len(self._waiting) >= self._part_rows:
            self._write()

    def finish(self, summary: RunSummary) -> None:
        """Write the last part, and the summary into the record."""
        if self._waiting:
            self._write()
        super().finish(summary)
        _remove_leftovers(self._plan)  # of workers that have died

    def commit(self) -> None:
        """Write those parts anew of which rows are replaced; a part that is new waits until it is full."""
        self._sync_images()
        for number in dict.fromkeys(position // self._part_rows for position in self._new_rows):
            self._write_anew(number)
        self._end_replacing()

    def _write_anew(self, number: int) -> None:
        plan, first = self._plan, number * self._part_rows
        location, path = part_paths(plan.output, plan.format, number)
        header = results.format_header(plan.format, plan.further) if number else b""  # the first part has it
        ((name, data),) = results.read_parts(plan.output, [base_name(location)], header)
        old = [results.format_row(row, plan.format, plan.further) for row in results.parse_rows(data, name)]
        inputs = read_bytes(path)
        lines = [self._new_rows.get(*each) for each in enumerate(old, first)]
        notes = b"".join(self._new_notes.get(*each) for each in enumerate(split_lines(inputs), first))
        if notes != inputs:
            self.record.check_owned()
            # in this order: of a run that is killed in between, the rows still are errors, and are done again
            write_bytes(path, notes, durable=True)
        if lines != old:
            self.record.check_owned()
            write_bytes(location, self._rows.encoded(number, lines), durable=True)

    def _write(self) -> None:
        self._sync_images()
        positions, lines, notes = zip(*self._waiting[: self._part_rows], strict=True)
        self._rows.write(positions[0] // self._part_rows, lines, notes)
        self._rows_there += len(lines)
        self._waiting = self._waiting[self._part_rows :]


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
    if plan.options.result.in_parts:
        if plan.format == "parquet":
            require_extra("parquet", "Parquet")  # before any work
        _check_parts(plan)
        with contextlib.nullcontext() if is_url(plan.output) else locked_folder(plan.output):
            yield _begin_parts(plan)
    elif is_stream(plan.output):
        with open_stream(plan.output) as write:
            yield StreamOutput(write, plan)
    else:
        _check_permitted(plan)
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
    parts = list[str]()
    if plan.options.result.in_parts:
        parts = _check_parts(plan)
        kept, _ = _kept_parts(plan, parts)
    else:
        _check_permitted(plan)
        kept, *_ = _parsed(data_of(plan.output) if plan.options.result.resume else b"", plan)
    new_record(plan, kept, parts)
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
    try:
        if update:
            data, kept.gone = arranged(data, plan)
        if data:  # JSON Lines has no header: nothing is left where all frames are gone
            kept.take(results.parse_rows(data, plan.output), inputs)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    lines = row_lines(io.BytesIO(data), plan.format)
    rows = b"".join(islice(lines, kept.count + (plan.format == "csv"))) if kept.count else b""
    return kept, rows, bytes(inputs.lines)


def _begin(file: ResultFile, inputs: ResultFile, plan: Plan) -> FileOutput:
    kept, rows, lines = _parsed(file.read() if plan.options.result.resume else b"", plan)
    record = new_record(plan, kept)
    _clear_images(plan, kept)
    remove_leftovers(chain(plan.files, map(os.path.realpath, plan.files)))
    # in this order, a run that is killed in between can be resumed: an empty file counts as a new one, and a
    # row without its line for nothing
    file.keep(rows)
    inputs.keep(lines)
    record.write()
    if not kept.count:
        file.append(results.format_header(plan.format, plan.further))
    return FileOutput(file, inputs, record, kept)


def _check_permitted(plan: Plan) -> None:
    """Refuse to touch a result that exists, unless --resume or --overwrite is given."""
    name = plan.output
    if is_stream(name) or plan.options.running.overwrite:
        return
    if has_rows(name):
        if not plan.options.result.resume:
            raise exists_already(name)
        if not is_file(inputs_path(name)):
            raise not_resumable(name, f"there is no file {base_name(inputs_path(name))}")
        return
    for path, is_ours in ((inputs_path(name), is_inputs), (results.run_path(name), is_replaceable_record)):
        if not is_ours(path):
            raise UsageError(
                f"{path}: exists already and is not of a run; give another --output, or --overwrite to "
                "replace it"
            )


def _begin_parts(plan: Plan) -> PartsOutput:
    # again, now that no other run can write it
    parts = _check_parts(plan)
    kept, renewed = _kept_parts(plan, parts)
    record = new_record(plan, kept, parts)
    _clear_images(plan, kept)
    _remove_leftovers(plan, parts)
    rows = plan.options.result.part_rows
    whole = set(range(_whole_parts(kept.count, rows))).difference(at // rows for at in kept.holes)
    stay = {path for number in whole for path in part_paths(plan.output, plan.format, number)}
    folder = inputs_path(plan.output)
    inputs = (f"{folder}/{name}" for name in list_names(folder) if name.endswith(f".{PART_INPUTS}"))
    # in this order, no part is ever without its inputs
    for path in (*(f"{plan.output}/{name}" for name in parts), *inputs):
        if path not in stay:
            remove(path)
    record.write()
    record.check_owned()  # another run may have begun in this very second
    for path, lines in renewed.items():
        write_bytes(path, lines, durable=True)
    return PartsOutput(record, kept)


def _clear_images(plan: Plan, kept: KeptRows) -> None:
    """Remove what killed workers left beside the images."""
    if plan.options.result.resume or plan.options.running.overwrite:
        remove_leftovers(outputs.files_of(kept.not_failed(), plan.options.writes))


def _remove_leftovers(plan: Plan, parts: Sequence[str] = ()) -> None:
    """Remove what killed processes left beside the parts of this run, and these of an earlier one."""
    if not is_url(plan.output):
        every = range(_whole_parts(len(plan.frames), plan.options.result.part_rows))
        to_write = [path for number in every for path in part_paths(plan.output, plan.format, number)]
        remove_leftovers(
            [results.run_path(plan.output), *to_write, *(f"{plan.output}/{name}" for name in parts)]
        )


def _check_parts(plan: Plan) -> list[str]:
    """Return the names of the parts that exist, in order; refuse to touch them unless told how.

    Raises
    ------
    UsageError
        Parts exist and neither --resume nor --overwrite is given; or a file is in the folder's place.
    """
    for path in () if is_url(plan.output) else (plan.output, inputs_path(plan.output)):
        if is_there(path) and not is_folder(path):
            raise UsageError(f"{path}: is a file; a result of parts is a folder, give another --output")
    resume, overwrite = plan.options.result.resume, plan.options.running.overwrite
    parts = results.part_names(list_names(plan.output))
    if parts and not (resume or overwrite):
        raise exists_already(plan.output)
    endings = {name.rpartition(".")[2] for name in parts}
    if resume and parts and endings != {plan.format}:
        raise not_resumable(plan.output, f"its parts are {', '.join(sorted(endings))}, not {plan.format}")
    return parts


def _kept_parts(plan: Plan, parts: list[str]) -> tuple[KeptRows, dict[str, bytes]]:
    """Take in the rows of the parts that are not short, wherever others are missing.

    A part is short that was the last one of fewer frames. Files of inputs come back with their lines where
    states differ and contents do not.
    """
    kept, renewed = KeptRows(plan), dict[str, bytes]()
    if not plan.options.result.resume:
        return kept, renewed
    rows, numbered = plan.options.result.part_rows, dict[str, int]()
    for name in parts:
        number = int(name.removeprefix("part-").partition(".")[0])
        if name == results.part_name(number, plan.format):  # no run names a part otherwise
            numbered[name] = number
    header = b"" if 0 in numbered.values() else results.format_header(plan.format, plan.further)
    try:
        for name, data in results.read_parts(plan.output, numbered, header):
            found, first = tuple(results.parse_rows(data, name)), rows * numbered[base_name(name)]
            if len(found) < rows and first + len(found) != len(plan.frames):
                continue
            kept.skip_to(min(first, len(plan.frames)))  # its number may be a date
            _, path = part_paths(plan.output, plan.format, numbered[base_name(name)])
            inputs = read_bytes(path)
            lines = Inputs(inputs)
            if not kept.take(found, lines):
                raise InputError(f"{public_name(path)}: is damaged: it does not say what a row was made from")
            if lines.lines != inputs:
                renewed[path] = bytes(lines.lines)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    return kept, renewed


def _whole_parts(rows: int, part_rows: int) -> int:
    return -(-rows // part_rows)
