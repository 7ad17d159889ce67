"""Fit the factor of the interval on rendered scenes, and judge it on others.

    python tests/benchmarks/fit_interval.py [FRAMES]

Prints the factor of the noise with which 95 % of the intervals hold the true roll on the first half of the
scenes, and the coverage that it and the factor in use give on the second half, by kind of scene. Half of the
frames have rolls within +-10, half within +-35 degrees; half of the roads are flat, the others have all cross
sections.
"""

import itertools
import math
import sys

import numpy as np
from matched import matched

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import jackknife, noise_of
from rollcli.estimator.moments import CheckedMap
from rollcli.estimator.request import DEFAULT_SOLVER, MAX_INTERVAL_DEG, MAX_ROLL_DEG, Request
from rollcli.estimator.road.pixels import select_pixels
from rollcli.estimator.tuning import TUNING

FIT_SEEDS, JUDGE_SEEDS = (81, 82), (83, 84)
REQUEST = Request(
    "gd",
    "parabola",
    "auto",
    DEFAULT_SOLVER,
    max_roll=math.radians(MAX_ROLL_DEG),
    max_interval=math.radians(MAX_INTERVAL_DEG),
    slope_error=0.0,
    seed=0,
    tuning=TUNING,
)


def terms(frames: int, seeds: tuple[int, int]) -> tuple[np.ndarray, list[str]]:
    """Rows of (error, noise before the factor, choice of surface), degrees; and the kinds of scene."""
    tuning, rows, kinds = TUNING.interval, [], []
    for (seed, span), section in itertools.product(zip(seeds, (10, 35), strict=True), ("flat", "mixed")):
        for disparity, roll_deg, scene, _ in matched(frames // 4, seed, span, cross_section=section):
            try:
                theta = estimate_roll(disparity).theta
                surface = select_pixels(CheckedMap.of(disparity, None), REQUEST).surface
            except EstimationError as error:
                print(f"{scene} {roll_deg:.2f}: {error}")
                continue
            assert surface is not None
            knife = jackknife(surface, theta, tuning)
            noise = noise_of(knife, theta, tuning)
            choice = math.hypot(
                tuning.lateral * knife.lateral, tuning.depth * knife.depth, tuning.bend * knife.bend
            )
            error = abs(math.degrees(theta) - roll_deg)
            rows.append((error, math.degrees(noise), math.degrees(choice)))
            kinds.append(f"{scene} {section}")
    return np.array(rows), kinds


def main() -> None:
    """Print the factor found, and the coverage of that and of the one in use."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    error, noise, choice = terms(frames, FIT_SEEDS)[0].T
    found = float(np.percentile(np.sqrt(np.maximum(0, error**2 - choice**2)) / noise, 95))
    judged, kinds = terms(frames, JUDGE_SEEDS)
    error, noise, choice = judged.T
    print(f"{frames} scenes to fit on, {len(judged)} to judge on")
    for name, factor in (("found", found), ("in use", TUNING.interval.factor)):
        half = np.hypot(factor * noise, choice)
        held = error <= half
        by_kind = {kind: held[[each == kind for each in kinds]].mean() for kind in sorted(set(kinds))}
        shares = "  ".join(f"{kind} {share:.2f}" for kind, share in by_kind.items())
        print(f"{name:6}: factor {factor:.2f}, coverage {held.mean():.3f}", end="")
        print(f", median half-width {np.median(half):.4f}; {shares}")


if __name__ == "__main__":
    main()
