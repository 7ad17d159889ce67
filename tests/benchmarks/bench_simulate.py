"""What a simulated pair costs, and whether SGBM treats it as it treats a photographed one.

python tests/benchmarks/bench_simulate.py [pairs a scene] [frames of a folder]
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from rollcli.imaging.stereo import compute_disparity  # noqa: E402
from rollcli.simulate.dataset import plan_dataset, write_dataset  # noqa: E402
from rollcli.simulate.options import SCENES, SimulateOptions  # noqa: E402
from rollcli.simulate.render import Frame, render_frame  # noqa: E402
from rollcli.simulate.spec import draw_specs  # noqa: E402

MODES = ("3way", "sgbm", "hh")


def matched(frame: Frame, mode: str) -> tuple[float, float, float, float]:
    """On the road: median |SGBM - truth| and its sign, px, share beyond 1 px, and share with a disparity."""
    found = compute_disparity(frame.left, frame.right, mode=mode)
    both = frame.road & (found > 0)
    error = (found - frame.disparity)[both]
    return (
        float(np.median(np.abs(error))),
        float(np.median(error)),
        float(np.mean(np.abs(error) > 1)),
        float(both.sum() / frame.road.sum()),
    )


def show_pairs(pairs: int) -> None:
    """CPU time and SGBM's errors, a line a scene and mode."""
    print(f"{pairs} colour pairs of 640x480 a scene; SGBM - truth on the road, where both are valid")
    print("scene   mode  median |error| px (range)      bias px   beyond 1 px  found   CPU s a pair")
    for scene in SCENES:
        frames, seconds = [], []
        for spec in draw_specs(pairs, scene=scene, seed=100):
            start = time.process_time()
            frames.append(render_frame(spec))
            seconds.append(time.process_time() - start)
        for mode in MODES:
            errors = [matched(frame, mode) for frame in frames]
            middle, bias, beyond, found = (statistics.mean(column) for column in zip(*errors, strict=True))
            low, high = min(e[0] for e in errors), max(e[0] for e in errors)
            cost = f"{statistics.median(seconds):8.2f}" if mode == MODES[0] else ""
            print(
                f"{scene:7} {mode:4}  {middle:10.3f} ({low:.3f}..{high:.3f}) {bias:16.3f}"
                f"{beyond:13.2%}{found:7.0%}{cost}"
            )
    print("to reach on open and street: a median of 0.05 to 0.3 px, under 3 % beyond 1 px")


def show_folder(frames: int) -> None:
    """Wall time of a folder, rendered and written, with one worker and with two."""
    options = SimulateOptions(frames=frames)
    seconds = []
    for jobs in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            for _ in write_dataset(plan_dataset(Path(folder, "rig"), options), jobs):
                pass
            seconds.append(time.perf_counter() - start)
    one, two = seconds
    print(f"{frames} mixed pairs, written: {one / frames:.2f} s a pair with one worker (at most 0.5)")
    print(f"with two workers: {one / two:.2f} x as fast, start-up included")


def main() -> None:
    """Print both tables."""
    pairs, frames = [int(text) for text in sys.argv[1:3]] + [8, 24][len(sys.argv) - 1 :]
    cv2.setNumThreads(1)
    show_pairs(pairs)
    show_folder(frames)


if __name__ == "__main__":
    main()
