"""FILE.run.json, what a result was made with, and how a later run continues the result.

The record is written for people and for `--resume`, which compares it with the new run and keeps the rows
that are finished.
"""

import hashlib
import json
import math
import os
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property
from itertools import islice
from typing import Any, TypeVar, get_args

from rollcli import __version__
from rollcli.errors import InputError
from rollcli.files import results
from rollcli.files.locking import differences, not_resumable
from rollcli.files.storage import write_bytes
from rollcli.files.stores.locations import base_name, public_name
from rollcli.messages import counted
from rollcli.rig.calibration import Calibration
from rollcli.run import outputs
from rollcli.run.batch import Step, check_owned
from rollcli.run.frame import Frame, ReadAs
from rollcli.run.options import (
    EncodingOptions,
    FramesOptions,
    ImageOptions,
    Layout,
    MethodOptions,
    PairOptions,
    RegionOptions,
)
from rollcli.run.plan import Plan
from rollcli.run.progress import RunSummary
from rollcli.run.result_file import Inputs, data_of
from rollcli.stereo.correction import Correction
from rollcli.stereo.options import StereoOptions


def names_of(frames: Sequence[Frame]) -> dict[str, Any]:
    """Summarise the frames: how many, and a digest of their names."""
    names = hashlib.sha256()
    for frame in frames:
        names.update(os.fsencode(f"{frame.file}\0{frame.right_file}\0"))
    return {"frames": len(frames), "names": names.hexdigest()}


CONVENTIONS = {
    "roll_deg": "theta, degrees, (-90, 90]; positive: the rig is rolled counter-clockwise seen from behind",
    "roll_ci95_deg": "half-width of the 95 % interval, degrees",
    "pitch_deg": "angle of the optical axis to the road near ahead, degrees; positive: looks down",
    "height_m": "of the left camera over the road near ahead, metres",
    "camber": "curvature across the road, 1/(camera height): x camera heights to the side, the surface is "
    "higher by camber/2 x^2 camera heights; negative: crowned; 0: it may be noise; no pitch_deg: as if level",
    "right_lower_px, right_clockwise_deg, right_larger_percent, right_twist_px": "how the right view lay "
    "against the left one, px of the size matched at; twist: vertical shift in the corners",
    "alignment": "medians of these over the pairs",
    "alpha0, alpha1, alpha2": "road disparity in px = alpha0 + alpha1 y + alpha2 y^2",
    "y": "v cos(theta) - u sin(theta), px; u right, v down, from the centre of the top-left pixel; theta: "
    "image_roll_deg where there is one, else roll_deg",
}

_FURTHER = "further_columns"  # beside those of every result
_DAMAGED = "damaged_calibrations"  # the frames whose own calibration could not be read
_REPLACES = "replaces_images"  # while a run with --overwrite is not over
_NUMBERS = ("scale", "num_disparities", "vertical_offset")  # options that are None by default
Options = TypeVar("Options", EncodingOptions, ImageOptions, MethodOptions, RegionOptions, StereoOptions)


