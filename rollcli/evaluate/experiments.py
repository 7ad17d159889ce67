"""The paper's experiments on one map: accuracy, rotations, and run times (Tables I and II, Figs. 3 and 6)."""

import math
import timeit
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.energy import Energy
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.moments import CheckedMap, Floats, Grid, map_moments
from rollcli.estimator.request import AREAS, LAMBDA0, MAX_ROLL_LIMIT_DEG, SOLVERS, Request
from rollcli.estimator.solvers.areas import AreaMethod
from rollcli.estimator.solvers.exact import exact, minima
from rollcli.estimator.solvers.golden_section import golden_section, shrink_bracket
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from rollcli.estimator.solvers.solution import Solution, Solver, SolverStatus, angle_between, principal
from rollcli.evaluate.options import PaperOptions
from rollcli.evaluate.truth import KnownPose
from rollcli.files.inputs import stem_of
from rollcli.files.results import Row
from rollcli.run.frame import Frame, FrameResult
from rollcli.run.read import FRAME_ERRORS, Source, frame_of_error, read_source


def rotate_nearest(disparity: NDArray[Any], angle: float) -> NDArray[Any]:
    """Turn a map about its centre so that its roll grows by `angle`; the nearest pixel gives the value.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    angle : float
        Radians.

    Returns
    -------
    ndarray, shape (H', W')
        Large enough to keep the corners: an estimate that does not follow by `angle` was moved by the
        rounding of coordinates, not by a loss of pixels. No data is 0.
    """
    height, width = disparity.shape
    c, s = math.cos(angle), math.sin(angle)
    new_width = math.ceil(abs(width * c) + abs(height * s) - 1e-9)
    new_height = math.ceil(abs(width * s) + abs(height * c) - 1e-9)
    u, v = np.arange(new_width) - (new_width - 1) / 2, np.arange(new_height) - (new_height - 1) / 2
    columns = np.rint(np.add.outer(v * s, u * c) + (width - 1) / 2).astype(np.int32)
    rows = np.rint(np.add.outer(v * c, -u * s) + (height - 1) / 2).astype(np.int32)
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    rotated = np.zeros((new_height, new_width), disparity.dtype)
    rotated[inside] = disparity[rows[inside], columns[inside]]
    return rotated


DELTAS = tuple(math.pi / k for k in (1.8e3, 1.8e4, 1.8e5, 1.8e6))
LAMBDAS = tuple(float(rate) for rate in range(1, 101))


@dataclass(frozen=True)
class Findings:
    """What the experiments say about one map; angles in radians.

    Attributes
    ----------
    file : str
    width, height, pixels : int
        Of the map, and how many of its pixels are valid.
    theta : float
        The exact minimum.
    gss, gd : tuple of int
        Iterations for each of `DELTAS` (Table I).
    sweep : tuple of tuple
        Iterations of gd for each of `DELTAS` and `LAMBDAS` (Fig. 3); None where it ended farther than
        delta from every minimum: a small rate makes the first steps shorter than delta.
    solver_errors : dict of str to tuple
        For each of `SOLVERS`, per rotation, the error for each of `DELTAS` (Fig. 6).
    method_errors : dict of str to tuple
        For gd, line, plane, areas and auto, per rotation, the error, or None where the method found no angle.
    """

    file: str
    width: int
    height: int
    pixels: int
    theta: float
    gss: tuple[int, ...]
    gd: tuple[int, ...]
    sweep: tuple[tuple[int | None, ...], ...]
    solver_errors: dict[str, tuple[tuple[float, ...], ...]]
    method_errors: dict[str, tuple[float | None, ...]]


