"""What a simulated pair costs, and whether SGBM treats it as it treats a photographed one.

python tests/benchmarks/bench_simulate.py [pairs a scene] [frames of a folder]
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_image
from rollcli.simulate.build import render_frame
from rollcli.simulate.dataset import plan_dataset, write_dataset
from rollcli.simulate.options import SCENES, SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo.match import compute_disparity

MODES = ("3way", "sgbm", "hh")
STREETS = ROOT.parent / "shared" / "streets"


class Errors(NamedTuple):
    """SGBM - truth on the road: median |error| and error, px, share beyond 1 px; share with a disparity."""

    middle: float
    bias: float
    beyond: float
    found: float


def errors(left: np.ndarray, right: np.ndarray, truth: np.ndarray, road: np.ndarray, mode: str) -> Errors:
    """How SGBM does on the road's pixels."""
    found = compute_disparity(left, right, mode=mode)
    error = (found - truth)[road & (found > 0)]
    size = np.abs(error)
    return Errors(
        float(np.median(size)), float(np.median(error)), float(np.mean(size > 1)), len(error) / road.sum()
    )


def show(name: str, mode: str, pairs: list[Errors], cost: str = "") -> None:
    """One line of the table: means over the pairs."""
    mean, middle = Errors(*map(statistics.mean, zip(*pairs, strict=True))), [each.middle for each in pairs]
    span = f"{mean.middle:9.3f} ({min(middle):.3f}..{max(middle):.3f})"
    print(f"{name:7} {mode:4} {span} {mean.bias:11.3f} {mean.beyond:12.1%} {mean.found:8.0%}  {cost}")


def show_pairs(pairs: int) -> None:
    """CPU time and SGBM's errors, a line a scene and mode."""
    print(f"{pairs} colour pairs of 640x480 a scene; SGBM - truth on the road, where both are valid")
    print("scene   mode  median |error|, px (range)  bias, px  beyond 1 px  found  CPU s a pair")
    for scene in SCENES:
        frames, seconds = [], []
        for spec in draw_specs(SimulateOptions(frames=pairs, scene=scene, seed=100)):
            start = time.process_time()
            frames.append(render_frame(spec))
            seconds.append(time.process_time() - start)
        for mode in MODES:
            cost = f"{statistics.median(seconds):.2f}" if mode == MODES[0] else ""
            show(scene, mode, [errors(f.left, f.right, f.disparity, f.road, mode) for f in frames], cost)
    print("to reach on open and street: a median of 0.05 to 0.3 px, under 3 % beyond 1 px")


def show_photographs() -> None:
    """The same on KITTI pairs, where they are: lidar in the lower middle of the image stands for the road."""
    truths = sorted(STREETS.glob("truth/*.png"))
    for mode in MODES if truths else ():
        found = []
        for path in truths:
            left, right = (read_image(STREETS / side / path.name) for side in ("left", "right"))
            truth = read_disparity(path)
            v, u = np.indices(truth.shape)
            road = (truth > 0) & (v > 0.65 * truth.shape[0]) & (np.abs(u - truth.shape[1] / 2) < 220)
            found.append(errors(left, right, truth, road, mode))
        show("KITTI", mode, found)


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
    show_photographs()
    show_folder(frames)


if __name__ == "__main__":
    main()
