"""The pitch and the height of a result against known ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rollcli.evaluate.truth import KnownPose
from rollcli.files.matching import stem_of
from rollcli.files.results import Row


@dataclass(frozen=True)
class PoseAccuracy:
    """How far one quantity of a result is from known values, in its unit.

    Attributes
    ----------
    count : int
        Frames compared: they have a value, and a known one.
    median, p95, worst : float
        Of abs(error).
    bias : float
        The mean error.
    coverage_95 : float or None
        Share of the known values inside their 95 % interval; None where there is no interval.
    """

    count: int
    median: float
    p95: float
    worst: float
    bias: float
    coverage_95: float | None


def assess_pitch(rows: Sequence[Row], truth: Mapping[str, KnownPose]) -> PoseAccuracy | None:
    """Compare the pitch, degrees; None where nothing is known or measured."""
    known = ((row, truth.get(stem_of(row.file))) for row in rows)
    return _of(
        [
            (row.pitch_deg - pose.pitch_deg, row.pitch_ci95_deg)
            for row, pose in known
            if pose is not None and pose.pitch_deg is not None and row.pitch_deg is not None
        ]
    )


def assess_height(rows: Sequence[Row], truth: Mapping[str, KnownPose]) -> PoseAccuracy | None:
    """Compare the height, metres; None where nothing is known or measured."""
    known = ((row, truth.get(stem_of(row.file))) for row in rows)
    return _of(
        [
            (row.height_m - pose.height_m, row.height_ci95_m)
            for row, pose in known
            if pose is not None and pose.height_m is not None and row.height_m is not None
        ]
    )


def _of(found: Sequence[tuple[float, float | None]]) -> PoseAccuracy | None:
    if not found:
        return None
    errors = np.array([error for error, _ in found])
    sizes = np.abs(errors)
    inside = [abs(error) <= half_width for error, half_width in found if half_width is not None]
    return PoseAccuracy(
        count=len(found),
        median=float(np.median(sizes)),
        p95=float(np.percentile(sizes, 95)),
        worst=float(sizes.max()),
        bias=float(errors.mean()),
        coverage_95=float(np.mean(inside)) if inside else None,
    )
