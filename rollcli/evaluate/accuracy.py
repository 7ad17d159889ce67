"""The angles, poses and heights over the road of a result against known ones."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, UsageError
from rollcli.evaluate.truth import KnownPose, by_stem
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_stored
from rollcli.files.inputs import find_inputs
from rollcli.files.matching import stem_of
from rollcli.files.results import Row
from rollcli.files.search import Search

LARGE_ERROR_DEG = 0.5
DISTANCES_M = (5, 10, 20)
_WITHIN = 0.2  # of a distance
_MOST = 50_000  # pixels of a frame at a distance: more would not change the figures


@dataclass(frozen=True)
class Accuracy:
    """How far one quantity of a result is from known values: roll and pitch, degrees, or height, metres.

    Attributes
    ----------
    count : int
        Frames compared: they have a value, and a known one.
    median, p95, worst : float or None
        Of abs(error); None where nothing was compared.
    worst_file : str
        The frame of the worst.
    bias : float or None
        The mean error: of roll, a rig that is mounted askew shows here.
    share_above_0_5_deg : float or None
        Of the frames compared, from 0 to 1.
    coverage_95 : float or None
        Share of the known values inside their 95 % interval, among the frames that have one.
    intervals : int
        How many have one.
    """

    count: int = 0
    median: float | None = None
    p95: float | None = None
    worst: float | None = None
    worst_file: str = ""
    bias: float | None = None
    share_above_0_5_deg: float | None = None
    coverage_95: float | None = None
    intervals: int = 0


@dataclass(frozen=True)
class HeightsAt:
    """How far heights are from true ones at a distance, metres.

    Attributes
    ----------
    distance : int
        Of the pixels compared along the optical axis, give or take a fifth.
    frames : int
        How many have such pixels.
    median, p95 : float
        Of abs(error).
    bias : float
        The mean error.
    """

    distance: int
    frames: int
    median: float
    p95: float
    bias: float


@dataclass(frozen=True)
class Comparison:
    """A result against known values.

    Attributes
    ----------
    roll : Accuracy
    ok, suspect : int
        The frames compared, by status.
    no_angle : tuple of str
        Frames of the truth for which the result has no angle, as an error row or not at all.
    no_truth : tuple of str
        Rows of the result whose angle is not known.
    pitch, height : Accuracy or None
        None where the truth or the result has none.
    heights : tuple of HeightsAt
        Of the heights over the road at some distances; empty where the truth or the run has none.
    """

    roll: Accuracy
    ok: int
    suspect: int
    no_angle: tuple[str, ...]
    no_truth: tuple[str, ...]
    pitch: Accuracy | None = None
    height: Accuracy | None = None
    heights: tuple[HeightsAt, ...] = ()


def assess(
    rows: Sequence[Row], truth: Mapping[str, KnownPose], result_name: str = "the result"
) -> Comparison:
    """Compare a result with known angles, pitches and heights, matched by stem.

    Parameters
    ----------
    rows : sequence of Row
        The rows of a result.
    truth : mapping of str to KnownPose
        By stem; see `read_truth`.
    result_name : str
        What errors call the result.

    Returns
    -------
    Comparison
        Without heights over the road: see `assess_heights`.

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
    angled = [(row, pose) for row, pose in known if row.roll_deg is not None]
    pitch = _accuracy([(row, row.pitch_deg, pose.pitch_deg, row.pitch_ci95_deg) for row, pose in known])
    height = _accuracy([(row, row.height_m, pose.height_m, row.height_ci95_m) for row, pose in known])
    return Comparison(
        roll=_accuracy(
            [(row, row.roll_deg, math.degrees(pose.theta), row.roll_ci95_deg) for row, pose in angled],
            period=180,
        ),
        ok=sum(row.status == "ok" for row, _ in angled),
        suspect=sum(row.status == "suspect" for row, _ in angled),
        no_angle=tuple(s for s in truth if s not in places or rows[places[s]].roll_deg is None),
        no_truth=tuple(rows[place].file for stem, place in places.items() if stem not in truth),
        pitch=pitch if pitch.count else None,
        height=height if height.count else None,
    )