class RunRecord:
    """The record of one run; the same run gives the same bytes, whether it was interrupted or not."""

    def __init__(self, plan: Plan) -> None:
        self.plan, options = plan, plan.options
        self.read_as = ReadAs()
        self.run = uuid.uuid4().hex  # tells our objects from those of another run
        self._begun = False
        # older images: now, and once this run is resumed
        self.replaces = options.running.overwrite or options.result.update

    @cached_property
    def fixed(self) -> dict[str, Any]:
        """What was fixed before the run; made when asked for, since that takes all frames."""
        plan, options = self.plan, self.plan.options
        fixed = {"rollcli": __version__, "options": _effective(plan), "inputs": names_of(plan.frames)}
        if options.calibration.given:
            # in one pass: frames of a sorted list are made anew in each
            seen = dict.fromkeys((frame.calibration, frame.damaged and frame.file) for frame in plan.frames)
            fixed["calibration"] = _calibrations(each for each, _ in seen)
            if damaged := [file for _, file in seen if file]:
                fixed[_DAMAGED] = damaged
        if options.paired and (correction := options.stereo.correction) is not None:
            fixed["correction"] = correction.as_record()  # its file may be written anew
        return fixed

    def check_owned(self) -> None:
        """Check that no other run has begun since; see `batch.check_owned`."""
        if self._begun:
            check_owned(self.plan.output, self.run)

    def continue_from(self, earlier: Mapping[str, Any], kept: "KeptRows") -> None:
        """Take over what the interrupted run has recorded about the inputs of the rows that are kept."""
        if kept.summary.frames:
            encodings, searched = frozenset(earlier["encoding"]), tuple(earlier["disparities_searched_px"])
            self.read_as = ReadAs(encodings, searched or None, recorded_downscale(earlier, self.plan.output))
        self.replaces |= earlier.get(_REPLACES) is True

    def saw(self, read_as: ReadAs) -> None:
        """Record how frames were read; the file says so before their rows are written."""
        before, self.read_as = self.read_as, self.read_as.joined(read_as)
        if self.read_as != before:
            self.write()

    def write(self, summary: RunSummary | None = None) -> None:
        """Write the file, whole or not at all; none of a stream. No summary until the run is over.

        Raises
        ------
        UsageError
            See `check_owned`.
        OutputError
            It cannot be written.
        """
        if not self.plan.files:
            return
        self.check_owned()
        told, matched = self.plan.options.stereo.correction, self.plan.options.paired
        record = {
            **self.fixed,
            _FURTHER: list(self.plan.further),
            "encoding": sorted(self.read_as.encodings),
            "disparities_searched_px": list(self.read_as.searched or ()),
            **({"downscale": self.read_as.downscale} if self.read_as.downscale > 1 else {}),
            "alignment": summary and summary.alignment(told, matched=matched),
            "conventions": CONVENTIONS,
            "counts": summary.totals if summary else {},
            **({_REPLACES: True} if self.replaces and not summary else {}),
        }
        data = json.dumps(record, indent=2, allow_nan=False).encode() + b"\n"
        write_bytes(results.run_path(self.plan.output), data, durable=True, owner=self.run)
        self._begun = True


def _effective(plan: Plan) -> dict[str, Any]:
    """Collect the options that decide the bytes of rows and images, by their names on the command line."""
    options = plan.options
    read = _by_name(options.stereo) if options.paired else _by_name(options.encoding)
    layout = options.pairs.side_by_side
    if "invalid" in read:  # JSON has no numbers that are not finite
        read["invalid"] = [each if math.isfinite(each) else str(each) for each in read["invalid"]]
    values = {**_by_name(options.method), **_by_name(options.region), **_by_name(options.images), **read}
    values |= {
        "format": plan.format,
        "timing": options.result.timing,
        **({"part-rows": options.result.part_rows} if options.result.in_parts else {}),
        "shard": "/".join(map(str, options.result.shard)),
        **({"shard-by": "range"} if options.result.shard_by == "range" else {}),
        **({"side-by-side": layout} if layout else {}),
    }
    return {
        _option_name(key): public_name(value) if isinstance(value, str) else value
        for key, value in values.items()
    }


def _option_name(field: str) -> str:
    return "sgbm-mode" if field == "mode" else field.removesuffix("_deg").replace("_", "-")


def _by_name(options: Options) -> dict[str, Any]:
    return asdict(options) if isinstance(options, StereoOptions) else options._asdict()


def _calibrations(of_frames: Iterable[Calibration | None]) -> dict[str, Any]:
    """List the first few calibrations used, and where they are from; count how many differ."""
    used = dict.fromkeys(each for each in of_frames if each is not None)
    digest = hashlib.sha256("\n".join(map(repr, used)).encode("utf-8", "surrogateescape"))
    return {
        "different": len(used),
        "sha256": digest.hexdigest(),
        "first": [asdict(calibration) for calibration in islice(used, _CALIBRATIONS_LISTED)],
    }


_CALIBRATIONS_LISTED = 3


def recorded_calibrations(run: Mapping[str, Any] | None) -> list[Calibration]:
    """Read back the calibrations that a run's record lists; none where there are none to be read."""
    try:
        return [Calibration(**each) for each in (run or {})["calibration"]["first"]]
    except (KeyError, TypeError, ValueError):
        return []


def recorded_encodings(run: Mapping[str, Any] | None) -> list[str]:
    """Read back how maps were read."""
    found = (run or {}).get("encoding")
    return list(map(str, found)) if isinstance(found, list) else []


def recorded_downscale(run: Mapping[str, Any] | None, name: str) -> float:
    """Read back how much wider than maps their images were."""
    found = (run or {}).get("downscale")
    if found is None:  # earlier records have it of pairs alone
        found = recorded_options(run, name).stereo.downscale
    return float(found) if isinstance(found, int | float) and 1 <= found < 1e3 else 1.0


