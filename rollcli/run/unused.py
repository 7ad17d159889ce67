"""Options that have no effect on a run."""

import functools
import os
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rollcli.estimator.request import AREAS
from rollcli.files.atomic import is_file, is_folder
from rollcli.files.stores.locations import is_url
from rollcli.run.options import (
    DerotateOptions,
    DisparityOptions,
    EstimateOptions,
    HeightsOptions,
    InputOptions,
    MethodOptions,
    PairOptions,
    RunningOptions,
    VDisparityOptions,
)
from rollcli.stereo.options import StereoOptions


class Idle(NamedTuple):
    """Options without effect, by the names of their parameters, and the reason."""

    names: Sequence[str]
    reason: str


def idle_stereo(stereo: StereoOptions) -> Iterator[Idle]:
    """Yield the options of matching that others make idle."""
    if stereo.vertical_offset is not None:
        yield Idle(("align",), "--vertical-offset says how the right image lies")
    if stereo.speckle_size == 0:
        yield Idle(("speckle_range",), "--speckle-size 0 keeps every patch")


def idle_method(method: MethodOptions) -> Iterator[Idle]:
    """Yield the options of the method that it does not use."""
    areas = method.method in AREAS
    if method.method != "gd":
        yield Idle(("lambda0",), "only --method gd has a learning rate")
    if areas:
        yield Idle(("tolerance",), f"--method {method.method} does not iterate on the angle")
    if method.road == "all":
        yield Idle(("seed",), "--road all draws no samples")
        if method.method != "areas":  # which chooses among its planes by their roll
            yield Idle(("max_roll",), "--road all looks for no road")
        if areas:
            yield Idle(("model",), f"--method {method.method} fits planes")


def idle_folders(inputs: InputOptions, pairs: PairOptions) -> Iterator[Idle]:
    """Yield what is about folders and patterns, where none is named; lists and URLs may hold any."""
    named = [*inputs.inputs, *filter(None, (pairs.left, pairs.right))]
    if inputs.files_from is not None or any(name == "-" or is_url(name) for name in named):
        return
    if not any(map(is_folder, named)):
        yield Idle(("recursive",), "no folder is named")
    if all(map(is_file, named)):
        yield Idle(("include", "exclude"), "they choose among the files of folders, and none is named")


def idle_running(running: RunningOptions) -> Iterator[Idle]:
    """Yield the options of workers that are not used."""
    if running.scheduler is not None:
        yield Idle(("jobs",), "--scheduler has workers of its own")


def repeated_inputs(given: InputOptions) -> list[str]:
    """List what is named more than once, however it is spelled."""
    seen: set[str] = set()
    repeated: dict[str, None] = {}
    real = functools.cache(os.path.realpath)  # a shell names thousands of files of one folder
    for name in given.inputs:
        place = name
        if not is_url(name):
            folder, base = os.path.split(name.rstrip("/"))
            place = real(name) if base in ("", ".", "..") else f"{real(folder)}/{base}"
        if place in seen and name != "-":
            repeated[name] = None
        seen.add(place)
    return list(repeated)


_STEREO = (
    "match",
    "num_disparities",
    "min_disparity",
    "block_size",
    "sgbm_mode",
    "uniqueness",
    "speckle_size",
    "speckle_range",
    "downscale",
    "align",
    "vertical_offset",
)


def idle_in_estimate(options: EstimateOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `estimate`."""
    if options.paired:
        yield Idle(("encoding", "scale", "invalid"), "pairs are matched, and no stored disparities are read")
        yield from idle_stereo(options.stereo)
        if not any(kind.holds != "picture" for kind, _ in options.images.folders()):
            yield Idle(("save_as",), "only --disparity, --derotated and --heights write maps")
    else:
        yield Idle(_STEREO, "the inputs are maps, which are not matched")
        if options.images.heights is None:
            yield Idle(("save_as",), "a map keeps the format of its input")
    if options.images.heights_preview is None:
        yield Idle(("heights_range",), "only --heights-preview has colours")
    yield from idle_method(options.method)
    yield from idle_folders(options.inputs, options.pairs)
    yield from idle_running(options.running)
    if options.result.shard == (1, 1):
        yield Idle(("shard_by",), "there is one shard")
    if options.result.form != "parquet" and not is_url(options.result.output):
        yield Idle(("part_rows",), "only Parquet and results in an object store have parts")


def idle_in_disparity(options: DisparityOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `disparity`."""
    yield from idle_stereo(options.stereo)
    yield from idle_folders(options.inputs, options.pairs)
    yield from idle_running(options.running)


def idle_in_derotate(options: DerotateOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `derotate`."""
    if options.encoding.scale is None or options.encoding.scale > 0:
        yield Idle(("scale",), "rotated maps keep their stored numbers")
    if options.encoding.encoding not in ("cityscapes", "foundationstereo"):  # where a stored 1 is no data
        yield Idle(("encoding",), "rotated maps keep their stored numbers")
    yield from idle_folders(options.inputs, PairOptions())
    yield from idle_running(options.running)


def idle_in_heights(options: HeightsOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `heights`."""
    if options.preview is None:
        yield Idle(("heights_range",), "only --preview has colours")
    yield from idle_folders(options.inputs, PairOptions())
    yield from idle_running(options.running)


def idle_in_vdisparity(options: VDisparityOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `vdisparity`."""
    if options.encoding.encoding != "depth":
        yield Idle(("baseline",), "the horizon does not depend on it; only --encoding depth needs it")
        if options.count.figure is not None:
            yield Idle(("calib", "focal", "principal_point", "doffs"), "a figure shows no horizon")
    yield from idle_folders(options.inputs, PairOptions())
    yield from idle_running(options.running)
