"""Options without effect on a run, and why: each kind of run says which of the options that it shares.

Import-light: the command line asks before anything heavy is loaded.
"""

import functools
import os
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rollcli.estimator.methods import AREAS
from rollcli.files.existence import is_file, is_folder
from rollcli.files.stores.locations import is_url
from rollcli.frames.options import InputOptions, MethodOptions, PairOptions, RunningOptions
from rollcli.imaging.stereo_options import StereoOptions


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
