"""The experiments on one map file, where the work is done: in a worker."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.evaluate.experiments import Findings, examine
from rollcli.evaluate.options import PaperOptions
from rollcli.files.matching import stem_of
from rollcli.files.results import Row
from rollcli.run.frame import Frame, FrameResult, failed_frame
from rollcli.run.read import FRAME_ERRORS, Source, frame_of_error, read_source


@dataclass(frozen=True)
class Examined:
    """What became of a map: findings, or a result that says why there are none."""

    result: FrameResult
    findings: Findings | None


def examine_file(frame: Frame, options: PaperOptions, truth: Mapping[str, float]) -> Examined:
    """Read a map and run the experiments on it; `truth` holds known angles by stem, or nothing."""
    turns = [math.radians(turn) for turn in options.experiments.turns_deg]
    try:
        source = read_source(frame, options.frame)
        known = truth.get(stem_of(frame.file))
        findings = examine(frame.file, usable_pixels(source), turns, known, chosen=options.has_region)
    except FRAME_ERRORS as error:
        return Examined(frame_of_error(frame, error), None)
    return Examined(FrameResult(Row(frame.file, status="ok"), source.encoding, source.warnings), findings)


def usable_pixels(source: Source) -> NDArray[Any]:
    """Clear the pixels of a map, shape (H, W), that may not be used: 0 is no data."""
    if source.allowed is None:
        return source.disparity
    return np.where(source.allowed, source.disparity, 0)


def lost(frame: Frame, reason: str) -> Examined:
    """Return what is known of a map that could not be examined."""
    return Examined(failed_frame(frame, reason), None)