def examine(
    file: str, disparity: NDArray[Any], turns: Sequence[float], truth: float | None, *, chosen: bool
) -> Findings:
    """Run every experiment but the run times on one map.

    Parameters
    ----------
    file : str
        What the map is called.
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    turns : sequence of float
        The angles that the map is rotated by, radians.
    truth : float or None
        The map's known roll, radians. Without it, an estimate is held against the exact minimum of the map
        before it was rotated, and that of a method which does not solve this energy against its own.
    chosen : bool
        The valid pixels are the chosen area of the method "plane".

    Returns
    -------
    Findings

    Raises
    ------
    EstimationError
        The pixels do not determine an angle.
    """
    energy, (height, width) = _energy(disparity), disparity.shape
    theta = exact(energy).theta
    rotated = [rotate_nearest(disparity, turn) for turn in turns]
    energies = [_energy(each) for each in rotated]

    def method_errors(method: Callable[[NDArray[Any]], float]) -> tuple[float | None, ...]:
        base = _angle(method, disparity) if truth is None else truth
        found = [_angle(method, each) for each in rotated]
        return tuple(
            None if base is None or angle is None else angle_between(angle, base + turn)
            for angle, turn in zip(found, turns, strict=True)
        )

    def solver_errors(solve: Solver) -> tuple[tuple[float, ...], ...]:
        base = theta if truth is None else truth
        return tuple(
            tuple(angle_between(solve(each, Request(tolerance=delta)).theta, base + turn) for delta in DELTAS)
            for each, turn in zip(energies, turns, strict=True)
        )

    methods = _methods(max(map(abs, turns), default=0.0), chosen)
    return Findings(
        file=file,
        width=width,
        height=height,
        pixels=round(energy.weight),
        theta=theta,
        gss=tuple(golden_section(energy, Request(tolerance=delta)).iterations for delta in DELTAS),
        gd=tuple(gradient_descent(energy, Request(tolerance=delta)).iterations for delta in DELTAS),
        sweep=_sweep(energy),
        solver_errors={name: solver_errors(each.load()) for name, each in SOLVERS.items()},
        method_errors={name: method_errors(method) for name, method in methods.items()},
    )


def _energy(disparity: NDArray[Any], *, parabolic: bool = True) -> Energy:
    return Energy.of(map_moments(disparity), parabolic=parabolic)


def _sweep(energy: Energy) -> tuple[tuple[int | None, ...], ...]:
    ends = [minimum.theta for minimum in minima(energy)]

    def iterations(delta: float, rate: float) -> int | None:
        found = gradient_descent(energy, Request(tolerance=delta, lambda0=rate))
        return found.iterations if min(angle_between(found.theta, end) for end in ends) <= delta else None

    return tuple(tuple(iterations(delta, rate) for rate in LAMBDAS) for delta in DELTAS)


def _methods(largest_turn: float, chosen: bool) -> dict[str, Callable[[NDArray[Any]], float]]:
    """Return each method as a function from a map to its angle."""
    further = max(0.0, largest_turn - math.radians(20))
    request = Request(max_roll=min(math.radians(MAX_ROLL_LIMIT_DEG), Request.max_roll + further))

    def by_areas(name: str, disparity: NDArray[Any]) -> float:
        checked = CheckedMap.of(disparity, None)
        choose: AreaMethod = AREAS[name].load()
        return choose(checked.values, checked.valid, request, chosen).solution.theta

    return {
        "gd": lambda disparity: gradient_descent(_energy(disparity), Request(tolerance=DELTAS[-1])).theta,
        "line": lambda disparity: exact(_energy(disparity, parabolic=False)).theta,
        "plane": partial(by_areas, "plane"),
        "areas": partial(by_areas, "areas"),
        "auto": lambda disparity: estimate_roll(disparity, request).theta,
    }


def _angle(method: Callable[[NDArray[Any]], float], disparity: NDArray[Any]) -> float | None:
    try:
        return method(disparity)
    except EstimationError:
        return None


_MAX_ITERATIONS = 100  # of the unguarded descent


