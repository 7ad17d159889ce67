"""How well a right view is levelled that is turned, enlarged or shifted by a known amount.

    python tests/benchmarks/bench_level.py [PAIRS] [SEED]

PAIRS rendered pairs (12) of 640x480, half as many of 1242x375, as many of empty roads with much noise, which
are hardest to measure, and every real street where ../shared/streets is. OpenCV warps the right view in
twelve ways, by yaws and pitches of a camera, and bends the rows alone; it turns the left view, and the roll
with it. The twelve ways are done again with a correction that tells them: what is left then is of the match.
Each angle that is ok is compared with that of the untouched pair, where this is ok, too, and of rendered ones
with the truth. To reach: within 0.1 degrees, or suspect; no level rendered pair corrected; 0.95 and more of
the warped ones in their intervals.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from matched import match_as_estimated
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from rollcli.errors import RollcliError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.estimator.request import Request
from rollcli.files.formats import read_image
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo.correction import Correction
from rollcli.stereo.match import StereoMatch
from rollcli.stereo.misalignment import LEVEL, NO_SUPPORT, Misalignment
from rollcli.stereo.options import StereoOptions
from tests.odd_views import seen_by, seen_turned

STREETS = Path(__file__).parents[3] / "shared" / "streets"
SEED = 812
SIZES = {1: (640, 480), 2: (1242, 375)}  # by the part of the pairs that has it
WAYS = [  # degrees clockwise, per cent larger, pixels lower
    (0.3, 0.0, 0.0),
    (-0.8, 0.0, 0.0),
    (0.0, 0.2, 0.0),
    (0.0, -0.4, 0.0),
    (0.0, 0.8, 0.0),
    (0.0, 0.05, 0.0),
    (0.0, 0.0, 0.4),
    (0.0, 0.0, -4.0),
    (0.1, -0.1, 0.5),
    (-0.8, 0.8, 4.0),
    (0.8, 0.8, -4.0),
    (0.5, -0.6, -2.0),
]
SLIGHTLY_LARGER, SLIGHT_YAWS_DEG = (0.02, -0.03), (0.03, -0.05)  # most of them count as level
YAWS_DEG, PITCHES_DEG, BENDS, LEFT_DEG = (0.1, -0.3), (0.1, 0.3), (0.002, -0.002), (0.3, -0.3)
GOOD_DEG = 0.1
NOISE = 4.0  # grey levels; the renderer's default is 1.5


class Views(NamedTuple):
    """A left and a right view, and the roll where it is known, radians."""

    left: NDArray[Any]
    right: NDArray[Any]
    roll: float = math.nan


def main() -> None:
    """Print a line for rendered and for real pairs."""
    cv2.setNumThreads(1)
    pairs, seed = [int(text) for text in sys.argv[1:3]] + [12, SEED][len(sys.argv) - 1 :]
    for kind, more in (("rendered", {}), ("empty roads, much noise", {"scene": "bare", "noise": NOISE})):
        report(kind, [each for part in SIZES for each in rendered(pairs // part, SIZES[part], seed, **more)])
    if STREETS.is_dir():
        named = sorted((STREETS / "left").iterdir())
        sides = [(path, STREETS / "right" / path.name) for path in named]
        report("real streets", [Views(*(read_image(str(path)) for path in pair)) for pair in sides])


def rendered(pairs: int, size: tuple[int, int], seed: int, **more: Any) -> Iterator[Views]:
    """Render level pairs; `more` is for `SimulateOptions`."""
    for spec in draw_specs(SimulateOptions(frames=pairs, size=size, seed=seed, grey=True, **more)):
        frame = render_frame(spec)
        yield Views(frame.left, frame.right, spec.roll)


def report(kind: str, pairs: list[Views]) -> None:
    """Compare each pair with itself, untouched and warped."""
    levels = [match_as_estimated(pair.left, pair.right) for pair in pairs]
    corrected = sum(level.corrected != LEVEL for level in levels)
    estimates = [estimate_of(level) for level in levels]
    found = [
        (pair, level, estimate.theta)
        for pair, level, estimate in zip(pairs, levels, estimates, strict=True)
        if estimate.status == "ok" and not level.doubt
    ]
    known = [(pair, theta) for pair, _, theta in found]
    print(f"{kind}: {len(pairs)} pairs, {corrected} corrected untouched; {len(known)} to compare with")
    ways = {
        "turned, larger, lower": [partial(askew, way=way) for way in WAYS],
        "nearly level": [
            *(partial(seen_by, larger_percent=each) for each in SLIGHTLY_LARGER),
            *(partial(seen_turned, yaw_deg=each) for each in SLIGHT_YAWS_DEG),
        ],
        "yaw": [partial(seen_turned, yaw_deg=each) for each in YAWS_DEG],
        "pitch": [partial(seen_turned, pitch_deg=each) for each in PITCHES_DEG],
        "bent rows": [partial(bent, share=each) for each in BENDS],
    }
    for name, warps in ways.items():
        seen = [(pair._replace(right=warp(pair.right)), theta) for pair, theta in known for warp in warps]
        report_ways(name, seen)
    report_ways("left view turned", [turned(*each, deg) for each in known for deg in LEFT_DEG])
    report_ways(
        "turned, larger, lower, as told", [each for pair, level, _ in found for each in told(pair, level)]
    )


def told(pair: Views, level: StereoMatch) -> Iterator[tuple[Views, float, StereoOptions]]:
    """Warp the right view in all ways, each with a correction that says so, and the angle without a warp."""

    def options(clockwise_deg: float = 0.0, percent: float = 0.0, lower: float = 0.0) -> StereoOptions:
        lies = level.corrected + Misalignment(lower, math.radians(clockwise_deg), percent / 100)
        columns = replace(NO_SUPPORT, scale=level.larger + percent / 100)
        return StereoOptions(align=Correction(lies, columns, 0.0, *level.disparity.shape[::-1]))

    theta = estimate_of(match_as_estimated(pair.left, pair.right, options())).theta
    for way in WAYS:
        yield pair._replace(right=askew(pair.right, way)), theta, options(*way)


def askew(view: NDArray[Any], way: tuple[float, float, float]) -> NDArray[Any]:
    """Return what an odd camera sees, in one of `WAYS`."""
    clockwise_deg, percent, lower = way
    return seen_by(view, clockwise_deg=clockwise_deg, larger_percent=percent, lower=lower)


def turned(pair: Views, theta: float, clockwise_deg: float) -> tuple[Views, float]:
    """Turn the left view alone, as a camera that is rolled against the baseline, and its roll with it."""
    left, more = seen_by(pair.left, clockwise_deg=clockwise_deg), math.radians(clockwise_deg)
    return Views(left, pair.right, pair.roll + more), theta + more


def report_ways(kind: str, pairs: Sequence[tuple[Views, float] | tuple[Views, float, StereoOptions]]) -> None:
    """Compare the angles of warped pairs with those, radians, that they should have."""
    off, reached, doubted = [], [], 0
    for pair, level_theta, *options in pairs:
        try:
            match = match_as_estimated(pair.left, pair.right, *options)
            found = estimate_of(match)
        except RollcliError:
            doubted += 1
            continue
        if match.doubt or found.status != "ok":
            doubted += 1
            continue
        off.append(math.degrees(abs(found.theta - level_theta)))
        reached.append(abs(found.theta - pair.roll) <= (found.ci95 or 0))
    if not off:
        print(f"  {kind}: all {doubted} doubted or refused")
        return
    print(f"  {kind}: median {np.median(off):.3f}, 95 % {np.percentile(off, 95):.3f}, ", end="")
    print(f"worst {max(off):.3f} degrees; ", end="")
    above = np.sum(np.array(off) > GOOD_DEG)
    covered = "" if math.isnan(pairs[0][0].roll) else f"; the interval covers {np.mean(reached):.2f}"
    print(f"{above} of {len(off)} above {GOOD_DEG}; {doubted} doubted or refused{covered}")


def bent(view: NDArray[Any], share: float) -> NDArray[Any]:
    """The view with the rows of its lower half further apart, and its columns as they are."""
    height, width = view.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    y -= np.float32(share) * np.maximum(y - np.float32((height - 1) / 2), 0)
    return cv2.remap(view, x, y, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)


def estimate_of(match: StereoMatch) -> RollEstimate:
    """The estimate of a matched pair."""
    return estimate_roll(match.disparity, Request(slope_error=match.slope_error))


if __name__ == "__main__":
    main()
