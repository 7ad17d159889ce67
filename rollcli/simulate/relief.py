"""Unevenness of the ground: heights on a grid over the road's coordinates."""

from dataclasses import dataclass

import numpy as np

from rollcli.simulate.vectors import Array, Vectors


@dataclass(frozen=True, eq=False)
class Relief:
    """How much the ground is higher than its smooth shape, bilinear between the nodes of a grid.

    Attributes
    ----------
    heights : numpy.ndarray
        (rows along, columns across), metres; beyond its edges the ground goes on level.
    left, start : float
        Lateral position of the first column and Z of the first row, metres.
    step : float
        Distance of the nodes, metres.
    """

    heights: Array
    left: float
    start: float
    step: float

    @property
    def lowest(self) -> float:
        """The lowest height, metres."""
        return float(self.heights.min())

    @property
    def highest(self) -> float:
        """The greatest height, metres."""
        return float(self.heights.max())

    def height(self, lateral: Vectors, z: Vectors) -> Vectors:
        """Return the heights (N,) at positions (N,), metres."""
        (near, right_near), (far, right_far), across, along = self._corners(lateral, z)
        first, last = near + across * (right_near - near), far + across * (right_far - far)
        return np.asarray(first + along * (last - first))

    def slopes(self, lateral: Vectors, z: Vectors) -> tuple[Vectors, Vectors]:
        """Return the slopes (N,) to the right and ahead at positions (N,), metres per metre."""
        (near, right_near), (far, right_far), across, along = self._corners(lateral, z)
        right = (right_near - near) * (1 - along) + (right_far - far) * along
        ahead = (far - near) * (1 - across) + (right_far - right_near) * across
        return right / self.step, ahead / self.step

    def _corners(
        self, lateral: Vectors, z: Vectors
    ) -> tuple[tuple[Vectors, Vectors], tuple[Vectors, Vectors], Vectors, Vectors]:
        """Return the heights around positions, near and far, left and right, and where these lie between."""
        rows, columns = self.heights.shape
        across = np.clip((lateral - self.left) / self.step, 0, columns - 1.001)
        along = np.clip((z - self.start) / self.step, 0, rows - 1.001)
        column, row = across.astype(np.intp), along.astype(np.intp)
        node, flat = row * columns + column, self.heights.ravel()
        near = flat.take(node), flat.take(node + 1)
        far = flat.take(node + columns), flat.take(node + columns + 1)
        return near, far, across - column, along - row
