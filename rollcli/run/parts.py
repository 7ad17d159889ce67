"""A result as a folder of immutable parts: for Parquet, and for object stores, which cannot append.

A part holds a fixed number of rows, and only the last part holds fewer. It is written whole, and its rows
count as done when it exists. Parts of CSV and JSON Lines, put together in their order, are the very file that
a run on a local disk writes.
"""

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import remove_leftovers, sync_files
from rollcli.files.codecs.parquet import encode_parquet, require_parquet
from rollcli.files.locking import locked_folder, not_resumable
from rollcli.files.results import (
    Row,
    column_types,
    format_header,
    format_row,
    parse_rows,
    part_names,
    plain_values,
    read_parts,
    read_run,
    run_path,
)
from rollcli.files.storage import create, list_names, remove, write_bytes
from rollcli.files.stores.locations import base_name, is_url
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.options import EstimateOptions
from rollcli.run.outputs import local_images, remove_image_leftovers, remove_marks
from rollcli.run.plan import Plan
from rollcli.run.record import RunRecord
from rollcli.run.resume import KeptRows, check_restored, new_record
from rollcli.run.summary import RunSummary

_CHECK_S = 10.0  # a request of 50 ms now and then


class PartsOutput:
    """Rows to a folder of parts, and FILE.run.json beside it."""

    resumable, notes = True, False

    def __init__(
        self,
        plan: Plan,
        record: RunRecord,
        kept: KeptRows,
        options: EstimateOptions,
        keep_open: int | None = None,
    ) -> None:
        self.kept, self.keep_open = kept, keep_open
        self._plan, self._record, self._part_rows = plan, record, options.result.part_rows
        self._next = kept.count // self._part_rows
        self._replaced_part, self._replacing = 0, dict[int, Row]()  # rows by their positions in the result
        self._waiting: list[Row] = []
        self.replaces = record.replaces
        self._image_options = options.images
        self._images: list[str] = []  # those of the part that is being filled
        self._checked = time.monotonic()
        self._written = kept.count

    def append(self, frame: Frame, result: FrameResult) -> None:
        """Take the row; every full part is written."""
        if time.monotonic() - self._checked > _CHECK_S:
            self._check_owned()
        self._record.saw(result.encoding, result.searched)
        self._waiting.append(result.row)
        self._take_images(frame, result)
        if len(self._waiting) == self._part_rows:
            self._write()

    def finish(self, summary: RunSummary) -> None:
        """Write the last part, and the summary into the record."""
        if self._waiting or not self._written:
            self._write()
        self._record.write(summary)

    def restore(self, frame: Frame, result: FrameResult) -> None:
        """Take the images of an incomplete frame, which were made again.

        Raises
        ------
        OutputError
            They could not be made: its row no longer holds.
        """
        check_restored(frame, result)
        self._take_images(frame, result)

    def replace(self, position: int, frame: Frame, result: FrameResult) -> None:
        """Take the row; a part is written anew once its last such row is known."""
        number = position // self._part_rows
        if number != self._replaced_part:
            self.commit()
        self._replaced_part = number
        self._record.saw(result.encoding, result.searched)
        self._replacing[position] = result.row
        self._take_images(frame, result)

    def commit(self) -> None:
        """Write the part anew whose rows are replaced, if they differ; a new part waits until it is full."""
        sync_files(self._images)
        self._images.clear()
        if not self._replacing:
            return
        number, first = self._replaced_part, self._replaced_part * self._part_rows
        old = _rows_of_part(self._plan, number)
        rows = [self._replacing.get(position, row) for position, row in enumerate(old, first)]
        data = self._encoded(number, rows)
        if data != self._encoded(number, old):
            self._check_owned()
            write_bytes(_part_location(self._plan, number), data, durable=True)
        remove_marks([self._plan.frames[position] for position in self._replacing], self._image_options)
        self._replacing.clear()

    def hint(self) -> str:
        """Say that --resume continues after the last part."""
        return f"; {self._written} rows are kept, continue with --resume" if self._written else ""

    def _take_images(self, frame: Frame, result: FrameResult) -> None:
        if result.row.status != "error":
            self._images.extend(local_images(frame, self._image_options))

    def _check_owned(self) -> None:
        self._record.check_owned()
        self._checked = time.monotonic()

    def _write(self) -> None:
        sync_files(self._images)
        self._images.clear()
        data = self._encoded(self._next, self._waiting)
        location = _part_location(self._plan, self._next)
        self._check_owned()
        if not create(location, data, self._record.run):
            raise UsageError(
                f"{location}: another run has written this part; give each an --output of its own"
            )
        self._written += len(self._waiting)
        self._next += 1
        self._waiting = []

    def _encoded(self, number: int, rows: Sequence[Row]) -> bytes:
        plan = self._plan
        if plan.format == "parquet":
            values = [plain_values(row, plan.further) for row in rows]
            return encode_parquet(column_types(plan.further), values, self._record.of_rows)
        header = format_header(plan.format, plan.further) if number == 0 else b""
        return header + b"".join(format_row(row, plan.format, plan.further) for row in rows)


