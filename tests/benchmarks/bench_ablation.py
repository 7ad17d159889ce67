"""What each tuned number of the estimator does: change one at a time, and look at error and coverage.

    python tests/benchmarks/bench_ablation.py [FRAMES] [--only NAME] [--off] [--together A,B] [--markdown]

Render FRAMES stereo pairs (40 by default), half with rolls within +-10 degrees, half within +-35, and match
each once by SGBM. Make two worse maps of each: noise on two thirds of the pixels, disparities rounded to four
pixels, one pixel in 50 left, an own bonnet, a truck ahead, or a wall over nearly half of the image; and one
without a road: upside down, a depth map, a wall, or patches of sky. Add 20 scenes without a road of each kind
of bench_roadless.py and, where maps with known rolls lie in ../shared/realmaps, every third of them. Then
estimate all maps with each number of `Tuning` times 0.67, times 1.5, and switched off where that means
something; with --off, only switched off, which many frames can then be had for; with --together, some numbers
switched off at once, which shows substitutes.
Every second rendered map is also turned by 5 degrees, nearest pixel: what is "turned" has a known roll, too.

Columns: 95 % and worst error of the rendered maps, degrees; gross errors (above 0.5 degrees, or no angle) of
rendered + degraded + real maps; wrong angles that are called ok, of rendered + degraded + real + roadless;
needless doubts, of rendered + degraded + real maps within 0.25 degrees; coverage of the 95 % interval,
rendered and real, and its median half-width, rendered; maps whose angle moves by 0.02 degrees or whose status
changes, of rendered + degraded + real + roadless. Read differences of one or two as noise.
"""

import argparse
import csv
import math
import os
import pickle
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()

import cv2
import numpy as np
from bench_roadless import KINDS, roadless_map
from matched import matched
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.estimator.tuning import TUNING, Tuning
from rollcli.files.encodings import read_disparity

REAL = Path(__file__).parents[3] / "shared" / "realmaps"
SEEDS = {81: 10, 82: 35}  # seed, and the largest roll, degrees
SCENES, SCENE_SEED = 20, 83  # of each kind without a road
OFF = {
    "sample.uneven_share": 0.0,
    "search.off_slope_weight": 1.0,
    "fit.other_roll": 1e-6,
    "fit.off_level": 1e6,
    "interval.white": 0.0,
    "interval.twist": 0.0,
    "interval.slant": 0.0,
    "doubts.near_minimum": 0.0,
    "doubts.narrowest": 0.0,
    "doubts.filled_by_horizon": -1.0,
    "doubts.most_below": 1e6,
    "doubts.least_beyond": -1.0,
    "doubts.least_farther": -1.0,
    "doubts.rival_share": 1e6,
    "doubts.longest_move": 1e6,
    "doubts.noise_share": 1e6,
}
WORSE = ("noise", "rounded", "sparse", "bonnet", "truck", "wall")
TURN_DEG = 5.0
ROADLESS = ("upside down", "depth", "wall", "sky")
NAN = math.nan
Map = NDArray[np.float32]
_maps: "list[Case]" = []


class Case(NamedTuple):
    """A map, the range of rolls that are right, degrees (NaN: none is), and how it came about."""

    disparity: NDArray[Any]
    low_deg: float
    high_deg: float
    kind: str


class Change(NamedTuple):
    """A number of the tuning, by its path, and another value for it."""

    name: str
    how: str
    value: float


class Outcomes(NamedTuple):
    """Angle, error, half-width (degrees) and whether the angle is called ok, for each map."""

    angle: NDArray[np.float64]
    error: NDArray[np.float64]
    half_width: NDArray[np.float64]
    ok: NDArray[np.bool_]


def numbers(tuning: Tuning) -> Iterator[tuple[str, float]]:
    """Yield the path and the value of every number of a tuning."""
    for group in fields(tuning):
        record = getattr(tuning, group.name)
        for field in fields(record):
            yield f"{group.name}.{field.name}", getattr(record, field.name)


def changed(tuning: Tuning, changes: "tuple[Change, ...]") -> Tuning:
    """Return a tuning with some numbers changed."""
    for change in changes:
        group, name = change.name.split(".")
        tuning = replace(tuning, **{group: replace(getattr(tuning, group), **{name: change.value})})
    return tuning


def changes(only: str, factors: tuple[float, ...]) -> list[Change]:
    """Return every change to try."""
    found = []
    for name, value in numbers(TUNING):
        if only not in name:
            continue
        for factor in factors:
            other = value * factor
            if isinstance(value, int):
                other = max(1, round(other))
            if other != value:
                found.append(Change(name, f"x {factor}", other))
        if name in OFF:
            found.append(Change(name, "off", OFF[name]))
    return found


