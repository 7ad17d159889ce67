"""Speed of the estimator, beside the paper's n x 3 form.

    python tests/benchmarks/bench_estimator.py

Times are the best of many; ratios compare within this run. Bars: the moments within 8 times np.sum of the
same float32 map at 1242x375; energy, gradient and curvature together within 100 microseconds at any size;
exact within 1 ms; the n x 3 form more than 100 times slower.
"""

import sys
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from rollcli.estimator.energy import Energy
from rollcli.estimator.moments import map_moments
from rollcli.estimator.request import DEFAULT_REQUEST
from rollcli.estimator.solvers.areas import iterative
from rollcli.estimator.solvers.exact import exact
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from rollcli.evaluate.experiments import Textbook

SIZES = ((640, 480), (1242, 375), (1920, 1080), (1730, 1028))


def road(width: int, height: int) -> np.ndarray:
    """A rolled road with noise and holes, px."""
    rng = np.random.default_rng(0)
    v, u = np.mgrid[:height, :width]
    disparity = 20 + 0.1 * v - 0.01 * u + 1e-5 * v * v + rng.normal(0, 0.3, v.shape)
    disparity[rng.random(disparity.shape) < 0.2] = 0
    return disparity.astype(np.float32)


def best(function: Callable[[], Any], seconds: float = 0.5) -> float:
    """Milliseconds of the fastest of the runs that fit into `seconds`, and of the first."""
    once = timeit.timeit(function, number=1)
    runs = min(2000, int(seconds / max(once, 1e-6)))
    return 1e3 * min([once, *timeit.repeat(function, number=1, repeat=runs)])


def measure(width: int, height: int) -> dict[str, float]:
    """Every figure of one size, milliseconds."""
    disparity = road(width, height)
    energy = Energy.of(map_moments(disparity))
    textbook = Textbook(disparity)
    figures = {
        "np.sum of the map": best(lambda: disparity.sum()),
        "moments of the map": best(lambda: map_moments(disparity)),
        "E, gradient and curvature": best(lambda: energy.at(0.1)),
        "exact": best(lambda: exact(energy)),
        "gd": best(lambda: gradient_descent(energy)),
        "gss": best(lambda: golden_section(energy)),
        "areas, with its pass": best(lambda: iterative(disparity, disparity > 0, DEFAULT_REQUEST, False)),
        "n x 3: E": best(lambda: textbook.energy(0.1)),
        "n x 3: gradient": best(lambda: textbook.gradient(0.1)),
        "n x 3: gd": best(lambda: textbook.gradient_descent(DEFAULT_REQUEST.tolerance)),
        "n x 3: gss": best(lambda: textbook.golden_section(DEFAULT_REQUEST.tolerance)),
    }
    figures["moments / np.sum"] = figures["moments of the map"] / figures["np.sum of the map"]
    figures["n x 3 gradient / E, gradient and curvature"] = (
        figures["n x 3: gradient"] / figures["E, gradient and curvature"]
    )
    figures["n x 3 gd / moments and gd"] = figures["n x 3: gd"] / (
        figures["moments of the map"] + figures["gd"]
    )
    figures["n x 3 gd / gd"] = figures["n x 3: gd"] / figures["gd"]
    figures["n x 3 gss / gss"] = figures["n x 3: gss"] / figures["gss"]
    return figures


def main() -> None:
    """Print one table, sizes across."""
    columns = [measure(*size) for size in SIZES]
    print(f"{'milliseconds, or ratio':44}" + "".join(f"{f'{w}x{h}':>12}" for w, h in SIZES))
    for name in columns[0]:
        digits = 1 if "/" in name else 4
        print(f"{name:44}" + "".join(f"{column[name]:12.{digits}f}" for column in columns))


if __name__ == "__main__":
    main()
