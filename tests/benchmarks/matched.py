"""Rendered stereo pairs matched by SGBM: what the benchmarks of accuracy work on."""

import math
import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from rollcli.imaging.stereo import StereoOptions, match_pair
from rollcli.simulate.draw import draw_specs
from rollcli.simulate.render import render_frame
from rollcli.simulate.spec import FrameSpec


class Matched(NamedTuple):
    """A disparity map from a rendered pair, its true roll and its kind of scene."""

    disparity: NDArray[np.float32]
    roll_deg: float
    scene: str


def matched(
    frames: int, seed: int, roll_deg: float, size: tuple[int, int] = (640, 480), mode: str = "3way"
) -> Iterator[Matched]:
    """Render and match mixed scenes with rolls within +-roll_deg, on all processors."""
    span = math.radians(roll_deg)
    specs = draw_specs(frames, roll=(-span, span), size=size, seed=seed, colour=False)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), context) as pool:
        yield from pool.map(_matched, specs, [mode] * frames)


def _matched(spec: FrameSpec, mode: str) -> Matched:
    cv2.setNumThreads(1)
    frame = render_frame(spec)
    match = match_pair(frame.left, frame.right, StereoOptions(mode=mode))
    return Matched(match.disparity, math.degrees(spec.roll), spec.scene)