def degraded(disparity: Map, kind: str, rng: np.random.Generator) -> Map:
    """Return the map made worse in one of `WORSE` ways."""
    height, width = disparity.shape
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    if kind == "noise":
        noise = rng.uniform(0, disparity.max(), disparity.shape).astype(np.float32)
        return np.where(rng.random(disparity.shape) < 0.67, noise, disparity)
    if kind == "rounded":
        return 4 * np.rint(disparity / 4)
    if kind == "sparse":
        return np.where(rng.random(disparity.shape) < 0.02, disparity, 0)
    if kind == "bonnet":
        hidden = rows > height * (0.78 + 0.5 * (columns / width - 0.5) ** 2)
        return np.where(hidden, 1.1 * disparity.max() + 0.05 * (rows - height), disparity)
    if kind == "wall":
        noise = rng.normal(0, 0.3, disparity.shape).astype(np.float32)
        return np.where(columns < 0.45 * width, 40 - 0.08 * columns + 0.01 * rows + noise, disparity)
    truck = disparity.copy()
    foot = disparity[int(0.87 * height), int(0.32 * width) : int(0.7 * width)]
    near = np.median(foot[foot > 0]) if (foot > 0).any() else 0
    truck[height // 8 : int(0.87 * height), int(0.32 * width) : int(0.7 * width)] = near
    return truck


def turned(disparity: Map) -> Map:
    """Return the map as a rig sees it that is rolled by `TURN_DEG` more, 0 outside."""
    height, width = disparity.shape
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -TURN_DEG, 1)
    return np.asarray(cv2.warpAffine(disparity, turn, (width, height), flags=cv2.INTER_NEAREST), np.float32)


