"""How steadily the angle follows what is done to real maps: rotation, rounding, noise.

    python tests/benchmarks/bench_follow.py

The stereo pairs of ../shared/streets and ../shared/roads (these at half size), matched as the command line
does, and every second map of ../shared/realmaps, each rotated by -6, -2, 3 and 8 degrees (nearest pixel),
rounded to whole pixels, and with 30 % and with half of its pixels replaced by uniform noise, three times. To
reach for the pairs: rotations followed within 0.03 degrees (median) and 0.1 (95 %), never off by 1; at most
0.1 away after rounding, and with 30 % of noise. Angles off by more than 0.5 degrees are another surface: a
search for the road that is too short, or that looks at too few pixels, shows there first.
"""

import math
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_image
from rollcli.files.inputs import pair_inputs
from rollcli.stereo.match import StereoOptions, match_pair

SHARED = Path(__file__).resolve().parents[3] / "shared"
TURNS_DEG = (-6, -2, 3, 8)
NOISE_SHARES = (0.3, 0.5)
NOISE_SEEDS = (0, 1, 2)
GROSS_DEG = 0.5


def real_maps() -> dict[str, np.ndarray]:
    """The maps of ../shared/realmaps by their paths, px; 0 is no data."""
    found = sorted(path for path in (SHARED / "realmaps").rglob("*.png") if "sequence" not in path.parts)
    return {str(path.relative_to(SHARED)): read_disparity(path) for path in found[::2]}


def matched_pairs() -> dict[str, np.ndarray]:
    """Disparity maps by the name of their left image, px; 0 is no data."""
    maps = {}
    for name, downscale in (("streets", 1.0), ("roads", 2.0)):
        for left, right in pair_inputs(str(SHARED / name / "left"), str(SHARED / name / "right")):
            views = read_image(left.location), read_image(right.location)
            match = match_pair(*views, StereoOptions(downscale=downscale))
            maps[Path(left.name).stem] = match.disparity
    return maps


def rotated(disparity: np.ndarray, turn_deg: float) -> np.ndarray:
    """The map as a rig sees it that is rolled by so much more; the nearest pixel, 0 outside."""
    height, width = disparity.shape
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -turn_deg, 1)
    return cv2.warpAffine(disparity, turn, (width, height), flags=cv2.INTER_NEAREST, borderValue=0)


def noisy(disparity: np.ndarray, share: float, seed: int) -> np.ndarray:
    """The map with a share of its pixels replaced."""
    chance = np.random.default_rng(seed)
    replaced = chance.random(disparity.shape) < share
    noise = chance.uniform(0, disparity.max(), disparity.shape)
    return np.where(replaced, noise, disparity).astype(np.float32)


def follow(maps: dict[str, np.ndarray]) -> None:
    """Print a line for each map, and one for all."""
    every: dict[str, list[float]] = {}
    taken = Counter[str]()  # gross errors that are ok
    for name, disparity in maps.items():
        start = estimate_roll(disparity).theta

        def off(kind: str, changed: np.ndarray, turn_deg: float = 0.0, start: float = start) -> float:
            estimate = estimate_roll(changed)
            error = abs(math.degrees(estimate.theta - start) - turn_deg)
            taken[kind] += error > GROSS_DEG and estimate.status == "ok"
            return error

        found = {
            "rotated": [off("rotated", rotated(disparity, turn), turn) for turn in TURNS_DEG],
            "rounded": [off("rounded", np.rint(disparity))],
        }
        for share in NOISE_SHARES:
            kind = f"{share:.0%} noise"
            found[kind] = [off(kind, noisy(disparity, share, seed)) for seed in NOISE_SEEDS]
        print(f"{name:22} {math.degrees(start):6.2f}", end="")
        for kind, values in found.items():
            every.setdefault(kind, []).extend(values)
            print(f"  {kind} " + " ".join(f"{value:.2f}" for value in values), end="")
        print()
    for kind, values in every.items():
        median, most, worst = np.median(values), np.percentile(values, 95), max(values)
        gross = sum(value > GROSS_DEG for value in values)
        print(
            f"{kind:9} {len(values):3}  median {median:.3f}  95 % {most:.3f}  worst {worst:.3f}  "
            f"above {GROSS_DEG} degrees: {gross}, {taken[kind]} of them ok"
        )


def main() -> None:
    """Follow the maps of pairs, and the maps that others have matched."""
    if not SHARED.is_dir():
        print(f"left out: {SHARED} is not there")
        return
    follow(matched_pairs())
    follow(real_maps())


if __name__ == "__main__":
    main()
