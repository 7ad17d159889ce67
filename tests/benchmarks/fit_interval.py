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
from rollcli.estimator import interval
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.selection import take_road

FIT_SEEDS, JUDGE_SEEDS = (81, 82), (83, 84)
COUNTS = (50, 100, 200, 400, 1000, 2000)


def terms(frames: int, seeds: tuple[int, int]) -> tuple[np.ndarray, list[str]]:
    """Rows of (error, bands, columns, white for one pixel, pixels, slant), degrees; and the scenes."""
    rows, scenes = [], []
    for seed, span in zip(seeds, (10, 35), strict=True):
        for disparity, roll_deg, scene in matched(frames // 2, seed, span):
            try:
                theta = estimate_roll(disparity).theta
                surface = take_road(disparity, None, math.radians(45), 0, parabolic=True).surface
            except EstimationError as error:
                print(f"{scene} {roll_deg:.2f}: {error}")
                continue
            assert surface is not None
            bands, columns, white = np.degrees(interval.jackknife(surface, theta).moves())
            pixels = max(1.0, surface.weights.sum() / interval._EFFECTIVE_PIXELS)
            error = abs(math.degrees(theta) - roll_deg)
            weight = surface.weights.sum()
            slant = interval.slant(theta)
            rows.append((error, bands, columns, white / math.sqrt(pixels), weight, slant))
            scenes.append(scene)
    return np.array(rows), scenes


def widths(rows: np.ndarray, count: float) -> np.ndarray:
    """Half-widths before the factor, degrees."""
    _, bands, columns, white, pixels, slant = rows.T
    return slant * np.sqrt(bands**2 + columns**2 + white**2 * np.maximum(1, pixels / count))


def main() -> None:
    """Print one line for each count."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    fit, _ = terms(frames, FIT_SEEDS)
    judge, scenes = terms(frames, JUDGE_SEEDS)
    print(f"{len(fit)} scenes to fit on, {len(judge)} to judge on")
    print(f"in use: kappa {interval._KAPPA} and {interval._EFFECTIVE_PIXELS} pixels")
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
