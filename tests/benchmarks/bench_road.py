"""Road finding beside what one would use otherwise: accuracy and time on the same maps.

    python tests/benchmarks/bench_road.py [FRAMES]

First the errors on rendered scenes matched by SGBM, half of them with rolls within +-10 degrees, half within
+-35; of seeds that no number was fitted to. Then the time on one thread beside the decoding of the same map
from a 16-bit PNG, on such maps of 1242x375 and one of 3840x2160. scikit-learn, scikit-image and Open3D (pip
install scikit-learn scikit-image open3d) are left out with a word where they are not installed.

Bars: estimate within 0.45 times the decoding at 1242x375, 0.3 times at 3840x2160.
"""

import math
import sys
import timeit
from collections.abc import Callable
from importlib.util import find_spec

from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()

import cv2
import numpy as np
from matched import Matched, matched
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request

SEEDS = (901, 902)
TIMED = {(1242, 375): 12, (3840, 2160): 1}  # size, maps
TIMED_SEED = 903
TOLERANCE = 1.0  # px, of the RANSACs
DRAWS = 500
Map = NDArray[np.float32]


def ours(disparity: Map) -> float:
    """Road finding, gradient descent, certificate and interval."""
    return estimate_roll(disparity).theta


def every_pixel(disparity: Map) -> float:
    """Least squares on every valid pixel, the global minimum."""
    return estimate_roll(disparity, Request(road="all", method="exact")).theta


def points(disparity: Map) -> NDArray[np.float64]:
    """(u, v, d) of the valid pixels, shape (N, 3)."""
    v, u = np.nonzero(disparity > 0)
    return np.stack([u, v, disparity[v, u]], 1).astype(np.float64)


def by_sklearn(disparity: Map) -> float:
    """RANSACRegressor of scikit-learn."""
    from sklearn.linear_model import RANSACRegressor

    uvd = points(disparity)
    model = RANSACRegressor(residual_threshold=TOLERANCE, max_trials=DRAWS, random_state=0)
    c1, c2 = model.fit(uvd[:, :2], uvd[:, 2]).estimator_.coef_
    return math.atan(-c1 / c2)


class Plane:
    """d = c0 + c1 u + c2 v, as scikit-image wants a model."""

    coefficients: NDArray[np.float64]

    @classmethod
    def from_estimate(cls, uvd: NDArray[np.float64]) -> "Plane":
        """Fit by least squares."""
        plane = cls()
        design = np.column_stack([np.ones(len(uvd)), uvd[:, :2]])
        plane.coefficients = np.linalg.lstsq(design, uvd[:, 2], rcond=None)[0]
        return plane

    def __bool__(self) -> bool:
        return bool(np.isfinite(self.coefficients).all())

    def estimate(self, uvd: NDArray[np.float64]) -> bool:
        """Fit by least squares, in place, as older versions ask for."""
        self.coefficients = self.from_estimate(uvd).coefficients
        return bool(self)

    def residuals(self, uvd: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances in disparity, px."""
        c0, c1, c2 = self.coefficients
        return np.abs(c0 + c1 * uvd[:, 0] + c2 * uvd[:, 1] - uvd[:, 2])


def by_skimage(disparity: Map) -> float:
    """The ransac of scikit-image."""
    from skimage.measure import ransac

    model, _ = ransac(points(disparity), Plane, 3, TOLERANCE, max_trials=DRAWS, rng=0)
    _, c1, c2 = model.coefficients
    return math.atan(-c1 / c2)


def by_open3d(disparity: Map) -> float:
    """segment_plane of Open3D."""
    import open3d

    open3d.utility.random.seed(0)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points(disparity)))
    (a, b, _, _), _ = cloud.segment_plane(TOLERANCE, 3, DRAWS)
    return math.atan2(-a, b) if abs(b) > 1e-12 else math.pi / 2


METHODS: dict[str, tuple[Callable[[Map], float], str | None]] = {
    "rollcli estimate": (ours, None),
    "every pixel, least squares": (every_pixel, None),
    "scikit-learn RANSACRegressor": (by_sklearn, "sklearn"),
    "scikit-image ransac": (by_skimage, "skimage"),
    "Open3D segment_plane": (by_open3d, "open3d"),
}


def errors(method: Callable[[Map], float], frames: list[Matched]) -> NDArray[np.float64]:
    """Absolute errors, degrees; 90 where no angle comes."""
    found = []
    for frame in frames:
        try:
            apart = math.remainder(math.degrees(method(frame.disparity)) - frame.roll_deg, 180)
        except (EstimationError, ValueError):
            apart = 90.0
        found.append(abs(apart))
    return np.array(found)


def best(call: Callable[[], object], repeat: int) -> float:
    """Seconds of the fastest of many calls."""
    return min(timeit.repeat(call, number=1, repeat=repeat))


def times(method: Callable[[Map], float], maps: list[Map], repeat: int) -> NDArray[np.float64]:
    """Milliseconds for each map, and for decoding it: shape (maps, 2)."""
    rows = []
    for disparity in maps:
        png = cv2.imencode(".png", np.rint(disparity * 256).astype(np.uint16))[1]
        decoding = best(lambda png=png: cv2.imdecode(png, cv2.IMREAD_UNCHANGED), 20)
        estimate = best(lambda disparity=disparity: method(disparity), repeat)
        rows.append((1000 * estimate, 1000 * decoding))
    return np.array(rows)


def main() -> None:
    """Print two tables."""
    cv2.setNumThreads(1)
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    frames = [
        frame for seed, span in zip(SEEDS, (10, 35), strict=True) for frame in matched(count // 2, seed, span)
    ]
    present = {}
    for name, (method, module) in METHODS.items():
        if module is not None and find_spec(module) is None:
            print(f"{name}: left out, {module} is not installed")
        else:
            present[name] = method
    print(f"{len(frames)} rendered frames, degrees: median, 95 %, worst, share above 0.5")
    for name, method in present.items():
        off = errors(method, frames)
        row = (np.median(off), np.percentile(off, 95), off.max(), (off > 0.5).mean())
        print(f"  {name:30} {row[0]:7.3f} {row[1]:7.3f} {row[2]:7.2f} {row[3]:7.2f}")
    for size, count in TIMED.items():
        maps = [frame.disparity for frame in matched(count, TIMED_SEED, 10, size)]
        print(f"{count} of {size[0]}x{size[1]}: ms, and times the decoding: in the mean, at worst")
        for name, method in present.items():
            fast = method is ours
            table = times(method, maps if fast else maps[:1], 40 if fast else 1)
            ratios = table[:, 0] / table[:, 1]
            print(f"  {name:30} {table[:, 0].mean():9.2f} {ratios.mean():8.2f} {ratios.max():8.2f}")
        print(f"  {'decoding':30} {table[:, 1].mean():9.2f}")


if __name__ == "__main__":
    main()