@contextlib.contextmanager
def open_parts(plan: Plan, options: EstimateOptions) -> Iterator[PartsOutput]:
    """Begin a folder of parts, or continue that of an interrupted run.

    Raises
    ------
    UsageError
        Parts exist and neither --resume nor --overwrite is given, or they cannot be continued.
    OutputError
        The folder cannot be written.
    """
    if plan.format == "parquet":
        require_parquet()
    check_parts(plan, resume=options.result.resume, overwrite=options.running.overwrite)
    if is_url(plan.output):
        yield _begin(plan, options, None)
    else:
        with locked_folder(plan.output) as descriptor:
            yield _begin(plan, options, descriptor)


def _begin(plan: Plan, options: EstimateOptions, keep_open: int | None) -> PartsOutput:
    # again, now that no other run can write it
    parts = check_parts(plan, resume=options.result.resume, overwrite=options.running.overwrite)
    kept = _kept(plan, options, parts)
    record = new_record(plan, options, kept, _earlier(plan) if kept.count else None)
    if not is_url(plan.output):
        all_parts = range(_whole_parts(len(plan.frames), options.result.part_rows))
        to_write = [_part_location(plan, number) for number in all_parts]  # a kill may have met any of them
        remove_leftovers([run_path(plan.output), *to_write, *(f"{plan.output}/{name}" for name in parts)])
    if options.result.resume or options.running.overwrite:
        remove_image_leftovers(kept.not_failed(), options.images)
    for name in parts[_whole_parts(kept.count, options.result.part_rows) :]:
        remove(f"{plan.output}/{name}")
    record.write()
    record.check_owned()  # another run may have begun in this very second
    return PartsOutput(plan, record, kept, options, keep_open)


def check_parts(plan: Plan, *, resume: bool, overwrite: bool) -> list[str]:
    """Return the names of the parts that exist, in order; refuse to touch them unless told how.

    Raises
    ------
    UsageError
        Parts exist and neither --resume nor --overwrite is given; or a file is in the folder's place.
    """
    if not is_url(plan.output) and Path(plan.output).exists() and not Path(plan.output).is_dir():
        raise UsageError(f"{plan.output}: is a file; a result of parts is a folder, give another --output")
    parts = part_names(list_names(plan.output))
    if parts and not (resume or overwrite):
        raise UsageError(
            f"{plan.output}: exists already; give --resume to continue it or --overwrite to replace it"
        )
    endings = {name.rpartition(".")[2] for name in parts}
    if resume and parts and endings != {plan.format}:
        raise not_resumable(plan.output, f"its parts are {', '.join(sorted(endings))}, not {plan.format}")
    return parts


def kept_in_parts(plan: Plan, options: EstimateOptions) -> KeptRows:
    """Take in the rows that a resume would keep."""
    parts = check_parts(plan, resume=options.result.resume, overwrite=options.running.overwrite)
    return _kept(plan, options, parts)


def _kept(plan: Plan, options: EstimateOptions, parts: list[str]) -> KeptRows:
    """Take in the rows of the parts from the first one on, as far as none is missing or short.

    The names are sorted: after a missing part, no name has the number of its place.
    """
    kept = KeptRows(plan, options)
    if not options.result.resume:
        return kept
    numbered = enumerate(parts)
    present = [name for number, name in numbered if name == base_name(_part_location(plan, number))]
    try:
        for name, data in read_parts(plan.output, present):
            rows = tuple(parse_rows(data, name))
            if len(rows) < options.result.part_rows and kept.count + len(rows) != len(plan.frames):
                break
            for row in rows:
                kept.add(row)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error
    return kept


def _rows_of_part(plan: Plan, number: int) -> tuple[Row, ...]:
    """Read a part again; the first one has the header of CSV."""
    names = dict.fromkeys(base_name(_part_location(plan, each)) for each in (0, number))
    *_, (name, data) = read_parts(plan.output, names)
    return tuple(parse_rows(data, name))


def _whole_parts(rows: int, part_rows: int) -> int:
    return -(-rows // part_rows)


def _earlier(plan: Plan) -> Mapping[str, Any] | None:
    try:
        return read_run(plan.output)
    except InputError as error:
        raise not_resumable(plan.output, str(error)) from error


def _part_location(plan: Plan, number: int) -> str:
    return f"{plan.output}/part-{number:05d}.{plan.format}"
