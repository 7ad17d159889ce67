"""The angles of a result against known ones."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rollcli.errors import UsageError
from rollcli.evaluate.pose_accuracy import PoseAccuracy
from rollcli.evaluate.truth import by_stem
from rollcli.files.results import Row

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
