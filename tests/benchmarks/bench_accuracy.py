"""How accurate and how honest the angles are on rendered whole frames, matched by SGBM.

    python tests/benchmarks/bench_accuracy.py [FRAMES [SIZE [MODE [CROSS_SECTION]]]]

FRAMES mixed scenes (300) with rolls within +-10 degrees and as many within +-35, of SIZE (640x480) and
matched in MODE (3way), their roads flat or of another CROSS_SECTION, of seeds that no number was fitted to.
To reach on flat roads: median 0.005, 95 % 0.02, worst 0.1 degrees within +-10; 0.006, 0.03, 0.15 within +-35;
on others median 0.02, 95 % 0.1. Coverage of both spans together 0.93 to 0.97, of each kind at least 0.9;
nothing above 0.5 degrees called ok, at most 8 % of the good frames called suspect.
"""

import math
import sys

import numpy as np
from matched import matched

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll

SEEDS = {10: 9401, 35: 9402}
GOOD_DEG = 0.5


def main() -> None:
    """Print a table for each span of rolls."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    width, height = map(int, (sys.argv[2] if len(sys.argv) > 2 else "640x480").split("x"))
    mode = sys.argv[3] if len(sys.argv) > 3 else "3way"
    shape = sys.argv[4] if len(sys.argv) > 4 else "flat"
    for span, seed in SEEDS.items():
        rows, failed = [], 0
        pairs = matched(frames, seed, span, (width, height), mode, cross_section=shape)
        for disparity, roll_deg, scene, _ in pairs:
            try:
                estimate = estimate_roll(disparity)
            except EstimationError:
                failed += 1
                continue
            assert estimate.ci95 is not None
            error = abs(math.degrees(estimate.theta) - roll_deg)
            rows.append((scene, error, error <= math.degrees(estimate.ci95), estimate.status == "ok"))
        scenes, errors, covered, ok = (np.array(column) for column in zip(*rows, strict=True))
        print(
            f"rolls within +-{span}: {frames} frames of {width}x{height}, {mode}, {shape}, "
            f"{failed} without an angle"
        )
        for kind in ("all", *sorted(set(scenes))):
            of = np.ones(len(scenes), bool) if kind == "all" else scenes == kind
            off = errors[of]
            print(
                f"  {kind:7} {of.sum():4}  median {np.median(off):.4f}  95 % {np.percentile(off, 95):.3f}"
                f"  worst {off.max():.3f}  covered {covered[of].mean():.3f}"
            )
        good = errors <= GOOD_DEG
        print(f"  bad frames called ok: {(ok & ~good).sum()}", end="")
        print(f"; good ones called suspect: {(~ok & good).mean():.3f}")


if __name__ == "__main__":
    main()
