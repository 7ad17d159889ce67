"""Heights over the road against true ones, pixel by pixel, at some distances."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.evaluate.truth import KnownPose
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_stored
from rollcli.files.inputs import find_inputs
from rollcli.files.matching import stem_of
from rollcli.files.results import Row

DISTANCES_M = (5, 10, 20)
_WITHIN = 0.2  # of a distance
_MOST = 50_000  # pixels of a frame at a distance: more would not change the figures


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
class HeightFiles:
    """The maps of a frame: heights, true heights and true disparity; and its focal length times baseline."""

    heights: str
    truth: str
    disparity: str
    scale: float


def height_files(
    rows: Sequence[Row], known: Mapping[str, KnownPose], heights: str, truth: str
) -> list[HeightFiles]:
    """Find the maps of the frames that have heights in metres and true ones, by stem.

    Parameters
    ----------
    rows : sequence of Row
    known : mapping of str to KnownPose
        By stem.
    heights : str
        The folder that `estimate --heights` wrote.
    truth : str
        The folder with `heights/` and `disparity/`, as `simulate` writes it.

    Raises
    ------
    UsageError
        A folder does not exist or holds no map.
    """
    folders = [_by_stem(folder) for folder in (heights, f"{truth}/heights", f"{truth}/disparity")]
    found = []
    for row in rows:
        stem = stem_of(row.file)
        rig = known.get(stem)
        if row.height_m is None or rig is None or rig.focal_baseline is None:
            continue
        if all(stem in folder for folder in folders):
            estimated, true, disparity = (folder[stem] for folder in folders)
            found.append(HeightFiles(estimated, true, disparity, rig.focal_baseline))
    return found


def assess_heights(files: Sequence[HeightFiles]) -> tuple[HeightsAt, ...]:
    """Compare heights with true ones at `DISTANCES_M`; a distance that no frame shows is left out.

    Raises
    ------
    InputError
        A map cannot be read, or two of a frame differ in size.
    """
    errors: dict[int, list[NDArray[np.float64]]] = {distance: [] for distance in DISTANCES_M}
    for each in files:
        for distance, found in _errors(each):
            errors[distance].append(found)
    return tuple(_at(distance, parts) for distance, parts in errors.items() if parts)


def _at(distance: int, parts: Sequence[NDArray[np.float64]]) -> HeightsAt:
    off = np.concatenate(parts)
    median, p95 = np.percentile(np.abs(off), (50, 95)).tolist()
    return HeightsAt(distance, len(parts), median, p95, float(off.mean()))


def _errors(files: HeightFiles) -> Iterator[tuple[int, NDArray[np.float64]]]:
    heights, truth = (read_stored(path).values.astype(np.float64) for path in (files.heights, files.truth))
    disparity = read_disparity(files.disparity)
    if not heights.shape == truth.shape == disparity.shape:
        shapes = (heights.shape, truth.shape, disparity.shape)
        sizes = ", ".join(f"{width}x{height}" for height, width in shapes)
        raise InputError(f"{files.heights}: heights, true heights and true disparity differ in size: {sizes}")
    off = heights - truth
    with np.errstate(divide="ignore"):
        ahead = files.scale / disparity
    for distance in DISTANCES_M:
        found = off[np.isfinite(off) & (np.abs(ahead / distance - 1) < _WITHIN)]
        if len(found):
            yield distance, found[:: -(-len(found) // _MOST)]


def _by_stem(folder: str) -> dict[str, str]:
    return {stem_of(each.name): each.location for each in find_inputs([folder], recursive=True)}
