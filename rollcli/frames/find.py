"""Find the frames that a user named: maps or stereo pairs, each with its mask and its calibration."""

from collections.abc import Sequence
from pathlib import Path, PurePath

from rollcli.errors import UsageError
from rollcli.files.existence import is_file
from rollcli.files.inputs import Input, find_inputs, pair_inputs
from rollcli.files.stores.locations import is_url
from rollcli.files.stores.search import is_place
from rollcli.frames.calibration import Calibrations
from rollcli.frames.frame import Frame
from rollcli.frames.options import InputOptions, PairOptions, RegionOptions
from rollcli.rig.options import CalibrationOptions


def map_frames(
    given: InputOptions,
    *,
    region: RegionOptions | None = None,
    calibration: CalibrationOptions | None = None,
    skip: Sequence[str] = (),
) -> list[Frame]:
    """Make a frame of each map; `skip` holds the output folders, which are not searched.

    Raises
    ------
    UsageError
        Nothing is named or found, or a mask or a calibration is missing.
    """
    if not (given.inputs or given.files_from):
        raise UsageError("no input: name maps (files, folders, patterns, or - for a list on stdin)")
    masks, calibrations = _Masks(region), Calibrations(calibration or CalibrationOptions())
    found = find_inputs(
        given.inputs,
        files_from=given.files_from,
        recursive=given.recursive,
        include=given.include,
        exclude=given.exclude,
        skip=skip,
    )
    return [_frame(each, None, masks, calibrations) for each in found]


def pair_frames(
    given: InputOptions,
    pairs: PairOptions,
    *,
    region: RegionOptions | None = None,
    calibration: CalibrationOptions | None = None,
    skip: Sequence[str] = (),
) -> list[Frame]:
    """Make a frame of each stereo pair; `skip` holds the output folders, which are not searched.

    Raises
    ------
    UsageError
        A side is not named, an image has no partner, or a mask or a calibration is missing.
    """
    if pairs.left is None or pairs.right is None:
        raise UsageError("--left and --right are given together")
    masks, calibrations = _Masks(region), Calibrations(calibration or CalibrationOptions())
    found = pair_inputs(
        pairs.left,
        pairs.right,
        match=pairs.match,
        recursive=given.recursive,
        include=given.include,
        exclude=given.exclude,
        skip=skip,
    )
    return [_frame(pair.left, pair.right, masks, calibrations) for pair in found]


def _frame(left: Input, right: Input | None, masks: "_Masks", calibrations: Calibrations) -> Frame:
    return Frame(
        file=left.name,
        right_file=right.name if right else "",
        path=left.location,
        right_path=right.location if right else "",
        relative=left.relative,
        mask=masks.of(left),
        calibration=calibrations.of(left.name),
    )


class _Masks:
    """One mask for all frames, or one of the same stem each."""

    def __init__(self, region: RegionOptions | None) -> None:
        self.one, self.by_stem = region.mask if region else None, None
        if self.one is not None and is_place(self.one):
            found = find_inputs([self.one], recursive=True)
            self.by_stem = {Path(each.name).stem: each.location for each in found}
        elif self.one is not None and not (is_url(self.one) or is_file(self.one)):
            raise UsageError(f"{self.one}: no such mask file or folder")

    def of(self, left: Input) -> str | None:
        """Find the mask of a frame."""
        if self.by_stem is None:
            return self.one
        try:
            return self.by_stem[PurePath(left.name).stem]
        except KeyError:
            raise UsageError(f"{left.name}: has no mask of its name in {self.one}") from None
