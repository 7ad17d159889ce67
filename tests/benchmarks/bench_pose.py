"""How accurate and how honest pitch and height are: rendered pairs, KITTI 2012's streets, and the cost.

    python tests/benchmarks/bench_pose.py [FRAMES [SIZE [SEED [ROUGHNESS]]]]

FRAMES mixed scenes (100) of SIZE (640x480), matched by SGBM, with pitch from 2 to 7 degrees, height from 1.3
to 1.8 m and a principal point up to 30 px off the centre. To reach: pitch median 0.03 and 95 % 0.08 degrees,
height median 0.2 % and 95 % 0.6 %, both intervals cover 0.92 to 0.98; on the streets a height of 1.55 to
1.75 m in every `ok` frame, steady to 3 % within a run, and full and half size within their intervals; less
than 3 % of a frame's time.

Pitch and height are those of the road near ahead, where the tangent touches it. A road of curvature k bends
away by k z at the distance z: "at the tangent" compares with the road there, "below the camera" with the road
under the camera, where that of a flat road is the same. A road of a class of ROUGHNESS, A to E, bends as what
fits its lane; the rest of it the intervals are to cover. "offset" is the mean error of the pitch as px of
disparity: what the matcher errs by.
"""

import math
import sys
import time
from collections import defaultdict
from pathlib import Path

import cv2
import numpy as np
from matched import Matched, match_as_estimated, matched

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import with_pose
from rollcli.simulate.build import carriageway_of
from rollcli.stereo.match import StereoOptions

SEED = 7714
STREETS = Path(__file__).parents[3] / "shared" / "streets"
KITTI_2012 = Calibration(707.0912, 707.0912, 601.8873, 183.1104, 0.5372)


def judged(frame: Matched):
    """Errors of one frame: pitch (degrees) and height (per cent) at the tangent and below the camera, ..."""
    spec = frame.spec
    width, height = spec.size
    nominal = Calibration(spec.focal, spec.focal, *spec.centre, spec.baseline, 0.0, width, height)
    posed = with_pose(estimate_roll(frame.disparity), nominal)
    tangent = posed.tangent
    distance = spec.focal * spec.baseline / tangent.disparity
    curvature = carriageway_of(spec).curvature_ahead
    bend = math.atan(curvature * distance)
    pitch = spec.pitch + bend
    above = (spec.height + curvature * distance**2 / 2) * math.cos(bend)
    off = posed.pitch - pitch
    return {
        "flat": spec.curvature == 0,
        "pitch": abs(math.degrees(off)),
        "height": 100 * abs(posed.height_m / above - 1),
        "pitch covered": abs(off) <= posed.pitch_ci95,
        "height covered": abs(posed.height_m - above) <= posed.height_ci95_m,
        "pitch below": abs(math.degrees(posed.pitch - spec.pitch)),
        "height below": 100 * abs(posed.height_m / spec.height - 1),
        "offset": off * spec.focal * tangent.slope / math.cos(pitch) ** 2,
        "distance": distance,
        "half-width": math.degrees(posed.pitch_ci95),
    }


def rendered(frames: int, size: tuple[int, int], seed: int, roughness: str | None) -> None:
    """Print the errors on rendered pairs."""
    rows = []
    for frame in matched(
        frames,
        seed,
        10,
        size,
        pitch_deg=(2, 7),
        height=(1.3, 1.8),
        principal_offset=(-30.0, 30.0),
        roughness=roughness,
    ):
        try:
            rows.append(judged(frame))
        except EstimationError as error:
            print(f"{frame.scene}: {error}")
    print(f"rendered: {len(rows)} of {frames} frames of {size[0]}x{size[1]}, seed {seed}")
    flat = np.array([row["flat"] for row in rows])
    for name, of in (("all", flat | ~flat), ("flat", flat), ("curved", ~flat)):
        if of.any():
            show(name, {key: np.array([row[key] for row in rows], float)[of] for key in rows[0]})


