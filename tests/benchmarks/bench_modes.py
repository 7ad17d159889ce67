"""What each mode and downscale of the matcher costs, and what the angles are then.

    python tests/benchmarks/bench_modes.py [PAIRS]

PAIRS rendered pairs (60) of 640x480 with rolls within +-10 degrees and half as many within +-35: CPU time of
matching and estimating a pair on one thread, as multiples of `3way` at full size; errors, degrees; coverage
of the 95 % interval; and how many rows are suspect. Prints the table of rollcli/stereo/README.md.
"""

import math
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from matched import match_as_estimated

sys.path.insert(0, str(Path(__file__).parents[2]))

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.simulate.build import RenderedFrame, render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo.match import StereoOptions

KINDS = [("3way", 1), ("sgbm", 1), ("hh", 1), ("3way", 1.5), ("3way", 2), ("hh", 2), ("3way", 3)]
SEEDS = {10: 8301, 35: 8302}


def main() -> None:
    """Print a line for each mode, downscale and span of rolls."""
    cv2.setNumThreads(1)
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    print("| mode | downscale | rolls | time | median | 95 % | worst | covered | suspect |")
    print("|---|---|---|---|---|---|---|---|---|")
    for span, count in ((10, pairs), (35, pairs // 2)):
        specs = draw_specs(SimulateOptions(frames=count, roll_deg=(-span, span), seed=SEEDS[span], grey=True))
        frames = [render_frame(spec) for spec in specs]
        rolls = [math.degrees(spec.roll) for spec in specs]
        first = 0.0
        for mode, downscale in KINDS:
            seconds, line = measured(frames, rolls, StereoOptions(mode=mode, downscale=downscale))
            first = first or seconds
            print(f"| {mode} | {downscale} | ±{span} | {seconds / first:.2f} | {line} |", flush=True)


def measured(frames: list[RenderedFrame], rolls: list[float], options: StereoOptions) -> tuple[float, str]:
    """CPU seconds, and what the angles are."""
    errors, covered, suspect = [], [], 0
    start = time.process_time()
    for frame, roll_deg in zip(frames, rolls, strict=True):
        try:
            estimate = estimate_roll(match_as_estimated(frame.left, frame.right, options).disparity)
        except EstimationError:
            suspect += 1
            continue
        error = abs(math.degrees(estimate.theta) - roll_deg)
        errors.append(error)
        covered.append(error <= math.degrees(estimate.ci95 or 0))
        suspect += estimate.status != "ok"
    seconds = time.process_time() - start
    figures = f"{np.median(errors):.3f} | {np.percentile(errors, 95):.3f} | {max(errors):.3f}"
    return seconds, f"{figures} | {np.mean(covered):.2f} | {suspect} of {len(frames)}"


if __name__ == "__main__":
    main()
