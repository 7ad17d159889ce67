"""Rendered stereo pairs matched by SGBM: what the benchmarks of accuracy work on."""

import math
import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from rollcli.estimator.request import DEFAULT_REQUEST
from rollcli.run.read import road_finder
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from rollcli.stereo.match import StereoMatch, StereoOptions, match_pair


class Matched(NamedTuple):
    """A disparity map from a rendered pair, its true roll, its kind of scene, and what was rendered."""

    disparity: NDArray[np.float32]
    roll_deg: float
    scene: str
    spec: FrameSpec


def matched(
    frames: int,
    seed: int,
    roll_deg: float,
    size: tuple[int, int] = (640, 480),
    mode: str = "3way",
    **rig: Any,
) -> Iterator[Matched]:
    """Render and match mixed scenes, rolled within +-roll_deg, in parallel; `rig`: of `SimulateOptions`."""
    ranges = {"roll_deg": (-roll_deg, roll_deg), **rig}
    specs = draw_specs(SimulateOptions(frames=frames, size=size, seed=seed, grey=True, **ranges))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), context) as pool:
        yield from pool.map(_matched, specs, [mode] * frames)


def match_as_estimated(
    left: NDArray[Any], right: NDArray[Any], options: StereoOptions | None = None
) -> StereoMatch:
    """Match a pair as `rollcli estimate` does: rows above the road at a part of the size."""
    return match_pair(left, right, options or StereoOptions(), road_finder(None, DEFAULT_REQUEST))


def _matched(spec: FrameSpec, mode: str) -> Matched:
    cv2.setNumThreads(1)
    frame = render_frame(spec)
    match = match_as_estimated(frame.left, frame.right, StereoOptions(mode=mode))
    return Matched(match.disparity, math.degrees(spec.roll), spec.scene, spec)
