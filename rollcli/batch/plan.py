"""What a run will read and write, decided and checked before anything runs."""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

from rollcli.batch.job import Frame
from rollcli.batch.options import EstimateOptions, ImageOptions, RegionOptions
from rollcli.batch.outputs import image_paths
from rollcli.errors import UsageError
from rollcli.files.inputs import Input, find_inputs, pair_inputs
from rollcli.files.results import run_path

STDOUT = "-"


@dataclass(frozen=True)
class Plan:
    """The frames of a run, in the order of their rows, and where the rows go."""

    frames: list[Frame]
    output: str
    format: Literal["csv", "jsonl"]


def make_plan(options: EstimateOptions) -> Plan:
    """Find the frames and check what can be checked without reading them.

    Raises
    ------
    UsageError
        No input; pairs or masks without partner; two frames with the same image; an image or a result that
        would replace an input, or that exists already.
    """
    part, parts = options.result.shard
    frames = _find_frames(options)
    output = options.result.output
    _check_images(frames, options.images)
    _check_inputs_are_kept(frames, output, options.images)
    frames = frames[part - 1 :: parts]
    if not (options.running.overwrite or options.result.resume):
        _check_nothing_is_there(frames, options.images)
    return Plan(frames, output, options.result.format or _format(output))


def _format(output: str) -> Literal["csv", "jsonl"]:
    return "jsonl" if output.lower().endswith((".jsonl", ".ndjson")) else "csv"


def _find_frames(options: EstimateOptions) -> list[Frame]:
    given, pairs = options.inputs, options.pairs
    named = bool(given.inputs or given.files_from)
    if (pairs.left is None) != (pairs.right is None):
        raise UsageError("--left and --right are given together")
    if pairs.left is not None and named:
        raise UsageError("give either maps, or pairs by --left and --right")
    if pairs.left is None and not named:
        raise UsageError(
            "no input: name maps (files, folders, patterns, or - for a list on stdin) or --left and --right"
        )
    mask = _Masks(options.region)
    if pairs.left is not None and pairs.right is not None:
        found = pair_inputs(
            pairs.left,
            pairs.right,
            match=pairs.match,
            recursive=given.recursive,
            include=given.include,
            exclude=given.exclude,
        )
        return [_frame(pair.left, pair.right, mask) for pair in found]
    maps = find_inputs(
        given.inputs,
        files_from=given.files_from,
        recursive=given.recursive,
        include=given.include,
        exclude=given.exclude,
        skip=[folder for _, folder in options.images.folders()],
    )
    return [_frame(each, None, mask) for each in maps]


def _frame(left: Input, right: Input | None, masks: "_Masks") -> Frame:
    return Frame(
        file=left.name,
        right_file=right.name if right else "",
        path=str(left.path),
        right_path=str(right.path) if right else "",
        relative=left.relative,
        mask=masks.of(left),
    )


class _Masks:
    """One mask for all frames, or one of the same stem each."""

    def __init__(self, options: RegionOptions) -> None:
        self.one, self.by_stem = options.mask, None
        if options.mask is not None and Path(options.mask).is_dir():
            found = find_inputs([options.mask], recursive=True)
            self.by_stem = {Path(each.name).stem: str(each.path) for each in found}
        elif options.mask is not None and not Path(options.mask).is_file():
            raise UsageError(f"{options.mask}: no such mask file or folder")

    def of(self, left: Input) -> str | None:
        """The mask for a frame."""
        if self.by_stem is None:
            return self.one
        try:
            return self.by_stem[left.path.stem]
        except KeyError:
            raise UsageError(f"{left.name}: has no mask of its name in {self.one}") from None


def _check_images(frames: list[Frame], images: ImageOptions) -> None:
    """Every image has one frame; every kind of image has something to be made from."""
    if images.disparity is not None and frames and not frames[0].right_file:
        raise UsageError("--disparity writes maps computed from --left and --right; here maps are the input")
    owner: dict[str, str] = {}
    for frame in frames:
        for _, path in image_paths(frame, images):
            first = owner.setdefault(os.path.normcase(path), frame.file)
            if first is not frame.file:
                raise UsageError(
                    f"{first} and {frame.file} would both write {path}; run them apart, or name their common "
                    "folder with --recursive"
                )


def _check_inputs_are_kept(frames: list[Frame], output: str, images: ImageOptions) -> None:
    writes = {_place(path) for frame in frames for _, path in image_paths(frame, images)}
    if output != STDOUT:
        writes.update(_place(path) for path in (output, str(run_path(output))))
    if not writes:
        return
    for frame in frames:
        for path in frame.reads():
            if _place(path) in writes:
                raise UsageError(f"{path}: would be replaced by an output; write somewhere else")


def _place(path: str) -> str:
    """The same for every spelling of a path."""
    folder, name = os.path.split(path)
    return f"{_real_folder(folder)}/{os.path.normcase(name)}"


@lru_cache(
    maxsize=1024
)  # resolving links costs a system call for each part of a path, and files share folders
def _real_folder(folder: str) -> str:
    return os.path.realpath(folder)


def _check_nothing_is_there(frames: list[Frame], images: ImageOptions) -> None:
    for frame in frames:
        for _, path in image_paths(frame, images):
            if os.path.lexists(path):
                raise UsageError(f"{path}: exists already; give --overwrite to replace it")