def is_replaceable_record(path: str) -> bool:
    """Tell whether a new run may write its record here: there is none, or one of an earlier run."""
    data = data_of(path)
    try:
        return not data or isinstance(json.loads(data)["rollcli"], str)
    except (ValueError, RecursionError, KeyError, TypeError):
        return False


def recorded_options(run: Mapping[str, Any] | None, name: str) -> FramesOptions:
    """Read back how the run read, matched and wrote its frames; the defaults where there is no record.

    Parameters
    ----------
    run : mapping or None
        The content of FILE.run.json.
    name : str
        What errors call it.

    Raises
    ------
    InputError
        It is not the record of a run.
    """
    given = (run or {}).get("options", {})
    if not isinstance(given, Mapping):
        raise InputError(f"{name}: is not the record of a run: its options are no table")
    layout, correction = given.get("side-by-side"), (run or {}).get("correction")
    try:
        if layout not in (None, *get_args(Layout)):
            raise TypeError(f"side-by-side is {layout!r}")
        if correction is None:
            stereo = _filled(StereoOptions(), given)
        else:  # whose file may lie elsewhere by now, or hold another one
            stereo = _filled(StereoOptions(), {**given, "align": "auto"})
            stereo = replace(stereo, align=Correction.of_record(correction))
        return FramesOptions(
            encoding=_filled(EncodingOptions(), given),
            method=_filled(MethodOptions(), given),
            stereo=stereo,
            region=_region(given),
            images=_filled(ImageOptions(), given),
            pairs=PairOptions(side_by_side=layout),
        )
    except (TypeError, ValueError, KeyError) as error:
        raise InputError(f"{name}: is not the record of a run: {error}") from error


def _region(given: Mapping[str, Any]) -> RegionOptions:
    mask, roi, polygon = (given.get(name) for name in RegionOptions._fields)
    if not isinstance(mask, str | None) or (roi is not None and len(roi) != 4) or polygon in ([], {}):
        raise TypeError(f"mask is {mask!r}, roi {roi!r}, polygon {polygon!r}")
    corners = polygon and tuple((float(x), float(y)) for x, y in polygon)
    return RegionOptions(mask, roi and tuple(map(int, roi)), corners)


def _filled(defaults: Options, given: Mapping[str, Any]) -> Options:
    """Replace the defaults by what is given."""
    values: dict[str, Any] = {}
    for name, before in _by_name(defaults).items():
        key = _option_name(name)
        value: Any = given.get(key, before)
        if isinstance(before, tuple) and isinstance(value, list):
            value = tuple(map(float, value))
            if before and len(value) != len(before):
                raise TypeError(f"{key} is {list(value)!r}")
        fits = isinstance(value, _kinds(name, before)) or (name, value) == ("lambda0", "auto")
        if not fits or isinstance(value, bool):
            raise TypeError(f"{key} is {value!r}")
        values[name] = value
    return type(defaults)(**values)


def _kinds(name: str, default: Any) -> tuple[type, ...]:
    """List the types that JSON may hold for an option."""
    if default is None:
        return (type(None), int, float) if name in _NUMBERS else (type(None), str)
    return {int: (int,), float: (int, float), tuple: (tuple,)}.get(type(default), (str,))


_RETRIED_AT_ONCE = 1000  # frames whose work a kill costs; starting the workers anew adds 3 % of their time