def without_road(disparity: Map, kind: str, rng: np.random.Generator) -> Map:
    """Return a map without a road, in one of `ROADLESS` ways."""
    if kind == "upside down":
        return disparity[::-1]
    if kind == "depth":
        return np.divide(300, disparity, out=np.zeros_like(disparity), where=disparity > 0)
    rows, columns = np.mgrid[: disparity.shape[0], : disparity.shape[1]].astype(np.float32)
    noise = rng.normal(0, 0.3, disparity.shape).astype(np.float32)
    if kind == "wall":
        return 30 + rng.uniform(-0.05, 0.05) * columns + rng.uniform(-0.01, 0.01) * rows + noise
    patches = rng.random((disparity.shape[0] // 16 + 1, disparity.shape[1] // 16 + 1))
    patches = patches.repeat(16, 0).repeat(16, 1)[: disparity.shape[0], : disparity.shape[1]]
    return np.where(patches > 0.85, 2 + np.abs(noise), 0).astype(np.float32)


def cases(frames: int, every: int) -> list[Case]:
    """Return rendered, degraded, roadless and, where they are, every third or so of the real maps."""
    found, rng = [], np.random.default_rng(9)
    for seed, span in SEEDS.items():
        for index, frame in enumerate(matched(frames // 2, seed, span)):
            disparity, roll = frame.disparity, frame.roll_deg
            found.append(Case(disparity, roll, roll, "rendered"))
            if index % 2 == 0:
                found.append(Case(turned(disparity), roll + TURN_DEG, roll + TURN_DEG, "degraded"))
            for way in (WORSE[index % 6], WORSE[(index + 1 + index // 6) % 6]):
                found.append(Case(degraded(disparity, way, rng), roll, roll, "degraded"))
            found.append(Case(without_road(disparity, ROADLESS[index % 4], rng), NAN, NAN, "roadless"))
    for number, kind in enumerate(KINDS):
        scenes = (np.random.default_rng([SCENE_SEED, number, index]) for index in range(SCENES))
        found += [
            Case(roadless_map(kind, scene).astype(np.float32), NAN, NAN, "roadless") for scene in scenes
        ]
    if REAL.is_dir():
        with (REAL / "reference.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["lo_deg"] and "sequence" not in row["file"]]
        found += [
            Case(read_disparity(REAL / row["file"]), float(row["lo_deg"]), float(row["hi_deg"]), "real")
            for row in rows[::every]
        ]
    return found


def load(path: str) -> None:
    """Load the maps into a worker."""
    _maps[:] = pickle.loads(Path(path).read_bytes())  # noqa: S301 written by this program


def estimate_all(tuning: Tuning) -> Outcomes:
    """Estimate every map."""
    rows = [estimate_one(case, tuning) for case in _maps]
    return Outcomes(*(np.array(column) for column in zip(*rows, strict=True)))


def estimate_one(case: Case, tuning: Tuning) -> tuple[float, float, float, bool]:
    """Return angle, error and half-width, degrees, and whether the angle is called ok."""
    try:
        with np.errstate(all="ignore"):
            found = estimate_roll(case.disparity, Request(tuning=tuning))
    except (EstimationError, np.linalg.LinAlgError, ValueError, IndexError):
        return NAN, 90.0, 0.0, False  # a number may be changed beyond what the code can bear
    ok = found.status == "ok"
    angle, half_width = math.degrees(found.theta), math.degrees(found.ci95 or 0.0)
    if case.kind == "roadless":
        return angle, 90.0, half_width, ok
    middle, half = (case.low_deg + case.high_deg) / 2, (case.high_deg - case.low_deg) / 2
    off = abs(math.remainder(angle - middle, 180))
    return angle, max(0.0, off - half), half_width, ok


HEADINGS = ("95 %", "worst", "gross", "wrong, ok", "needless", "coverage", "half-width", "moved")


def figures(outcomes: Outcomes, as_it_is: Outcomes, kinds: NDArray[np.str_]) -> tuple[str, ...]:
    """Return one cell for each of `HEADINGS`."""
    roads = [kind for kind in ("rendered", "degraded", "real") if (kinds == kind).any()]
    rendered = kinds == "rendered"
    gross, good = outcomes.error > 0.5, outcomes.error <= 0.25
    held = outcomes.error <= outcomes.half_width
    turned = np.abs(np.remainder(outcomes.angle - as_it_is.angle + 90, 180) - 90)
    moved = ~(turned <= 0.02) & ~(np.isnan(outcomes.angle) & np.isnan(as_it_is.angle))

    def counts(what: NDArray[np.bool_], of: list[str]) -> str:
        return " + ".join(str(np.count_nonzero(what & (kinds == kind))) for kind in of)

    covered = [f"{held[kinds == kind].mean():.2f}" for kind in roads if kind != "degraded"]
    return (
        f"{np.percentile(outcomes.error[rendered], 95):.3f}",
        f"{outcomes.error[rendered].max():.2f}",
        counts(gross, roads),
        counts(gross & outcomes.ok, [*roads, "roadless"]),
        counts(good & ~outcomes.ok, roads),
        " / ".join(covered),
        f"{np.median(outcomes.half_width[rendered]):.3f}",
        counts(moved | (outcomes.ok != as_it_is.ok), [*roads, "roadless"]),
    )


WIDTHS = (28, 9, 7, 6, 6, 11, 14, 11, 12, 10, 14)


def line(cells: tuple[str, ...], markdown: bool) -> str:
    """Return a line of the table."""
    if markdown:
        return "| " + " | ".join(cells) + " |"
    return "  ".join(cell.ljust(width) for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()


def main() -> None:
    """Print one row for each change."""
    parser = argparse.ArgumentParser(description="Change one tuned number of the estimator at a time.")
    parser.add_argument("frames", nargs="?", type=int, default=40)
    parser.add_argument("--only", default="", help="numbers whose path contains this")
    parser.add_argument("--off", action="store_true", help="only switch numbers off, on every real map")
    parser.add_argument("--together", default="", help="numbers to switch off at once, with commas")
    parser.add_argument("--markdown", action="store_true")
    arguments = parser.parse_args()
    found = cases(arguments.frames, 1 if arguments.off else 3)
    kinds = np.array([case.kind for case in found])
    print(", ".join(f"{np.count_nonzero(kinds == kind)} {kind}" for kind in dict.fromkeys(kinds.tolist())))
    values = dict(numbers(TUNING))
    if arguments.together:
        tried = [tuple(Change(name, "off", OFF[name]) for name in arguments.together.split(","))]
    else:
        tried = [(each,) for each in changes(arguments.only, () if arguments.off else (0.67, 1.5))]
    print(line(("number", "value", "changed", *HEADINGS), arguments.markdown))
    if arguments.markdown:
        print("|" + "---|" * len(WIDTHS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "maps")
        path.write_bytes(pickle.dumps(found))
        tunings = [TUNING, *(changed(TUNING, group) for group in tried)]
        with ProcessPoolExecutor(os.cpu_count(), get_context("spawn"), load, (str(path),)) as pool:
            names = [("as it is", "", "")]
            names += [
                (" ".join(each.name for each in group), f"{values[group[0].name]:.4g}", group[0].how)
                for group in tried
            ]
            as_it_is = None
            for name, outcomes in zip(names, pool.map(estimate_all, tunings), strict=True):
                as_it_is = as_it_is or outcomes
                print(line((*name, *figures(outcomes, as_it_is, kinds)), arguments.markdown), flush=True)


if __name__ == "__main__":
    main()
