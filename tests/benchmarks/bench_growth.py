"""How the work grows: with the size of a map, and with the number of frames.

    python tests/benchmarks/bench_growth.py [FRAMES ...]

CPU time of reading one map and estimating its angle (ours), and of cv2.imdecode alone (bare), on one thread,
for maps from 640x480 to 12000x8000. Then the whole program on FRAMES frames (1000, 10000 and 100000), which
are hard links to maps of 96x72, a thousand to each. Both should be flat: a pixel, and a frame.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from timed import timed

from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import read_disparity
from tests.run_cli import command, environment, write_kitti

SIZES = [(640, 480), (1242, 375), (1920, 1080), (3840, 2160), (12000, 8000)]
TINY = (96, 72)
ENOUGH = 40_000_000  # px read at each size, in so many rounds
_FOLDER_OF = 1000  # links to one map: ext4 allows 65,000


def road(width: int, height: int) -> NDArray[np.float32]:
    """Disparity (px) of a road that fills the map, rolled by 3 degrees, with noise."""
    v, u = np.arange(height, dtype=np.float32)[:, None], np.arange(width, dtype=np.float32)
    slope = np.float32(60 / height)
    noise = np.random.default_rng(0).standard_normal((height, width), np.float32)
    return np.float32(4) + slope * (v - np.float32(0.0524) * (u - width / 2).astype(np.float32)) + noise / 20


def of_a_size(folder: Path, width: int, height: int) -> None:
    """Print a line: both ways in turns, the best of some rounds."""
    path = folder / f"{width}.png"
    write_kitti(path, np.maximum(road(width, height), np.float32(0.5)))
    ours, bare = [], []
    for _ in range(max(1, min(20, ENOUGH // (width * height)))):
        start = time.process_time()
        estimate_roll(read_disparity(str(path)))
        between = time.process_time()
        cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
        ours.append(between - start)
        bare.append(time.process_time() - between)
    best, decoded = min(ours), min(bare)
    pixels = width * height / 1e6
    print(
        f"{width}x{height}: ours {1e3 * best:8.1f} ms, {1e3 * best / pixels:5.1f} ms a megapixel; "
        f"bare {1e3 * decoded:8.1f} ms; ratio {best / decoded:.2f}",
        flush=True,
    )


def of_a_number(folder: Path, frames: int) -> None:
    """Print a line: the whole program, start-up included, and decoding as many maps in one process."""
    tiny, maps = np.maximum(road(*TINY), np.float32(0.5)), folder / f"maps{frames}"
    for number in range(frames):
        path = maps / f"{number // _FOLDER_OF:04}" / f"{number:07}.png"
        if number % _FOLDER_OF == 0:
            first = path
            write_kitti(first, tiny)
        else:
            os.link(first, path)
    line = command("estimate", maps, "--recursive", "-q", "-j1", "-o", folder / "rolls.csv", "--overwrite")
    _, cpu = timed(line, environment())
    start = time.process_time()
    for path in maps.glob("*/*.png"):
        cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
    bare = time.process_time() - start
    print(
        f"{frames} frames of {TINY[0]}x{TINY[1]}: {frames / cpu:.0f} a CPU second, "
        f"{1e3 * cpu / frames:.2f} ms a frame; bare {1e3 * bare / frames:.3f} ms; ratio {cpu / bare:.1f}",
        flush=True,
    )


def main() -> None:
    """Print two tables."""
    cv2.setNumThreads(1)
    numbers = [int(text) for text in sys.argv[1:]] or [1_000, 10_000, 100_000]
    with tempfile.TemporaryDirectory() as folder:
        for size in SIZES:
            of_a_size(Path(folder), *size)
        for frames in numbers:
            of_a_number(Path(folder), frames)


if __name__ == "__main__":
    main()
