"""The method as the paper writes it: n x 3 matrices over every pixel, built anew at each angle.

This is what the solvers on moments are timed and checked against; nothing else uses it.
[GD]: Fan, Wang, Liu, Pitas, "A Robust Roll Angle Estimation Algorithm Based on Gradient Descent",
arXiv:1906.01894.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.solvers.golden_section import shrink_bracket
from rollcli.estimator.solvers.solution import Solution, SolverStatus, principal

_MAX_ITERATIONS = 100


@dataclass(frozen=True)
class Textbook:
    """The valid pixels of a map as columns of numbers. Make it with `Textbook.of`.

    Attributes
    ----------
    u, v : ndarray, shape (n,)
        Coordinates, moved to the centre of the map and divided by half its longer side.
    d : ndarray, shape (n,)
        Disparity, px.
    """

    u: Floats
    v: Floats
    d: Floats

    @classmethod
    def of(cls, disparity: NDArray[Any]) -> "Textbook":
        """Take every valid pixel of a map (H, W)."""
        grid = Grid.of_shape(*disparity.shape)
        rows, columns = np.nonzero((disparity > 0) & (disparity < np.inf))
        u, v = columns.astype(np.float64), rows.astype(np.float64)
        return cls(
            (u - grid.centre_u) / grid.scale,
            (v - grid.centre_v) / grid.scale,
            disparity[rows, columns].astype(np.float64),
        )

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

    def gradient_descent(self, tolerance: float, lambda0: float) -> Solution:
        """Descend from 0 by [GD eq. 11 and 14], unguarded, until a step is shorter than `tolerance`."""
        unit = 1 / (2 * len(self.d) * float(self.d.max()) ** 2)
        theta, rate, slope = 0.0, lambda0, unit * self.gradient(0.0)
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
        """Return J d = (Y'Y)^-1 Y'd [GD eq. 7]."""
        return np.asarray(np.linalg.solve(Y.T @ Y, Y.T @ self.d), np.float64)
