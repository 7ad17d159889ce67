"""Fit the factors of the interval on rendered scenes, and judge them on others.

    python tests/benchmarks/fit_interval.py [FRAMES]

FRAMES smooth scenes (400; 32 at least) and half as many rough ones to fit on, and as many to judge on.

Prints the factor of the noise with which 95 % of the intervals hold the true roll on the first half of the
smooth scenes, then the factor of the unevenness with which they hold the roll of the lane on rough ones; and
the coverage that these and the factors in use give on the second half, by kind of scene. Half of the frames
have rolls within +-10, half within +-35 degrees; half of the roads are flat, the others have all cross
sections. Rough roads are of the classes A to D; their lane has a range of rolls, as a lidar's
(`lane_rolls_of`).
"""

import itertools
import math
import sys

import numpy as np
from matched import matched

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import jackknife
from rollcli.estimator.moments import CheckedMap
from rollcli.estimator.request import DEFAULT_REQUEST
from rollcli.estimator.road.pixels import select_pixels
from rollcli.estimator.tuning import TUNING
from rollcli.simulate.dataset import lane_rolls_of

FIT_SEEDS, JUDGE_SEEDS = (81, 82), (83, 84)


def terms(frames: int, seeds: tuple[int, int], roughness: str | None) -> tuple[np.ndarray, list[str]]:
    """Rows of (error, noise, unevenness, camber), before the factors, degrees; and the kinds of scene."""
    tuning, rows, kinds = TUNING.interval, [], []
    for (seed, span), section in itertools.product(zip(seeds, (10, 35), strict=True), ("flat", "mixed")):
        for disparity, _, scene, spec in matched(
            frames // 4, seed, span, cross_section=section, roughness=roughness
        ):
            try:
                theta = estimate_roll(disparity).theta
                surface = select_pixels(CheckedMap.of(disparity, None), DEFAULT_REQUEST).surface
            except EstimationError as error:
                print(f"{scene} {math.degrees(spec.roll):.2f}: {error}")
                continue
            assert surface is not None
            knife = jackknife(surface, theta, tuning)
            low, high = lane_rolls_of(spec) if roughness else (spec.roll, spec.roll)
            error = max(0.0, low - theta, theta - high)
            rows.append((error, knife.noise(theta, tuning), knife.uneven, tuning.bend * knife.bend))
            kinds.append(f"class {roughness}" if roughness else f"{scene} {section}")
    return np.degrees(rows), kinds


def fitted(error: np.ndarray, part: np.ndarray, others: np.ndarray) -> float:
    """The factor of a part with which 95 % of the intervals hold, the others being as they are."""
    left = np.sqrt(np.maximum(0, error**2 - others**2))
    return float(np.percentile(left / np.maximum(part, 1e-9), 95))


def all_terms(frames: int, seeds: tuple[int, int]) -> tuple[np.ndarray, list[str]]:
    """Those of smooth roads, and of half as many rough ones."""
    found = [terms(frames, seeds, None), *(terms(frames // 8, seeds, each) for each in "ABCD")]
    return np.concatenate([rows for rows, _ in found]), [kind for _, kinds in found for kind in kinds]


def main() -> None:
    """Print the factors found, and the coverage of those and of the ones in use."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    used = TUNING.interval.factor, TUNING.interval.uneven
    rows, kinds = all_terms(frames, FIT_SEEDS)
    rough = np.array([kind.startswith("class") for kind in kinds])
    error, noise, uneven, bend = rows[~rough].T
    factor = fitted(error, noise, np.hypot(used[1] * uneven, bend))
    error, noise, uneven, bend = rows[rough].T
    found = factor, fitted(error, uneven, np.hypot(used[0] * noise, bend))
    judged, kinds = all_terms(frames, JUDGE_SEEDS)
    error, noise, uneven, bend = judged.T
    print(f"{len(rows)} scenes to fit on, {len(judged)} to judge on")
    for name, (factor, times) in (("found", found), ("in use", used)):
        half = np.sqrt((factor * noise) ** 2 + (times * uneven) ** 2 + bend**2)
        held = error <= half
        by_kind = {kind: held[[each == kind for each in kinds]].mean() for kind in sorted(set(kinds))}
        shares = "  ".join(f"{kind} {share:.2f}" for kind, share in by_kind.items())
        print(f"{name:6}: factor {factor:.2f}, uneven {times:.1f}, coverage {held.mean():.3f}", end="")
        print(f", median half-width {np.median(half):.4f}; {shares}")


if __name__ == "__main__":
    main()