class KeptRows:
    """Takes in the rows in their order, and holds none of them: there may be a million.

    Attributes
    ----------
    count : int
        How many they are, holes included.
    errors : list of int
        Positions, from 0, of those without an angle.
    holes : list of int
        Positions before others that have no row: parts that workers had not written.
    again : list of int
        Positions of those whose frames are done again: they have failed, have changed, or are not done yet.
    changed : list of str
        The files of frames that hold something else than their rows were made from.
    gone : int
        How many rows have left the result, since their frames are gone.
    incomplete : list of Frame
        Frames whose images are missing or empty, whatever the cause.
    summary : RunSummary
    mismatch : str
        Which row is the first that is not of the frame in its place; empty where there is none.
    """

    def __init__(self, plan: Plan) -> None:
        self.count, self.gone = 0, 0
        self.changed: list[str] = []
        self.holes: list[int] = []
        self.errors: list[int] = []
        self.again: list[int] = []
        self.incomplete: list[Frame] = []
        self.summary = RunSummary()
        self.mismatch = ""
        self._frames, self._writes = plan.frames, plan.options.writes
        self._following = iter(plan.frames)
        self._retries = plan.options.result.retry_failed
        self._made = outputs.Existing(filled=True)

    def not_failed(self) -> Iterator[Frame]:
        """Yield the frames whose row is not `error`, or not there yet.

        Marks beside images of the others are needed until these are done again.
        """
        failed = set(self.errors)
        return (frame for position, frame in enumerate(self._frames) if position not in failed)

    def take(self, rows: Iterable[results.Row], inputs: Inputs) -> bool:
        """Take in the next rows, up to one that has no line among those of the inputs; tell whether none has.

        Such a row is left out, and so are those behind it.
        """
        return all(self._add(row, inputs) for row in rows)

    def _add(self, row: results.Row, inputs: Inputs) -> bool:
        is_again = row.message == _NOT_YET or (row.status == "error" and self._retries)
        if (frame := next(self._following, None)) is not None:
            if not self.mismatch and (row.file, row.right_file) != (frame.file, frame.right_file):
                self.mismatch = f"its row is of {row.file}, where now {frame.file} is"
            if not self.mismatch:
                if row.message == _NOT_YET:
                    inputs.take_unknown(frame)
                elif not inputs.take(frame):
                    return False
                if not is_again and inputs.has_changed(frame):
                    self.changed.append(frame.file)
                    is_again = True
            if row.status != "error" and not is_again:
                images = outputs.possible_paths(frame, self._writes)
                if not all(any(path in self._made for path in paths) for _, paths in images):
                    self.incomplete.append(frame)
        if row.status == "error":
            self.errors.append(self.count)
        if is_again:
            self.again.append(self.count)
        else:
            self.summary.add_row(row, self.count)
        self.count += 1
        return True

    def notes(self) -> Iterator[str]:
        """Yield what is said of them before the run begins."""
        if changed := len(self.changed):
            yield f"frames that are done again, since what they were made from has changed: {changed}"
        if self.gone:
            yield f"frames that are gone, whose rows leave the result and whose images stay: {self.gone}"
        if missing := len(self.incomplete):
            yield f"images are missing or empty for {missing} of the kept rows: they are made again"

    def steps(self) -> Iterator[Step]:
        """Yield what is to do: images that kept rows should have, rows that are done again, then all others.

        A result takes rows in the place of others once the workers have ended, which hold the lock of the
        file that it was.
        """
        every = self._frames
        if self.incomplete:
            yield Step(self.incomplete)
        for first in range(0, len(self.again), _RETRIED_AT_ONCE):
            again = self.again[first : first + _RETRIED_AT_ONCE]
            yield Step([every[at] for at in again], again, retries=True)
        if self.holes:
            yield Step([every[at] for at in self.holes], self.holes)
        if self.count < len(every):
            yield Step(every[self.count :], range(self.count, len(every)))

    def skip_to(self, position: int) -> None:
        """Leave a hole before the row at a position."""
        if position > self.count:
            self.holes += range(self.count, position)
            self.count, self._following = position, iter(self._frames[position:])


_NOT_YET = "not estimated yet: the run that adds this frame is not over"  # in its row until then


def arranged(data: bytes, plan: Plan) -> tuple[bytes, int]:
    """Put the rows of a result into the order of the frames; those added amid them get rows that say so.

    Parameters
    ----------
    data : bytes
        A result, cut after its last whole row.
    plan : Plan
        Its frames may have been added, or have gone; those behind the last row are added after this.

    Returns
    -------
    bytes, int
        The result; and how many rows have left it, since their frames are gone.
    """
    before = dict[int, bytes]()
    for row in results.parse_rows(data, plan.output):
        # fx and fy of a calibration may have come to differ, or to be the same
        now = replace(row, image_roll_deg=row.map_roll_deg)
        before[_key(row)] = results.format_row(now, plan.format, plan.further)
    pieces, waiting = [results.format_header(plan.format, plan.further)], list[bytes]()
    for frame in plan.frames:
        line = before.pop(_key(frame), None)
        if line is None:
            row = results.Row(frame.file, frame.right_file, "error", message=_NOT_YET)
            waiting.append(results.format_row(row, plan.format, plan.further))
        else:
            pieces += [*waiting, line]
            waiting.clear()
    return b"".join(pieces), len(before)


