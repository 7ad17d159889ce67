"""What a stereo pair costs beside the one bare match that it cannot do without.

    python tests/benchmarks/bench_pairs.py [PAIRS] [WxH ...]

CPU time of reading, levelling, matching and estimating a pair (ours), and of cv2 decoding of both views with
one OpenCV SGBM over the same range (bare), on one thread, in turns. The pairs: PAIRS rendered ones (12) of
each size (640x480 and 1242x375), level, and with the right view turned by 0.3 degrees, 0.2 % larger and
1.5 px lower; and real streets, where ../shared/streets is. Of level pairs, also the whole program with -j1,
start-up included. Errors are against the rendered roll, degrees. To reach: 0.65 for level pairs, 0.8 for
others, and 0.8 for the program over 60 pairs.
"""

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from rollcli.run.workers.pool import limit_blas_threads, prepare_worker

limit_blas_threads()  # as the program does: else some milliseconds are threads that wait for each other

import cv2
import numpy as np
from matched import match_as_estimated
from numpy.typing import NDArray
from timed import timed

from rollcli.estimator.estimate import estimate_roll
from rollcli.files.formats import read_image
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo.misalignment import LEVEL
from tests.run_cli import command, environment

STREETS = ROOT.parent / "shared" / "streets"
ROUNDS = 3
SEED = 4711


class Pair(NamedTuple):
    """Two files, and the true roll where it is known."""

    left: Path
    right: Path
    roll_deg: float | None = None


def main() -> None:
    """Print a line for each kind of pairs."""
    prepare_worker()  # as the program does: one thread, and memory that is kept between pairs
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    with TemporaryDirectory() as folder:
        for size in sys.argv[2:] or ("640x480", "1242x375"):
            for odd in (False, True):
                some = list(rendered(Path(folder, size), pairs, size, odd=odd))
                bare = report(f"rendered {size}, {'turned' if odd else 'level'}", some)
                if not odd:
                    share = whole_program(some[0]) / bare
                    print(f"  the program over them, start-up included: {share:.2f}")
    if STREETS.is_dir():
        named = sorted((STREETS / "left").iterdir())
        report("real streets, as they are", [Pair(left, STREETS / "right" / left.name) for left in named])


def rendered(folder: Path, pairs: int, size: str, *, odd: bool) -> Iterator[Pair]:
    """Render pairs; odd: with a right camera that is out of place."""
    width, height = map(int, size.split("x"))
    asked = SimulateOptions(frames=pairs, size=(width, height), seed=SEED, grey=True)
    for side in ("left", "right"):
        (folder / side).mkdir(parents=True, exist_ok=True)
    for number, spec in enumerate(draw_specs(asked)):
        frame = render_frame(spec)
        left, right = (folder / side / f"{number:04}.png" for side in ("left", "right"))
        cv2.imwrite(str(left), frame.left)
        cv2.imwrite(str(right), out_of_place(frame.right) if odd else frame.right)
        yield Pair(left, right, math.degrees(spec.roll))


def out_of_place(view: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What a camera sees that is turned, nearer and lower."""
    height, width = view.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -0.3, 1.002)
    matrix[1, 2] += 1.5
    seen = cv2.warpAffine(view, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    return seen.astype(np.uint8, copy=False)


def report(kind: str, pairs: list[Pair]) -> float:
    """Time both ways on each pair, in turns; CPU seconds of all the bare ones."""
    ours, bare, errors, corrected = [], [], [], 0
    for pair in pairs:
        best = [math.inf, math.inf]
        for _ in range(ROUNDS):
            start = time.process_time()
            match = match_as_estimated(read_image(str(pair.left)), read_image(str(pair.right)))
            estimate = estimate_roll(match.disparity)
            between = time.process_time()
            bare_match(pair, match.num_disparities)
            end = time.process_time()
            best = [min(best[0], between - start), min(best[1], end - between)]
        ours.append(best[0])
        bare.append(best[1])
        corrected += match.corrected != LEVEL
        if pair.roll_deg is not None:
            errors.append(abs(math.degrees(estimate.theta) - pair.roll_deg))
    ratio = sum(ours) / sum(bare)
    print(f"{kind}: {len(pairs)} pairs, {corrected} corrected; CPU a pair: ", end="")
    print(f"ours {1e3 * np.mean(ours):.0f} ms, bare {1e3 * np.mean(bare):.0f} ms, ratio {ratio:.2f}", end="")
    print(f"; error median {np.median(errors):.3f}, worst {max(errors):.3f}" if errors else "")
    return sum(bare)


def whole_program(first: Pair) -> float:
    """CPU seconds of an estimate of all pairs in the folders of the first one."""
    line = command("estimate", "--left", first.left.parent, "--right", first.right.parent, "-q", "-j", "1")
    how = {"environment": environment(PYTHONPATH=str(ROOT)), "stdout": subprocess.DEVNULL}
    return min(timed(line, **how)[1] for _ in range(ROUNDS))


def bare_match(pair: Pair, count: int) -> None:
    """What one would write with OpenCV alone, the range being known."""
    left, right = (cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (pair.left, pair.right))
    matcher = cv2.StereoSGBM.create(
        numDisparities=count,
        blockSize=5,
        P1=100,
        P2=400,
        disp12MaxDiff=1,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    matcher.compute(left, right)


if __name__ == "__main__":
    main()
