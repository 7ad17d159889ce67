"""FILE.run.json: what a result was made with; it is written for people and for `--resume`, and read back."""

import hashlib
import json
import os
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import islice
from typing import Any, TypeVar, get_args

from rollcli import __version__
from rollcli.errors import InputError
from rollcli.files.results import run_path
from rollcli.files.storage import write_bytes
from rollcli.files.stores.locations import public_name
from rollcli.run.batch import check_owned
from rollcli.run.frame import Frame, ReadAs
from rollcli.run.options import (
    EncodingOptions,
    FrameOptions,
    ImageOptions,
    Layout,
    MethodOptions,
    RegionOptions,
)
from rollcli.run.plan import Plan
from rollcli.run.result_file import data_of
from rollcli.run.summary import RunSummary
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
    "higher by camber/2 x^2 camera heights; negative: crowned; 0: it may be noise",
    "right_lower_px, right_clockwise_deg, right_larger_percent, right_twist_px": "how the right view lay "
    "against the left one, px of the size matched at; twist: vertical shift in the corners",
    "alignment": "medians of these over the pairs",
    "alpha0, alpha1, alpha2": "road disparity in px = alpha0 + alpha1 y + alpha2 y^2",
    "y": "v cos(theta) - u sin(theta), px; u right, v down, from the centre of the top-left pixel",
}

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
        # older images, now and after a resume
        self.replaces = options.running.overwrite or options.result.update
        self.fixed = {
            "rollcli": __version__,
            "options": _effective(plan),
            "inputs": names_of(plan.frames),
        }
        if options.calibration.given:
            self.fixed["calibration"] = _calibrations(plan.frames)

    def check_owned(self) -> None:
        """Check that no other run has begun since; see `batch.check_owned`."""
        if self._begun:
            check_owned(self.plan.output, self.run)

    @property
    def of_rows(self) -> dict[str, Any]:
        """What holds for rows whichever they are: all that was fixed before the run but its inputs."""
        return {key: value for key, value in self.fixed.items() if key != "inputs"}

    def continue_from(self, earlier: Mapping[str, Any]) -> None:
        """Take over what the interrupted run has recorded about its inputs."""
        searched = earlier["disparities_searched_px"]
        self.read_as = ReadAs(frozenset(earlier["encoding"]), tuple(searched) if searched else None)
        self.replaces |= earlier.get(_REPLACES) is True

    def saw(self, read_as: ReadAs) -> None:
        """Record how frames were read; the file says so before their rows are written."""
        before, self.read_as = self.read_as, self.read_as.joined(read_as)
        if self.read_as != before:
            self.write()

    def write(self, summary: RunSummary | None = None) -> None:
        """Write the file, whole or not at all; there is no summary until the run is over.

        Raises
        ------
        UsageError
            See `check_owned`.
        OutputError
            It cannot be written.
        """
        self.check_owned()
        record = {
            **self.fixed,
            "encoding": sorted(self.read_as.encodings),
            "disparities_searched_px": list(self.read_as.searched or ()),
            "alignment": summary and summary.alignment(),
            "conventions": CONVENTIONS,
            "counts": summary.totals if summary else {},
            **({_REPLACES: True} if self.replaces and not summary else {}),
        }
        data = json.dumps(record, indent=2).encode() + b"\n"
        write_bytes(run_path(self.plan.output), data, durable=True, owner=self.run)
        self._begun = True


def _effective(plan: Plan) -> dict[str, Any]:
    """Collect the options that decide the bytes of rows and images, by their names on the command line."""
    options = plan.options
    read = _by_name(options.stereo) if options.paired else _by_name(options.encoding)
    layout = options.pairs.side_by_side
    values = {**_by_name(options.method), **_by_name(options.region), **_by_name(options.images), **read}
    values |= {
        "format": plan.format,
        "timing": options.result.timing,
        **({"part-rows": options.result.part_rows} if plan.in_parts else {}),
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


def _calibrations(frames: Sequence[Frame]) -> dict[str, Any]:
    """List the first few calibrations used, and where they are from; count how many differ."""
    used = dict.fromkeys(frame.calibration for frame in frames if frame.calibration is not None)
    digest = hashlib.sha256("\n".join(map(repr, used)).encode("utf-8", "surrogateescape"))
    return {
        "different": len(used),
        "sha256": digest.hexdigest(),
        "first": [asdict(calibration) for calibration in islice(used, _CALIBRATIONS_LISTED)],
    }


_CALIBRATIONS_LISTED = 3


def is_replaceable_record(path: str) -> bool:
    """Tell whether a new run may write its record here: there is none, or one of an earlier run."""
    data = data_of(path)
    try:
        return not data or isinstance(json.loads(data)["rollcli"], str)
    except (ValueError, RecursionError, KeyError, TypeError):
        return False


def recorded_options(run: Mapping[str, Any] | None, name: str) -> FrameOptions:
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
    layout = given.get("side-by-side")
    try:
        if layout not in (None, *get_args(Layout)):
            raise TypeError(f"side-by-side is {layout!r}")
        return FrameOptions(
            encoding=_filled(EncodingOptions(), given),
            method=_filled(MethodOptions(), given),
            stereo=_filled(StereoOptions(), given),
            images=_filled(ImageOptions(), given),
            side_by_side=layout,
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: is not the record of a run: {error}") from error


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
        if not isinstance(value, _kinds(name, before)) or isinstance(value, bool):
            raise TypeError(f"{key} is {value!r}")
        values[name] = value
    return type(defaults)(**values)


def _kinds(name: str, default: Any) -> tuple[type, ...]:
    """List the types that JSON may hold for an option."""
    if name == "lambda0":
        return (str, int, float)
    if default is None:
        return (type(None), int, float) if name in _NUMBERS else (type(None), str)
    return {int: (int,), float: (int, float), tuple: (tuple,)}.get(type(default), (str,))
