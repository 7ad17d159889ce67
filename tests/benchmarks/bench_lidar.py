"""How far real pairs with lidar are off their lane, as they are and as other cameras would have seen it.

    python tests/benchmarks/bench_lidar.py [STEP]

The 41 pairs of ../shared/lidar, or every STEP-th: mirrored, cut, resized, noisy, blurred, dark; and right
views that are larger, turned, or of another moment. The reference is the range of rolls that parts of the
lane have from 4 m on. Where lower rows are cut, angles are held against the lane that the image shows, too:
fitted to the sweep in the same way. Prints a Markdown table; moved: by more than 0.1 degrees from the pair as
it is, where both are ok.
"""

import csv
import math
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import RollcliError
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.files.formats import read_image
from rollcli.run.find import read_calibration
from rollcli.run.library import estimate_pair
from rollcli.stereo.match import compute_disparity
from tests.odd_views import seen_by, seen_turned

LIDAR = Path(__file__).resolve().parents[3] / "shared" / "lidar"
CUT = 60  # rows
FOCAL = 0.58  # of the rig, in widths

Image = NDArray[Any]
Views = tuple[Image, Image]
Lane = tuple[float, float]


def both(change: Callable[[Image], Image]) -> Callable[[Image, Image], Views]:
    """Change both views alike."""
    return lambda left, right: (change(left), change(right))


def right_alone(change: Callable[[Image], Image]) -> Callable[[Image, Image], Views]:
    """Change the right view."""
    return lambda left, right: (left, change(right))


def resized(view: Image, times: float) -> Image:
    between = cv2.INTER_AREA if times < 1 else cv2.INTER_CUBIC
    return cv2.resize(view, None, fx=times, fy=times, interpolation=between).astype(np.uint8, copy=False)


def noisy(view: Image, sigma: float) -> Image:
    noise = np.random.default_rng(int(view[::9, ::9].sum())).normal(0, sigma, view.shape)
    return np.clip(np.rint(view + noise), 0, 255).astype(np.uint8)


def with_lamps(view: Image) -> Image:
    """Return 16 bits, proportional to the light, a tenth as bright as the lamps above the road."""
    light: Image = np.rint(200 + 6000 * (view / 255) ** 2.2).astype(np.uint16)
    for column in range(100, 1242, 150):
        cv2.circle(light, (column, 80), 8, 65535, -1)
    return light


def packed(view: Image) -> Image:
    file = cv2.imencode(".jpg", view, [cv2.IMWRITE_JPEG_QUALITY, 50])[1]
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE))


def seen_ahead(left: Image, right: Image, metres: float) -> Views:
    """Return a right view of a moment later, when the rig is further ahead; by the pair's own disparities."""
    near = compute_disparity(right[:, ::-1].copy(), left[:, ::-1].copy())[:, ::-1]
    columns = np.maximum.accumulate(np.where(near > 0, np.arange(near.shape[1]), 0), axis=1)
    near = cv2.medianBlur(np.take_along_axis(near, columns, axis=1), 5)  # gaps are as what is left of them
    rig = read_calibration(LIDAR / "calib.txt")
    assert rig.baseline is not None
    v, u = np.indices(near.shape, np.float32)
    inward = metres * near / np.float32(rig.fx * rig.baseline)  # of the way to the principal point
    at = (each - inward * (each - np.float32(centre)) for each, centre in ((u, rig.cx), (v, rig.cy)))
    return left, cv2.remap(right, *at, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT).astype(np.uint8)


def blurred(view: Image) -> Image:
    return cv2.GaussianBlur(view, (0, 0), 1.0).astype(np.uint8, copy=False)


