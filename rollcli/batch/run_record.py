"""FILE.run.json: what a result was made with, and what a resume compares."""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rollcli import __version__
from rollcli.batch.options import EstimateOptions
from rollcli.batch.plan import Plan
from rollcli.errors import UsageError
from rollcli.files.atomic import write_atomic
from rollcli.files.results import Row, run_path
from rollcli.frames.frame import Frame

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

CONVENTIONS = {
    "roll_deg": "theta, degrees, (-90, 90]; positive: the rig is rolled counter-clockwise seen from behind",
    "roll_ci95_deg": "half-width of the 95 % interval, degrees",
    "pitch_deg": "angle of the optical axis to the road near ahead, degrees; positive: looks down",
    "height_m": "of the left camera over the road near ahead, metres",
    "alpha0, alpha1, alpha2": "road disparity in px = alpha0 + alpha1 y + alpha2 y^2",
    "y": "v cos(theta) - u sin(theta), px; u right, v down, from the centre of the top-left pixel",
}


class RunRecord:
    """The record of one run; the same run gives the same bytes, whether it was interrupted or not."""

    def __init__(self, plan: Plan, options: EstimateOptions) -> None:
        self._output = plan.output
        self._encodings: set[str] = set()
        self._searched: list[int] = []
        self.fixed = {
            "rollcli": __version__,
            "options": _effective(plan, options),
            "inputs": _fingerprint(plan.frames),
        }
        if options.calibration.given:
            self.fixed["calibration"] = _calibrations(plan.frames)

    def continue_from(self, earlier: Mapping[str, Any]) -> None:
        """Take over what the interrupted run has seen."""
        self._encodings.update(earlier["encoding"])
        self._searched = list(earlier["disparities_searched_px"])

    def saw(self, encoding: str, searched: tuple[int, int] | None) -> None:
        """Note how a frame was read; on file before its row is."""
        before = self._encodings.copy(), self._searched
        if encoding:
            self._encodings.add(encoding)
        if searched is not None:
            ends = [*self._searched, *searched]
            self._searched = [min(ends), max(ends)]
        if (self._encodings, self._searched) != before:
            self.write({})

    def write(self, counts: Mapping[str, int]) -> None:
        """Write the file, whole or not at all; empty counts while the run is not over."""
        record = {
            **self.fixed,
            "encoding": sorted(self._encodings),
            "disparities_searched_px": self._searched,
            "conventions": CONVENTIONS,
            "counts": counts,
        }
        write_atomic(run_path(self._output), json.dumps(record, indent=2).encode() + b"\n")


def check_resumable(
    rows: Sequence[Row], run: Mapping[str, Any] | None, record: RunRecord, plan: Plan
) -> Mapping[str, Any]:
    """Refuse to continue a result that another version, other options or other inputs began.

    Returns
    -------
    mapping
        The record of the run that began it.

    Raises
    ------
    UsageError
        Says what differs.
    """
    record_name = run_path(plan.output).name
    if run is None:
        raise not_resumable(plan.output, f"there is no {record_name}")
    if not _is_whole(run):
        raise not_resumable(plan.output, f"{record_name} is damaged")
    for difference in _differences(rows, run, record.fixed, plan):
        raise not_resumable(plan.output, difference)
    return run


def not_resumable(name: str, reason: str) -> UsageError:
    """The error that refuses to continue a result, in one line that says what to do."""
    return UsageError(f"{name}: cannot be resumed: {reason}; --overwrite starts anew")


def _differences(
    rows: Sequence[Row], was: Mapping[str, Any], now: Mapping[str, Any], plan: Plan
) -> Iterator[str]:
    if was["rollcli"] != now["rollcli"]:
        yield f"it was begun by rollcli {was['rollcli']}, this is {now['rollcli']}"
    options_was, options_now = was["options"], json.loads(json.dumps(now["options"]))
    for key in (*options_now, *(key for key in options_was if key not in options_now)):
        if options_was.get(key) != options_now.get(key):
            yield f"--{key} was {_shown(options_was.get(key))}, is now {_shown(options_now.get(key))}"
    if was.get("calibration") != json.loads(json.dumps(now.get("calibration"))):
        yield "the calibration differs"
    for row, frame in zip(rows, plan.frames, strict=False):
        if (row.file, row.right_file) != (frame.file, frame.right_file):
            yield f"the inputs differ: its row is of {row.file}, where now {frame.file} is"
    if len(rows) > len(plan.frames):
        yield f"it has {len(rows)} rows, and there are {len(plan.frames)} frames"
    inputs_was, inputs_now = was["inputs"], now["inputs"]
    if inputs_was.get("frames") != inputs_now["frames"]:
        yield f"it was begun with {inputs_was.get('frames')} frames, now there are {inputs_now['frames']}"
    if inputs_was.get("names") != inputs_now["names"]:
        yield "the names of the inputs differ"
    if inputs_was != inputs_now:
        yield f"{_changed(plan) or 'an input'} has changed since"


def _is_whole(run: Mapping[str, Any]) -> bool:
    """Whether all is there that a run has recorded, each of its kind."""
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


def _changed(plan: Plan) -> str | None:
    """The first input that is younger than the record of the run, or gone."""
    begun = run_path(plan.output).stat().st_mtime_ns
    for path in (path for frame in plan.frames for path in frame.reads()):
        if not Path(path).exists() or Path(path).stat().st_mtime_ns > begun:
            return path
    return None


def _shown(value: Any) -> str:
    return "not given" if value in (None, []) else str(value)


def _effective(plan: Plan, options: EstimateOptions) -> dict[str, Any]:
    """The options that decide the bytes of rows and images, by their names on the command line."""
    records: list[DataclassInstance] = [options.method, options.region, options.images]
    records.append(options.encoding if options.pairs.left is None else options.stereo)
    values = {key: value for record in records for key, value in asdict(record).items()}
    values |= {
        "format": plan.format,
        "timing": options.result.timing,
        "shard": "/".join(map(str, options.result.shard)),
    }
    return {OPTION_NAMES.get(key, key).replace("_", "-"): value for key, value in values.items()}


OPTION_NAMES = {"tolerance_deg": "tolerance", "max_roll_deg": "max-roll", "mode": "sgbm-mode"}


def _calibrations(frames: Sequence[Frame]) -> dict[str, Any]:
    """The calibrations used and where they are from: the first few, and how many differ."""
    used = dict.fromkeys(frame.calibration for frame in frames if frame.calibration is not None)
    digest = hashlib.sha256("\n".join(map(repr, used)).encode("utf-8", "surrogateescape"))
    return {
        "different": len(used),
        "sha256": digest.hexdigest(),
        "first": [asdict(calibration) for calibration in islice(used, _CALIBRATIONS_LISTED)],
    }


_CALIBRATIONS_LISTED = 3


def _fingerprint(frames: list[Frame]) -> dict[str, Any]:
    """How many frames, their names, and the size and time of every file that they need."""
    names, files = hashlib.sha256(), hashlib.sha256()
    shared: dict[str, bytes] = {}  # one mask for all is asked about once
    for frame in frames:
        names.update(os.fsencode(f"{frame.file}\0{frame.right_file}\0"))
        for path in frame.reads():
            state = shared.get(path) or _state(path)
            if path == frame.mask:
                shared[path] = state
            files.update(state)
    return {"frames": len(frames), "names": names.hexdigest(), "files": files.hexdigest()}


def _state(path: str) -> bytes:
    try:
        found = Path(path).stat()
    except (OSError, ValueError):  # the latter for names that no file can have
        return b"missing\0"
    return b"%d %d\0" % (found.st_size, found.st_mtime_ns)
