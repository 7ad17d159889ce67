"""Fit the factor of the interval on rendered scenes, and judge it on others.

    python tests/benchmarks/fit_interval.py [FRAMES]

Prints, for several counts of independent pixels, the factor kappa with which 95 % of the intervals hold the
true roll on the first half of the scenes, and the coverage it gives on the second half, by kind of scene.
Half of the frames have rolls within +-10, half within +-35 degrees.
"""

import math
import sys

import numpy as np
from matched import matched

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import jackknife, slant
from rollcli.estimator.methods import DEFAULT_SOLVER, MAX_ROLL_DEG
from rollcli.estimator.request import Request
from rollcli.estimator.selection import select_pixels
from rollcli.estimator.tuning import TUNING
from rollcli.estimator.validity import CheckedMap

FIT_SEEDS, JUDGE_SEEDS = (81, 82), (83, 84)
REQUEST = Request("gd", "parabola", "auto", DEFAULT_SOLVER, math.radians(MAX_ROLL_DEG), 0, TUNING)
COUNTS = (50, 100, 200, 400, 1000, 2000)


def terms(frames: int, seeds: tuple[int, int]) -> tuple[np.ndarray, list[str]]:
    """Rows of (error, bands, columns, white for one pixel, pixels, slant), degrees; and the scenes."""
    rows, scenes = [], []
    for seed, span in zip(seeds, (10, 35), strict=True):
        for disparity, roll_deg, scene in matched(frames // 2, seed, span):
            try:
                theta = estimate_roll(disparity).theta
                surface = select_pixels(CheckedMap.of(disparity, None), REQUEST).surface
            except EstimationError as error:
                print(f"{scene} {roll_deg:.2f}: {error}")
                continue
            assert surface is not None
            bands, columns, white = np.degrees(jackknife(surface, theta, TUNING.interval).spreads())
            pixels = max(1.0, surface.weights.sum() / TUNING.interval.independent_pixels)
            error = abs(math.degrees(theta) - roll_deg)
            weight = surface.weights.sum()
            wider = slant(theta, TUNING.interval)
            rows.append((error, bands, columns, white / math.sqrt(pixels), weight, wider))
            scenes.append(scene)
    return np.array(rows), scenes


def widths(rows: np.ndarray, count: float) -> np.ndarray:
    """Half-widths before the factor, degrees."""
    _, bands, columns, white, pixels, wider = rows.T
    return wider * np.sqrt(bands**2 + columns**2 + white**2 * np.maximum(1, pixels / count))


def main() -> None:
    """Print one line for each count."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    fit, _ = terms(frames, FIT_SEEDS)
    judge, scenes = terms(frames, JUDGE_SEEDS)
    print(f"{len(fit)} scenes to fit on, {len(judge)} to judge on")
    print(f"in use: kappa {TUNING.interval.factor} and {TUNING.interval.independent_pixels} pixels")
    for count in COUNTS:
        kappa = float(np.percentile(fit[:, 0] / widths(fit, count), 95))
        half = kappa * widths(judge, count)
        held = judge[:, 0] <= half
        by_scene = {kind: held[[scene == kind for scene in scenes]].mean() for kind in sorted(set(scenes))}
        kinds = "  ".join(f"{kind} {share:.2f}" for kind, share in by_scene.items())
        print(f"{count:5d} pixels: kappa {kappa:.2f}, coverage {held.mean():.3f}", end="")
        print(f", median half-width {np.median(half):.4f}; {kinds}")


if __name__ == "__main__":
    main()
