"""The experiments on one map file, where the work is done: in a worker."""

from __future__ import annotations

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
from rollcli.frames.frame import Frame, Outcome, failed
from rollcli.frames.guard import FAULTS
from rollcli.frames.read import Source, read_source
from rollcli.frames.region import region_mask


@dataclass(frozen=True)
class Examined:
    """What became of a map: findings, or an outcome that says why there are none."""

    outcome: Outcome
    findings: Findings | None


def examine_file(frame: Frame, options: PaperOptions, truth: Mapping[str, float]) -> Examined:
    """Read a map and run the experiments on it; `truth` holds known angles by stem, or nothing."""
    turns = [math.radians(turn) for turn in options.experiments.turns_deg]
    try:
        source, disparity = read_pixels(frame, options)
        known = truth.get(stem_of(frame.file))
        findings = examine(frame.file, disparity, turns, known, chosen=options.has_region)
    except FAULTS as error:
        return lost(frame, str(error) or type(error).__name__)
    return Examined(Outcome(Row(frame.file, status="ok"), source.encoding, source.warning), findings)


def read_pixels(frame: Frame, options: PaperOptions) -> tuple[Source, NDArray[Any]]:
    """Read a map, and its pixels (H, W) that may be used; 0 is no data."""
    source = read_source(frame, options.frame)
    allowed = region_mask(frame.mask, options.frame, source.disparity.shape)
    return source, source.disparity if allowed is None else np.where(allowed, source.disparity, 0)


def lost(frame: Frame, reason: str) -> Examined:
    """What is known of a map that could not be examined."""
    return Examined(failed(frame, reason), None)
