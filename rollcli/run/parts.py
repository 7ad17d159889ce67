"""A result as a folder of immutable parts: for Parquet, and for object stores, which cannot append.

A part holds a fixed number of rows, and only the last part holds fewer: neither the workers nor their speed
change a byte. It is written whole, by the worker that has all of its rows, and these count as done when it
exists. Parts of CSV and JSON Lines, put together in their order, are the very file that a run on a local disk
writes.
"""

import contextlib
import time
from collections.abc import Iterator, Sequence

from rollcli.errors import InputError, UsageError
from rollcli.extras import require_extra
from rollcli.files import results
from rollcli.files.atomic import is_folder, is_there, remove_leftovers, sync_files
from rollcli.files.locking import exists_already, locked_folder, not_resumable
from rollcli.files.storage import list_names, read_bytes, remove, write_bytes
from rollcli.files.stores.locations import base_name, is_url, located, public_name
from rollcli.run.batch import Batch, Parts, Step, part_location
from rollcli.run.frame import Frame
from rollcli.run.plan import Plan
from rollcli.run.progress import RunSummary
from rollcli.run.result_file import Inputs, inputs_path, is_part_inputs, part_inputs_path, split_lines
from rollcli.run.resume import KeptRows, Output, RunRecord, checked_record, new_record

_CHECK_S = 10.0  # a request of 50 ms now and then


class PartsOutput(Output):
    """Rows to a folder of parts, FILE.inputs and FILE.run.json beside it.

    Workers write the parts of which they have all rows. This process writes the others.
    """

    def __init__(self, record: RunRecord, kept: KeptRows) -> None:
        super().__init__(record, kept)
        self._part_rows = record.plan.options.result.part_rows
        output = located(record.plan.options.running.root, record.plan.output)
        of_rows = {key: value for key, value in record.fixed.items() if key != "inputs"}
        self._parts = Parts(
            output, self._plan.format, self._plan.further, self._part_rows, (), 0, record.run, of_rows
        )
        self._waiting: list[tuple[int, bytes, bytes]] = []  # positions, rows, and the lines of their inputs
        self._checked = time.monotonic()
        self._written = kept.count - len(kept.holes)

    def parts_of(self, step: Step) -> Parts | None:
        """Say which parts the workers write of which they have all rows."""
        if step.retries or not step.positions:
            return None
        numbers = tuple(position // self._part_rows for position in step.positions[:: self._part_rows])
        return self._parts._replace(numbers=numbers, frames=len(step.positions))

    def append(self, positions: Sequence[int], frames: Sequence[Frame], batch: Batch) -> None:
        """Take the rows; every full part is written."""
        if time.monotonic() - self._checked > _CHECK_S:
            self.record.check_owned()
            self._checked = time.monotonic()
        done = batch.in_parts
        self._written += done
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
        old = [results.format_row(row, plan.format, plan.further) for row in _rows_of_part(plan, number)]
        path = part_inputs_path(self._plan.output, number)
        inputs = read_bytes(path)
        lines = [self._new_rows.get(*each) for each in enumerate(old, first)]
        notes = b"".join(self._new_notes.get(*each) for each in enumerate(split_lines(inputs), first))
        if notes != inputs:
            self.record.check_owned()
            # in this order: of a run that is killed in between, the rows still are errors, and are done again
            write_bytes(path, notes, durable=True)
        if lines != old:
            self.record.check_owned()
            write_bytes(_location(self._plan, number), self._parts.encoded(number, lines), durable=True)

    def hint(self) -> str:
        """Say that --resume continues after the last part."""
        return f"; {self._written} rows are kept, continue with --resume" if self._written else ""

    def _sync_images(self) -> None:
        sync_files(self._images)
        self._images.clear()

    def _write(self) -> None:
        self._sync_images()
        positions, lines, notes = zip(*self._waiting[: self._part_rows], strict=True)
        self._parts.write(positions[0] // self._part_rows, lines, notes)
        self._written += len(lines)
        self._waiting = self._waiting[self._part_rows :]


@contextlib.contextmanager
def open_parts(plan: Plan) -> Iterator[PartsOutput]:
    """Begin a folder of parts, or continue that of an interrupted run.

    Raises
    ------
    UsageError
        Parts exist and neither --resume nor --overwrite is given, or they cannot be continued.
    OutputError
        The folder cannot be written.
    """
    if plan.format == "parquet":
        require_extra("parquet", "Parquet")  # before any work
    check_parts(plan)
    with contextlib.nullcontext() if is_url(plan.output) else locked_folder(plan.output):
        yield _begin(plan)


def _begin(plan: Plan) -> PartsOutput:
    # again, now that no other run can write it
    parts = check_parts(plan)
    kept, renewed = _kept(plan, parts)
    record = new_record(plan, kept, parts)
    _remove_leftovers(plan, parts)
    rows = plan.options.result.part_rows
    whole = set(range(_whole_parts(kept.count, rows))).difference(at // rows for at in kept.holes)
    stay = {path for number in whole for path in _part_paths(plan, number)}
    inputs = [f"{inputs_path(plan.output)}/{name}" for name in list_names(inputs_path(plan.output))]
    # in this order, no part is ever without its inputs
    for path in (*(f"{plan.output}/{name}" for name in parts), *filter(is_part_inputs, inputs)):
        if path not in stay:
            remove(path)
    record.write()
    record.check_owned()  # another run may have begun in this very second
    for path, lines in renewed.items():
        write_bytes(path, lines, durable=True)
    return PartsOutput(record, kept)


def _remove_leftovers(plan: Plan, parts: Sequence[str] = ()) -> None:
    """Remove what killed processes left beside the parts of this run, and these of an earlier one."""
    if not is_url(plan.output):
        every = range(_whole_parts(len(plan.frames), plan.options.result.part_rows))
        to_write = [path for number in every for path in _part_paths(plan, number)]
        remove_leftovers(
            [results.run_path(plan.output), *to_write, *(f"{plan.output}/{name}" for name in parts)]
        )


def check_parts(plan: Plan) -> list[str]:
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


def kept_in_parts(plan: Plan) -> KeptRows:
    """Take in the rows that a resume would keep."""
    parts = check_parts(plan)
    kept, _ = _kept(plan, parts)
    checked_record(plan, kept, parts)
    return kept


def _kept(plan: Plan, parts: list[str]) -> tuple[KeptRows, dict[str, bytes]]:
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
            kept.skip_to(first)
            path = part_inputs_path(plan.output, numbered[base_name(name)])
            inputs = read_bytes(path)
            lines = Inputs(inputs)
            if not kept.take(found, lines):
                raise InputError(f"{public_name(path)}: is damaged: it does not say what a row was made from")
            if lines.lines != inputs:
                renewed[path] = bytes(lines.lines)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    return kept, renewed


def _rows_of_part(plan: Plan, number: int) -> tuple[results.Row, ...]:
    """Read a part again; the first one has the header of CSV."""
    header = results.format_header(plan.format, plan.further) if number else b""
    ((name, data),) = results.read_parts(plan.output, [base_name(_location(plan, number))], header)
    return tuple(results.parse_rows(data, name))


def _whole_parts(rows: int, part_rows: int) -> int:
    return -(-rows // part_rows)


def _location(plan: Plan, number: int) -> str:
    return part_location(plan.output, plan.format, number)


def _part_paths(plan: Plan, number: int) -> tuple[str, str]:
    return _location(plan, number), part_inputs_path(plan.output, number)
