"""Run times of golden section and gradient descent in three forms (Table II), on one thread."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.energy import Energy
from rollcli.estimator.methods import LAMBDA0, SolverSettings
from rollcli.estimator.moments import map_moments
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from rollcli.estimator.solvers.solution import Solution, Solver
from rollcli.evaluate.experiments import DELTAS
from rollcli.evaluate.textbook import Textbook

FORMS = ("moments", "with_pass", "textbook")


@dataclass(frozen=True)
class Times:
    """Seconds for each of `DELTAS`, by solver and form.

    The forms: on the moments alone; with the pass over the map that sums them; and with the paper's n x 3
    matrices, built anew in each iteration.
    """

    pixels: int
    seconds: dict[tuple[str, str], tuple[float, ...]]


def time_solvers(disparity: NDArray[Any]) -> Times:
    """Time both solvers in all three forms on one map (H, W), px, 0 is no data."""
    peak = float(disparity.max())
    energy, textbook = Energy.of(map_moments(disparity), peak), Textbook.of(disparity)

    def with_pass(solve: Solver, delta: float) -> None:
        solve(Energy.of(map_moments(disparity), peak), SolverSettings(delta))

    seconds: dict[tuple[str, str], tuple[float, ...]] = {}
    solvers: dict[str, Solver] = {"gss": golden_section, "gd": gradient_descent}
    written_out: dict[str, Callable[[float], Solution]] = {
        "gss": textbook.golden_section,
        "gd": partial(textbook.gradient_descent, lambda0=LAMBDA0),
    }
    for name, solve in solvers.items():
        seconds[name, "moments"] = tuple(
            _best(partial(solve, energy, SolverSettings(delta)), 50) for delta in DELTAS
        )
        seconds[name, "with_pass"] = tuple(_best(partial(with_pass, solve, delta), 10) for delta in DELTAS)
        with np.errstate(all="ignore"):  # unguarded, it may run away
            seconds[name, "textbook"] = tuple(_best(partial(written_out[name], delta), 2) for delta in DELTAS)
    return Times(len(textbook.d), seconds)


def _best(function: Callable[[], Any], times: int) -> float:
    """Return the seconds of the fastest of several runs."""
    best = math.inf
    for _ in range(times):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best