def show(name: str, table: dict[str, np.ndarray]) -> None:
    """Print one kind of roads."""
    print(f"  {name}: {len(table['pitch'])} frames, tangent {np.median(table['distance']):.1f} m ahead")
    for at, suffix in (("at the tangent", ""), ("below the camera", " below")):
        figures = []
        for what, unit, digits in (("pitch", "degrees", 3), ("height", "%", 2)):
            sizes = table[what + suffix]
            median, most = np.median(sizes), np.percentile(sizes, 95)
            figures.append(f"{what} median {median:.{digits}f} 95 % {most:.{digits}f} {unit}")
        print(f"    {at:17} {'; '.join(figures)}")
    covered = ", ".join(f"{what} {table[f'{what} covered'].mean():.3f}" for what in ("pitch", "height"))
    width, offset = np.median(table["half-width"]), table["offset"].mean()
    print(f"    covered: {covered}; half-width {width:.3f} degrees; offset {offset:+.3f} px")


def streets() -> None:
    """Print what KITTI 2012's streets give, at full and at half size."""
    if not STREETS.is_dir():
        print(f"streets: skipped, {STREETS} is not here")
        return
    runs, agree = defaultdict(list), []
    for path in sorted((STREETS / "left").glob("*.png")):
        left, right = (cv2.imread(str(STREETS / side / path.name), -1) for side in ("left", "right"))
        poses = []
        for factor in (1, 2):
            found = match_as_estimated(left, right, StereoOptions(downscale=factor)).disparity
            estimate = estimate_roll(found)
            calibration = KITTI_2012.for_size(*left.shape[::-1]).for_size(*found.shape[::-1])
            poses.append(with_pose(estimate, calibration))
        full, half = poses
        runs[path.stem.split("_")[0]].append(full)
        if all(each.status == "ok" for each in poses):
            pitch = abs(full.pitch - half.pitch) <= math.hypot(full.pitch_ci95, half.pitch_ci95)
            height = abs(full.height_m - half.height_m) <= math.hypot(full.height_ci95_m, half.height_ci95_m)
            agree.append((pitch, height))
    for run, poses in runs.items():
        heights = np.array([each.height_m for each in poses])
        status = "".join(each.status[0] for each in poses)
        spread = 100 * np.ptp(heights) / heights.mean()
        print(
            f"streets: {run} {status:5} {heights.min():.3f} to {heights.max():.3f} m, spread {spread:.1f} %"
        )
    print(f"streets: full and half size agree in pitch, height: {np.mean(agree, axis=0)} of {len(agree)} ok")


def cost() -> None:
    """Print the time of a pose as a share of an estimate's, and of a frame's with its decoding."""
    v, u = np.mgrid[:375, :1242].astype(np.float32)
    noise = np.random.default_rng(0).normal(0, 0.2, v.shape)
    road = np.where(v > 190, 0.33 * (v - 180) + 0.01 * u + noise, 0).astype(np.float32)
    png = cv2.imencode(".png", np.rint(road * 256).astype(np.uint16))[1]
    calibration = KITTI_2012.for_size(1242, 375)
    times: dict[str, list[float]] = {"decode": [], "estimate": [], "pose": []}
    for _ in range(100):
        before = time.process_time()
        cv2.imdecode(png, cv2.IMREAD_UNCHANGED)
        start = time.process_time()
        estimate = estimate_roll(road)
        middle = time.process_time()
        with_pose(estimate, calibration)
        times["decode"].append(start - before)
        times["estimate"].append(middle - start)
        times["pose"].append(time.process_time() - middle)
    decoding, estimating, pose = (1000 * float(np.median(each)) for each in times.values())
    of_estimate, of_frame = pose / estimating, pose / (decoding + estimating + pose)
    shares = f"{of_estimate:.1%} of it, {of_frame:.1%} of a frame"
    print(f"cost: decoding {decoding:.2f} ms, estimate {estimating:.2f} ms, pose {pose:.3f} ms: {shares}")


def main() -> None:
    """Print all three."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    width, height = map(int, (sys.argv[2] if len(sys.argv) > 2 else "640x480").split("x"))
    cost()
    streets()
    seed, roughness = int(sys.argv[3]) if len(sys.argv) > 3 else SEED, next(iter(sys.argv[4:]), None)
    rendered(frames, (width, height), seed, roughness)


if __name__ == "__main__":
    main()