CHANGES: dict[str, Callable[[Image, Image], Views]] = {
    "as they are": lambda left, right: (left, right),
    "mirrored": lambda left, right: (right[:, ::-1].copy(), left[:, ::-1].copy()),
    "half as large": both(partial(resized, times=0.5)),
    "1.5 times as large": both(partial(resized, times=1.5)),
    "without the upper 90 rows": both(lambda view: view[90:]),
    "without the upper half": both(lambda view: view[187:]),
    "without 200 columns at each side": both(lambda view: view[:, 200:-200]),
    f"without the lower {CUT} rows": both(lambda view: view[:-CUT]),
    "noise of 4 grey levels": both(partial(noisy, sigma=4.0)),
    "noise of 8 grey levels": both(partial(noisy, sigma=8.0)),
    "JPEG of quality 50": both(packed),
    "blurred by 1 px": both(blurred),
    "a quarter as bright": both(lambda view: view // 4),
    "an eighth as bright, noise of 1": both(lambda view: noisy(view / 8, sigma=1.0)),
    "16 bits, lamps ten times as bright": both(with_lamps),
    "a quarter of the contrast, hazy": both(lambda view: view // 4 + 150),
    **{
        f"right view {100 * share:+.1f} % larger": right_alone(partial(seen_by, larger_percent=100 * share))
        for share in (0.001, 0.002, 0.003, 0.005, -0.002, -0.005)
    },
    **{
        f"right view {way} {degrees:+.1f} degrees": right_alone(
            partial(seen_turned, focal=FOCAL, **{f"{way}_deg": degrees})
        )
        for way in ("yaw", "pitch")
        for degrees in (0.1, -0.1, 0.3, -0.3)
    },
    **{
        f"right view roll {degrees:+.1f} degrees": right_alone(partial(seen_by, clockwise_deg=degrees))
        for degrees in (0.1, -0.1, 0.3, -0.3)
    },
    **{
        f"right view {100 * metres:+.0f} cm ahead": partial(seen_ahead, metres=metres)
        for metres in (0.01, -0.01, 0.03, -0.03)
    },
}


class Outcome(NamedTuple):
    """An angle, its half-width and the lane's, degrees."""

    roll: float
    half_width: float
    ok: bool
    lane: Lane

    @property
    def off(self) -> float:
        """How far it is off the lane's range."""
        return max(0.0, self.lane[0] - self.roll, self.roll - self.lane[1])


def outcome(estimate: RollEstimate, lane: Lane, way: int = 1) -> Outcome:
    return Outcome(way * estimate.roll_deg, estimate.roll_ci95_deg or 0.0, estimate.status == "ok", lane)


def shown_lane(sweep: NDArray[np.float64]) -> Lane | None:
    """Fit the lane to a sweep: three widths and lengths, with and without camber; None: it tells little."""
    v, u = np.nonzero(sweep)
    rig = read_calibration(LIDAR / "calib.txt")
    assert rig.baseline is not None
    ahead = rig.fx * rig.baseline / sweep[v, u]
    across, down = (u - rig.cx) * ahead / rig.fx, (v - rig.cy) * ahead / rig.fx
    rolls = []
    for half_width in (0.8, 1.2, 1.6):
        for farthest in (15, 20, 25):
            some = (np.abs(across) < half_width) & (ahead < farthest) & (down > 0.8) & (down < 3)
            if np.count_nonzero(some) < 60:
                return None
            x, y, z = across[some], down[some], ahead[some]
            design = np.stack([np.ones_like(x), x, z, z * z, x * x], 1)
            rolls += [math.degrees(math.atan(robust(design[:, :columns], y)[1])) for columns in (4, 5)]
    return None if max(rolls) - min(rolls) > 1 else (min(rolls), max(rolls))


def robust(design: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit by least squares with Tukey's weights."""
    root = np.ones(len(values))
    for _ in range(30):
        found: NDArray[Any] = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        off = values - design @ found
        spread = 1.4826 * np.median(np.abs(off)) + 1e-4
        root = np.maximum(0, 1 - np.square(off / (4 * spread)))
    return found


def rows_of(lanes: dict[str, Lane]) -> Iterator[tuple[str, dict[str, Outcome]]]:
    """Yield each kind of views, and what is found of each frame that has an angle."""
    views = {
        name: tuple(read_image(LIDAR / side / f"{name}.png") for side in ("left", "right")) for name in lanes
    }
    sweeps = {name: read_image(LIDAR / "sweep" / f"{name}.png") / 256 for name in lanes}
    shown = {name: lane for name, sweep in sweeps.items() if (lane := shown_lane(sweep[:-CUT]))}
    for title, change in CHANGES.items():
        way = -1 if title == "mirrored" else 1
        found = dict[str, Outcome]()
        for name, lane in lanes.items():
            try:
                found[name] = outcome(estimate_pair(*change(*views[name])), lane, way)
            except RollcliError as error:
                print(f"{title}, {name}: {error}", file=sys.stderr)
        yield title, found
        if title.endswith(f"lower {CUT} rows"):
            yield (
                "the same, the lane that is shown",
                {name: one._replace(lane=shown[name]) for name, one in found.items() if name in shown},
            )
    for title, cut, of in (
        ("sweeps", 0, lanes),
        (f"sweeps without the lower {CUT} rows", CUT, lanes),
        ("the same, the lane that is shown", CUT, shown),
    ):
        maps = {name: sweeps[name][: len(sweeps[name]) - cut] for name in of}
        yield title, {name: outcome(estimate_roll(maps[name]), lane) for name, lane in of.items()}


def main() -> None:
    """Print one table."""
    if not LIDAR.is_dir():
        print(f"left out: {LIDAR} is not there")
        return
    cv2.setNumThreads(1)
    step = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    with (LIDAR / "reference.csv").open() as file:
        lanes = {row["frame"]: (float(row["lo_deg"]), float(row["hi_deg"])) for row in csv.DictReader(file)}
    lanes = dict(list(lanes.items())[::step])
    columns = (
        "views",
        "angles",
        "suspect",
        "off, median",
        "95 %",
        "ok above 0.25",
        "mean",
        "covered",
        "moved",
    )
    print(f"| {' | '.join(columns)} |")
    print("|---" * len(columns) + "|")
    before = dict[str, Outcome]()
    for title, found in rows_of(lanes):
        before = before or found
        every = list(found.values())
        ok, off = [each for each in every if each.ok], [each.off for each in every]
        error = np.mean([each.roll - sum(each.lane) / 2 for each in ok]) if ok else math.nan
        pairs = [(each, before[name]) for name, each in found.items() if each.ok and name in before]
        moved = sum(abs(now.roll - was.roll) > 0.1 for now, was in pairs if was.ok)
        covered = np.mean([each.off <= each.half_width for each in every])
        wrong = sum(each.off > 0.25 for each in ok)
        print(
            f"| {title} | {len(every)} | {len(every) - len(ok)} | {np.median(off):.3f} | "
            f"{np.percentile(off, 95):.2f} | {wrong} | {error:+.3f} | {covered:.2f} | {moved} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