class Textbook:
    """The method as the paper writes it: n x 3 matrices over every pixel, built anew at each angle.

    The solvers on moments are timed and checked against it; nothing else uses it.
    [GD]: Fan, Wang, Liu, Pitas, "A Robust Roll Angle Estimation Algorithm Based on Gradient Descent",
    arXiv:1906.01894.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; what is not above 0 and finite is no data.

    Attributes
    ----------
    u, v : ndarray, shape (n,)
        Coordinates of the valid pixels, moved to the centre of the map and divided by half its longer side.
    d : ndarray, shape (n,)
        Disparity, px.
    """

    def __init__(self, disparity: NDArray[Any]) -> None:
        grid = Grid.of_shape(*disparity.shape)
        rows, columns = np.nonzero((disparity > 0) & (disparity < np.inf))
        self.u, self.v = grid.normalised(columns, rows)
        self.d: NDArray[Any] = disparity[rows, columns].astype(np.float64)

    def energy(self, theta: float) -> float:
        """Return E_min at `theta` [GD eq. 9], px^2."""
        Y = self._design(theta)
        residual = self.d - Y @ self._alpha(Y)
        return float(residual @ residual)

    def gradient(self, theta: float) -> float:
        """Return dE_min / dtheta [GD eq. 12-13], px^2/rad."""
        Y = self._design(theta)
        x, y = self.u * math.cos(theta) + self.v * math.sin(theta), Y[:, 1]
        turned = np.stack([np.zeros_like(x), -x, -2 * x * y], axis=1)
        alpha = self._alpha(Y)
        return float(-2 * (self.d - Y @ alpha) @ (turned @ alpha))

    def golden_section(self, tolerance: float) -> Solution:
        """Shrink a bracket of one period until it is narrower than `tolerance`, radians."""
        return shrink_bracket(self.energy, tolerance)

    def gradient_descent(self, tolerance: float) -> Solution:
        """Descend from 0 by [GD eq. 11 and 14], unguarded, until a step is shorter than `tolerance`."""
        unit = 1 / (2 * len(self.d) * float(self.d.max()) ** 2)
        theta, rate, slope = 0.0, LAMBDA0, unit * self.gradient(0.0)
        for iteration in range(1, _MAX_ITERATIONS + 1):
            step = -rate * slope
            theta += step
            if abs(step) < tolerance:
                return Solution(principal(theta), iteration)
            before, slope = slope, unit * self.gradient(theta)
            rate = rate * before / (before - slope)
        return Solution(principal(theta), _MAX_ITERATIONS, SolverStatus.STEP_LIMIT)

    def _design(self, theta: float) -> Floats:
        """Return Y(theta), shape (n, 3) [GD eq. 6]."""
        y = self.v * math.cos(theta) - self.u * math.sin(theta)
        return np.stack([np.ones_like(y), y, y * y], axis=1)

    def _alpha(self, Y: Floats) -> Floats:
        """Return J d = (Y'Y)^-1 Y'd [GD eq. 7-8]."""
        try:
            return np.asarray(np.linalg.solve(Y.T @ Y, Y.T @ self.d), np.float64)
        except np.linalg.LinAlgError:  # pixels of two rows determine no parabola
            return np.asarray(np.linalg.lstsq(Y, self.d, rcond=None)[0], np.float64)


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
    energy, textbook = _energy(disparity), Textbook(disparity)

    def timed(solve: Callable[[float], Solution], times: int) -> tuple[float, ...]:
        return tuple(_best(partial(solve, delta), times) for delta in DELTAS)

    def alone(solve: Solver, delta: float) -> Solution:
        return solve(energy, Request(tolerance=delta))

    def with_pass(solve: Solver, delta: float) -> Solution:
        return solve(_energy(disparity), Request(tolerance=delta))

    seconds: dict[tuple[str, str], tuple[float, ...]] = {}
    written = {"gss": textbook.golden_section, "gd": textbook.gradient_descent}
    for name, solve in {"gss": golden_section, "gd": gradient_descent}.items():
        seconds[name, "moments"] = timed(partial(alone, solve), 50)
        seconds[name, "with_pass"] = timed(partial(with_pass, solve), 10)
        with np.errstate(all="ignore"):  # unguarded, it may run away
            seconds[name, "textbook"] = timed(written[name], 2)
    return Times(len(textbook.d), seconds)


def _best(function: Callable[[], Any], times: int) -> float:
    """Return the seconds of the fastest of several runs."""
    return min(timeit.repeat(function, number=1, repeat=times))


Examined = tuple[FrameResult, Findings | None]  # of a map; the result says why there are no findings


def examine_file(frame: Frame, options: PaperOptions, truth: Mapping[str, KnownPose]) -> Examined:
    """Read a map and run the experiments on it; `truth` holds known angles by stem, or nothing."""
    turns = [math.radians(turn) for turn in options.turns_deg]
    try:
        source = read_source(frame, options)
        known = truth.get(stem_of(frame.file))
        theta = None if known is None else known.theta
        findings = examine(frame.file, _usable_pixels(source), turns, theta, chosen=options.has_region)
    except FRAME_ERRORS as error:
        return frame_of_error(frame, error), None
    return FrameResult(Row(frame.file, status="ok"), source.read_as, source.warnings), findings


def time_file(frame: Frame, options: PaperOptions) -> Times:
    """Read a map and time the solvers on it."""
    return time_solvers(_usable_pixels(read_source(frame, options)))


def _usable_pixels(source: Source) -> NDArray[Any]:
    """Clear the pixels of a map, shape (H, W), that may not be used: 0 is no data."""
    return np.where(True if source.allowed is None else source.allowed, source.disparity, 0)
