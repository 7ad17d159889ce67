"""The angles and poses of a result against known ones."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rollcli.errors import UsageError
from rollcli.evaluate.map_accuracy import HeightsAt
from rollcli.evaluate.truth import KnownPose, by_stem
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


LARGE_ERROR_DEG = 0.5


@dataclass(frozen=True)
class Accuracy:
    """How far the angles of a result are from known ones.

    Attributes
    ----------
    count : int
        Frames compared: they have an angle, and a known one.
    median_deg, p95_deg, worst_deg : float or None
        Of abs(error), degrees; None where nothing was compared.
    worst_file : str
        The frame of the worst.
    bias_deg : float or None
        The mean error, degrees: a rig that is mounted askew shows here.
    share_above_0_5_deg : float or None
        Of the frames compared, from 0 to 1.
    coverage_95 : float or None
        Share of the known angles inside their 95 % interval, among the frames that have one.
    intervals : int
        How many have one.
    ok, suspect : int
        The frames compared, by status.
    no_angle : tuple of str
        Frames of the truth for which the result has no angle, as an error row or not at all.
    no_truth : tuple of str
        Rows of the result whose angle is not known.
    pitch, height : PoseAccuracy or None
        Of pitch, degrees, and height, metres; None where the truth or the result has none.
    heights : tuple of HeightsAt
        Of the heights over the road at some distances; empty where the truth or the run has none.
    """

    count: int
    median_deg: float | None
    p95_deg: float | None
    worst_deg: float | None
    worst_file: str
    bias_deg: float | None
    share_above_0_5_deg: float | None
    coverage_95: float | None
    intervals: int
    ok: int
    suspect: int
    no_angle: tuple[str, ...]
    no_truth: tuple[str, ...]
    pitch: PoseAccuracy | None = None
    height: PoseAccuracy | None = None
    heights: tuple[HeightsAt, ...] = ()


def assess(rows: Sequence[Row], truth: Mapping[str, float], result_name: str = "the result") -> Accuracy:
    """Compare a result with known angles, matched by stem.

    Parameters
    ----------
    rows : sequence of Row
        The rows of a result.
    truth : mapping of str to float
        Radians, by stem; see `read_truth`.
    result_name : str
        What errors call the result.

    Returns
    -------
    Accuracy

    Raises
    ------
    UsageError
        No row matches a known angle, or two rows have the same stem.
    """
    places = by_stem((row.file for row in rows), result_name)
    if not places.keys() & truth.keys():
        example = f": it holds {rows[0].file}, the truth {next(iter(truth))}" if rows else ": it is empty"
        raise UsageError(f"{result_name}: no row has the stem of a frame of the truth{example}")
    known = [(rows[place], truth[stem]) for stem, place in places.items() if stem in truth]
    found = [(row, _error_deg(row.roll_deg, angle)) for row, angle in known if row.roll_deg is not None]
    return _summary(
        found,
        no_angle=tuple(s for s in truth if s not in places or rows[places[s]].roll_deg is None),
        no_truth=tuple(
            row.file for stem, place in places.items() if stem not in truth for row in [rows[place]]
        ),
    )


def _error_deg(roll_deg: float, truth: float) -> float:
    """Return estimate minus truth, degrees, in [-90, 90]: angles 180 degrees apart are the same."""
    return math.remainder(roll_deg - math.degrees(truth), 180)


def _summary(
    found: Sequence[tuple[Row, float]], no_angle: tuple[str, ...], no_truth: tuple[str, ...]
) -> Accuracy:
    errors = np.array([error for _, error in found])
    sizes = np.abs(errors)
    inside = [abs(error) <= row.roll_ci95_deg for row, error in found if row.roll_ci95_deg is not None]
    worst = int(sizes.argmax()) if len(sizes) else 0
    return Accuracy(
        count=len(found),
        median_deg=float(np.median(sizes)) if len(sizes) else None,
        p95_deg=float(np.percentile(sizes, 95)) if len(sizes) else None,
        worst_deg=float(sizes[worst]) if len(sizes) else None,
        worst_file=found[worst][0].file if found else "",
        bias_deg=float(errors.mean()) if len(errors) else None,
        share_above_0_5_deg=float(np.mean(sizes > LARGE_ERROR_DEG)) if len(sizes) else None,
        coverage_95=float(np.mean(inside)) if inside else None,
        intervals=len(inside),
        ok=sum(row.status == "ok" for row, _ in found),
        suspect=sum(row.status == "suspect" for row, _ in found),
        no_angle=no_angle,
        no_truth=no_truth,
    )