def _accuracy(
    compared: Sequence[tuple[Row, float | None, float | None, float | None]], period: float = math.inf
) -> Accuracy:
    """Sum up rows, each with its value, the known one and the half-width of its interval."""
    found = [
        (row.file, math.remainder(value - known, period), half_width)  # angles half a turn apart are the same
        for row, value, known, half_width in compared
        if value is not None and known is not None
    ]
    if not found:
        return Accuracy()
    errors = np.array([error for _, error, _ in found])
    sizes = np.abs(errors)
    worst = int(sizes.argmax())
    inside = [abs(error) <= half_width for _, error, half_width in found if half_width is not None]
    return Accuracy(
        count=len(found),
        median=float(np.median(sizes)),
        p95=float(np.percentile(sizes, 95)),
        worst=float(sizes[worst]),
        worst_file=found[worst][0],
        bias=float(errors.mean()),
        share_above_0_5_deg=float(np.mean(sizes > LARGE_ERROR_DEG)),
        coverage_95=float(np.mean(inside)) if inside else None,
        intervals=len(inside),
    )


def assess_heights(
    rows: Sequence[Row], known: Mapping[str, KnownPose], heights: str, truth: str
) -> tuple[HeightsAt, ...] | None:
    """Compare the heights over the road with true ones at `DISTANCES_M`, matched by stem.

    Parameters
    ----------
    rows : sequence of Row
    known : mapping of str to KnownPose
        By stem.
    heights : str
        The folder that `estimate --heights` wrote.
    truth : str
        The folder with `heights/` and `disparity/`, as `simulate` writes it.

    Returns
    -------
    tuple of HeightsAt, or None
        A distance that no frame shows is left out. None where no frame has heights in metres and true ones.

    Raises
    ------
    UsageError
        A folder does not exist or holds no map.
    InputError
        A map cannot be read, or two of a frame differ in size.
    """
    folders = [_maps_of(folder) for folder in (heights, f"{truth}/heights", f"{truth}/disparity")]
    errors: dict[int, list[NDArray[np.float64]]] = {distance: [] for distance in DISTANCES_M}
    compared = False
    for row in rows:
        stem = stem_of(row.file)
        rig = known.get(stem)
        if row.height_m is None or rig is None or rig.focal_baseline is None:
            continue
        if all(stem in folder for folder in folders):
            compared = True
            estimated, true, disparity = (folder[stem] for folder in folders)
            for distance, found in _height_errors(estimated, true, disparity, rig.focal_baseline):
                errors[distance].append(found)
    if not compared:
        return None
    return tuple(_heights_at(distance, parts) for distance, parts in errors.items() if parts)


def _heights_at(distance: int, parts: Sequence[NDArray[np.float64]]) -> HeightsAt:
    off = np.concatenate(parts)
    median, p95 = np.percentile(np.abs(off), (50, 95)).tolist()
    return HeightsAt(distance, len(parts), median, p95, float(off.mean()))


def _height_errors(
    estimated: str, true: str, disparities: str, scale: float
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield the errors of a frame at each distance; `scale` is its focal length times its baseline, px m."""
    heights, truth = (read_stored(path).values.astype(np.float64) for path in (estimated, true))
    disparity = read_disparity(disparities)
    if not heights.shape == truth.shape == disparity.shape:
        shapes = (heights.shape, truth.shape, disparity.shape)
        sizes = ", ".join(f"{width}x{height}" for height, width in shapes)
        raise InputError(f"{estimated}: heights, true heights and true disparity differ in size: {sizes}")
    off = heights - truth
    with np.errstate(divide="ignore"):
        ahead = scale / disparity
    for distance in DISTANCES_M:
        found = off[np.isfinite(off) & (np.abs(ahead / distance - 1) < _WITHIN)]
        if len(found):
            yield distance, found[:: -(-len(found) // _MOST)]


def _maps_of(folder: str) -> dict[str, str]:
    return {stem_of(each.name): each.location for each in find_inputs([folder], Search(recursive=True))}
