"""Compare an interrupted run with the run that would continue it."""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

from rollcli.batch.fingerprint import changed_input
from rollcli.batch.kept_rows import KeptRows
from rollcli.batch.options import EstimateOptions
from rollcli.batch.plan import Plan, check_images_are_new
from rollcli.batch.run_record import RunRecord
from rollcli.errors import InputError, OutputError
from rollcli.files.results import read_run, run_path
from rollcli.files.resumable import differences, not_resumable
from rollcli.files.storage import modified_ns
from rollcli.files.stores.locations import base_name
from rollcli.frames.frame import Frame, FrameResult

_SORT_LAST = "new frames must sort last: estimate these into a result of their own"


def check_restored(frame: Frame, result: FrameResult) -> None:
    """Check that the images of a kept row were made again.

    Raises
    ------
    OutputError
        They could not be: the row no longer holds.
    """
    if result.row.status == "error":
        raise OutputError(f"the images of {frame.file} cannot be made again: {result.row.message}")


def new_record(
    plan: Plan, options: EstimateOptions, kept: KeptRows, earlier: Mapping[str, Any] | None
) -> RunRecord:
    """Make the record of a run, which continues that of an interrupted run where rows are kept.

    Parameters
    ----------
    plan : Plan
    options : EstimateOptions
    kept : KeptRows
    earlier : mapping or None
        Its record.

    Raises
    ------
    UsageError
        It cannot be continued; says what differs. Or it is a first start, and there are images already.
    """
    unknown = unknown_inputs(earlier)
    retried = kept.failed
    begun = begun_plan(plan, earlier)
    record = RunRecord(plan, options, () if retried else unknown)
    if kept.count:
        same = record if begun is plan and not (retried and unknown) else RunRecord(begun, options, unknown)
        added = len(plan.frames) - len(begun.frames)
        record.continue_from(check_resumable(kept, earlier, same, begun, added))
    elif options.result.resume:
        _start_or_continue(record, plan, options, kept)
    return record


def begun_plan(plan: Plan, run: Mapping[str, Any] | None) -> Plan:
    """Return the plan without the frames that have been added since a run began, if these sort last."""
    inputs = (run or {}).get("inputs")
    count = inputs.get("frames") if isinstance(inputs, dict) else None
    if not isinstance(count, int) or not 0 < count < len(plan.frames):
        return plan
    return replace(plan, frames=plan.frames[:count])


def check_resumable(
    kept: KeptRows, run: Mapping[str, Any] | None, record: RunRecord, plan: Plan, added: int = 0
) -> Mapping[str, Any]:
    """Refuse to continue a result of another version, other options or other inputs.

    Parameters
    ----------
    kept : KeptRows
        Of the interrupted run; the files of frames that are done again may have changed.
    run : mapping or None
        Its record.
    record : RunRecord
        Of the plan.
    plan : Plan
        As many frames as the interrupted run had, if there are as many; see `begun_plan`.
    added : int
        How many frames there are beyond them.

    Returns
    -------
    mapping
        The record of the interrupted run.

    Raises
    ------
    UsageError
        Says what differs.
    """
    record_name = base_name(run_path(plan.output))
    if run is None:
        raise not_resumable(plan.output, f"there is no {record_name}")
    if not _is_whole(run):
        raise not_resumable(plan.output, f"{record_name} is damaged")
    for difference in _differences(kept, run, record.fixed, plan, added):
        raise not_resumable(plan.output, difference)
    return run


def _start_or_continue(record: RunRecord, plan: Plan, options: EstimateOptions, kept: KeptRows) -> None:
    """Find out what a resume without rows is: a first start, or the same run, which had got no further.

    Raises
    ------
    UsageError
        A first start, and there are images: they belong to another run.
    """
    try:
        run = read_run(plan.output)
    except InputError:
        run = None
    if run is not None and _is_whole(run) and not any(_differences(kept, run, record.fixed, plan, 0)):
        record.continue_from(run)
    else:
        check_images_are_new(plan.frames, options)


def unknown_inputs(run: Mapping[str, Any] | None) -> list[str]:
    """List the inputs that the interrupted run could not look at, by its record."""
    inputs = (run or {}).get("inputs")
    listed = inputs.get("unknown", []) if isinstance(inputs, dict) else []
    return [each for each in listed if isinstance(each, str)] if isinstance(listed, list) else []


def _differences(
    kept: KeptRows, was: Mapping[str, Any], now: Mapping[str, Any], plan: Plan, added: int
) -> Iterator[str]:
    yield from differences(was, now)
    if was.get("calibration") != json.loads(json.dumps(now.get("calibration"))):
        yield "the calibration differs"
    if found := kept.mismatch:
        if added and found.frame_is_new:
            yield f"{found.frame_file} has been added and sorts before {found.row_file}; {_SORT_LAST}"
        yield f"the inputs differ: its row is of {found.row_file}, where now {found.frame_file} is"
    if kept.count > len(plan.frames):
        yield f"it has {kept.count} rows, and there are {len(plan.frames)} frames"
    inputs_was, inputs_now = was["inputs"], now["inputs"]
    if inputs_was.get("frames") != inputs_now["frames"]:
        yield f"it was begun with {inputs_was.get('frames')} frames, now there are {inputs_now['frames']}"
    if added and inputs_was.get("names") != inputs_now["names"]:
        yield f"frames have been added that sort before others of its frames; {_SORT_LAST}"
    if inputs_was.get("names") != inputs_now["names"]:
        yield "the names of the inputs differ"
    if inputs_was != inputs_now:
        changed = _changed_input(plan, set(kept.failed))
        if changed or not kept.failed:
            yield f"{changed or 'an input'} has changed since"


def _changed_input(plan: Plan, retried: Collection[int]) -> str | None:
    """Find an input that is newer than the record, or missing, apart from those of frames done again."""
    frames = [frame for position, frame in enumerate(plan.frames) if position not in retried]
    return changed_input(frames, modified_ns(run_path(plan.output)))


def _is_whole(run: Mapping[str, Any]) -> bool:
    """Tell whether a record holds all that a run writes, each of its type."""
    encodings, searched = run.get("encoding"), run.get("disparities_searched_px")
    return (
        isinstance(run.get("rollcli"), str)
        and isinstance(run.get("options"), dict)
        and isinstance(run.get("inputs"), dict)
        and isinstance(encodings, list)
        and all(isinstance(each, str) for each in encodings)
        and isinstance(searched, list)
        and all(isinstance(each, int) for each in searched)
    )