def _key(of: results.Row | Frame) -> int:
    return hash((of.file, of.right_file))  # which takes less memory than the names


def new_record(plan: Plan, kept: KeptRows, parts: Sequence[str] = ()) -> RunRecord:
    """Make the record of a run, which continues that of an interrupted run where rows are kept.

    Of a run with larger parts none of the `parts` that are there is kept, and yet they hold rows.

    Raises
    ------
    UsageError
        It cannot be continued; says what differs. Or it is a first start, and there are images already.
    """
    record, options = RunRecord(plan), plan.options
    if options.result.resume:
        try:
            earlier = results.read_run(plan.output)
            found = next(_differences(kept, earlier, record), "")
        except InputError as error:
            found = str(error)
        if found and (kept.count or parts):
            raise not_resumable(plan.output, found)
        if found:  # what is there is of another run
            outputs.check_nothing_is_there(outputs.files_of(plan.frames, options.writes))
        elif earlier is not None:
            record.continue_from(earlier, kept)
    return record


def _differences(kept: KeptRows, was: Mapping[str, Any] | None, record: RunRecord) -> Iterator[str]:
    """Yield what keeps a run with this record from being continued by another one, in words."""
    plan, now = record.plan, record.fixed
    if was is None:
        yield f"there is no {base_name(results.run_path(plan.output))}"
        return
    if not _is_whole(was):
        yield f"{base_name(results.run_path(plan.output))} is damaged"
        return
    yield from differences(was, now)
    if was.get("correction") != now.get("correction"):
        yield f"--align {plan.options.stereo.align} has changed since"
    if plan.options.result.update:
        return
    frames, count = plan.frames, was["inputs"].get("frames")
    grown = isinstance(count, int) and 0 < count < len(frames)
    if grown:  # what has been added sorts last, or the names differ
        frames = frames[:count]
        now = RunRecord(replace(plan, frames=frames)).fixed
    updates = not plan.options.result.in_parts
    again = "; --update does again what has changed" if updates else ""
    if isinstance(was.get(_DAMAGED), list):  # their rows are errors until --retry-failed, mended or not
        damaged = set(map(str, was[_DAMAGED]))
        sound = _calibrations(frame.calibration for frame in frames if frame.file not in damaged)
        now = {**now, "calibration": sound}
    if was.get("calibration") != json.loads(json.dumps(now.get("calibration"))):
        yield f"the calibration differs{again}"
    columns = list(plan.further)
    if was.get(_FURTHER, columns) != columns:  # those of any shard's frames; earlier records have none
        adds = "differ, which adds" if results.IMAGE_ROLL in columns else "no longer differ, which drops"
        yield f"fx and fy of a frame {adds} a column{'; --update does so' if updates else ''}"
    hint = "; --update leaves out the rows of frames that are gone" if updates else ""
    if grown:
        hint = f"; new frames must sort last{', or be added by --update' if updates else ''}"
    if kept.mismatch:
        yield f"the inputs differ: {kept.mismatch}{hint}"
    if kept.count > len(frames):
        there = f"there {'is' if len(frames) == 1 else 'are'} {counted(len(frames), 'frame')}"
        yield f"it has {counted(kept.count, 'row')}, and {there}{hint}"
    inputs_was, inputs_now = was["inputs"], now["inputs"]
    if inputs_was.get("frames") != inputs_now["frames"]:
        yield f"it was begun with {inputs_was.get('frames')} frames, now there are {inputs_now['frames']}"
    if inputs_was.get("names") != inputs_now["names"]:
        yield f"the names of the inputs differ{hint}"
    if kept.changed:
        how = again
        if {frames[at].file for at in kept.errors}.issuperset(kept.changed):
            how = "; --retry-failed does again what has failed"
        also = {"right image": plan.options.paired, "mask": plan.options.region.mask}
        read = [kept.changed[0], *(f"its {each}" for each, given in also.items() if given)]
        yield f"{' or '.join(read)} has changed since{how}"


_LISTS = {"encoding": str, "disparities_searched_px": int}
_RECORDED = {"rollcli": str, "options": dict, "inputs": dict, **dict.fromkeys(_LISTS, list)}


def _is_whole(run: Mapping[str, Any]) -> bool:
    """Tell whether a record holds all that a run writes, each of its type."""
    if not all(isinstance(run.get(name), kind) for name, kind in _RECORDED.items()):
        return False
    return all(isinstance(each, kind) for name, kind in _LISTS.items() for each in run[name])
