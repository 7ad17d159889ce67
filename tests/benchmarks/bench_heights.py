"""How right heights over the road are, on rendered roads with dips, bumps and kerbs; and what they cost.

    python tests/benchmarks/bench_heights.py [FRAMES [SEED]]

FRAMES roads of each kind (16) of 1242x375, f 721 px, B 0.54 m, against their true heights. Maps are the true
ones with noise of 0.06 px, of which pixels of the road and the pavements 4 to 12 m ahead are compared, up to
10 cm high: beside a crowned road, pavements end far above the crown that goes on under them. Pairs are
matched as `estimate` does. A dip or bump is found as its depth: the median over what is deeper than nine
tenths of it; a kerb as the median height of the pavement 8 to 12 m ahead.

To reach: maps median 2 mm, 95 % 6 mm, depths within 2 mm; pairs median 5 mm at 10 m, kerbs of 10 cm within
1 cm; 6 ms of CPU time for a map, writing included.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

import rollcli
from rollcli.files.atomic import write_atomic
from rollcli.pictures.heights import steadied
from rollcli.run.frame_task import encode_heights
from rollcli.run.workers.pool import prepare_worker

SIZE, FOCAL, BASELINE, NOISE_PX = "1242x375", 721, 0.54, 0.06
NEAR, FAR = 4.0, 12.0  # m
KERB = 0.1  # m
KINDS = {
    "flat": ("--curvature", "0:0"),
    "curvature up to 0.001 1/m": ("--curvature=-0.001:0.001",),
    "curvature up to 0.004 1/m": ("--curvature=-0.004:0.004",),
    "crowned by 2 %": ("--curvature", "0:0", "--cross-section", "crown", "--crossfall", "2"),
}


class Frame(NamedTuple):
    """A rendered pair and what is true of it; arrays (H, W)."""

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    disparity: NDArray[np.float32]
    heights: NDArray[np.float32]

    @property
    def depth(self) -> NDArray[np.float32]:
        """How far each pixel's point is, m."""
        with np.errstate(divide="ignore"):
            return np.float32(FOCAL * BASELINE) / self.disparity


def rendered(count: int, seed: int, *options: str) -> Iterator[tuple[Frame, rollcli.Calibration]]:
    """Render open scenes with three dips and kerbs of 10 cm."""
    with tempfile.TemporaryDirectory() as name:
        line = [sys.executable, "-m", "rollcli", "simulate", name, "-q", "--grey", "--scene", "open"]
        line += ["--frames", str(count), "--size", SIZE, "--focal", str(FOCAL), "--baseline", str(BASELINE)]
        line += ["--pitch", "2:6", "--dips", "3", "--kerb", str(KERB), "--seed", str(seed), *options]
        subprocess.run(line, check=True, cwd=ROOT)
        folder = Path(name)
        calibration = rollcli.read_calibration(folder / "calib.txt")
        for path in sorted((folder / "left").iterdir()):
            grey = [
                cv2.imread(str(folder / side / path.name), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")
            ]
            disparity = rollcli.read_disparity(folder / "disparity" / path.name)
            yield (
                Frame(*grey, disparity, tifffile.imread(folder / "heights" / f"{path.stem}.tif")),
                calibration,
            )


def depths_off(truth: NDArray[np.float32], off: NDArray[np.float32]) -> Iterator[float]:
    """Yield by how much the depth of each dip or bump is wrong, m; not of verges that slope, beside kerbs."""
    relief = (np.abs(truth) > 0.02) & np.isfinite(off)
    count, labels = cv2.connectedComponents(relief.astype(np.uint8))
    for label in range(1, count):
        of = labels == label
        deep = of & (np.abs(truth) > 0.9 * np.abs(truth[of]).max())
        if 0.025 < np.abs(truth[of]).max() < KERB - 0.01 and deep.sum() >= 30:
            yield float(abs(np.median(off[deep])))


def maps(count: int, seed: int) -> None:
    """Print errors of heights over true maps with noise, mm."""
    rng = np.random.default_rng(seed)
    print(f"{'maps with noise of 0.06 px, 4 to 12 m, mm':44} median   95 %   dips: median, worst, found")
    for kind, options in KINDS.items():
        errors, dips = [], list[float]()
        for frame, calibration in rendered(count, seed, *options):
            noise = rng.normal(0, NOISE_PX, frame.disparity.shape).astype(np.float32)
            noisy = np.where(frame.disparity > 0, frame.disparity + noise, 0)
            estimate = rollcli.estimate_roll(noisy, calibration=calibration)
            off = rollcli.height_map(noisy, estimate, calibration) - frame.heights
            off[(frame.depth < NEAR) | (frame.depth > FAR) | (frame.heights > KERB + 0.001)] = np.nan
            errors.append(np.abs(off[np.isfinite(off)]))
            dips += depths_off(frame.heights, off)
        median, most = 1000 * np.quantile(np.concatenate(errors), (0.5, 0.95))
        deep = 1000 * np.array(dips or [np.nan])
        print(f"{kind:44} {median:6.1f} {most:6.1f}   {np.median(deep):.1f}, {deep.max():.1f}, {len(dips)}")


def pairs(count: int, seed: int) -> None:
    """Print errors of heights of matched pairs, mm."""
    errors: dict[float, list[NDArray[np.float32]]] = {5.0: [], 10.0: [], 20.0: []}
    kerbs = []
    for frame, calibration in rendered(count, seed):
        disparity = rollcli.compute_disparity(frame.left, frame.right)
        estimate = rollcli.estimate_pair(frame.left, frame.right, calibration=calibration)
        heights = steadied(rollcli.height_map(disparity, estimate, calibration))
        off = heights - frame.heights
        for distance, parts in errors.items():
            here = np.isfinite(off) & (np.abs(frame.depth / distance - 1) < 0.2)
            parts.append(np.abs(off[here]))
        paved = np.isfinite(off) & (np.abs(frame.heights - KERB) < 1e-4) & (np.abs(frame.depth - 10) < 2)
        if paved.sum() > 100:
            kerbs.append(abs(float(np.median(off[paved]))))
    for distance, parts in errors.items():
        median, most = 1000 * np.quantile(np.concatenate(parts), (0.5, 0.95))
        print(f"{f'pairs, matched, at {distance:.0f} m':44} {median:6.1f} {most:6.1f}")
    within = sum(kerb < 0.01 for kerb in kerbs)
    print(f"kerbs of 10 cm within 1 cm: {within} of {len(kerbs)}, worst {1000 * max(kerbs):.0f} mm")


def cost(seed: int) -> None:
    """Print the CPU time of the heights of a map, ms, in a process that is set up as a worker is."""
    prepare_worker()
    frame, calibration = next(rendered(1, seed))
    estimate = rollcli.estimate_roll(frame.disparity, calibration=calibration)
    taken = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(40):
            start = time.process_time()
            heights = rollcli.height_map(frame.disparity, estimate, calibration)
            write_atomic(Path(folder) / "heights.tif", encode_heights(heights, "tiff", "metres"))
            taken.append(1000 * (time.process_time() - start))
    print(f"CPU time of a map, writing included: {np.median(taken):.1f} ms")


if __name__ == "__main__":
    given = [int(each) for each in sys.argv[1:]] + [16, 33][len(sys.argv) - 1 :]
    maps(*given)
    pairs(*given)
    cost(given[1])
