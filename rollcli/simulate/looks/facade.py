"""House fronts: plaster, plinths, windows and doors."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.looks.texture import Values, band, bars, cell, coarse, fine

_RIM = np.float32(0.1)  # the width of window frames, metres


@dataclass(frozen=True)
class Facade:
    """A row of houses; p runs along the street, q up from the sidewalk.

    House i stands between edges[i] and edges[i + 1]. It has an albedo, a tint (N, 3), a height of its storeys
    and a width of its bays, both in metres; each bay of a storey has one window.
    """

    offset: float
    edges: Values
    levels: Values
    tints: Values
    storeys: Values
    bays: Values

    def _house(self, p: Values) -> NDArray[Any]:
        return np.clip(np.searchsorted(self.edges, p) - 1, 0, len(self.levels) - 1)

    def colour(self, p: Values, q: Values) -> Values:
        return np.asarray(self.tints[self._house(p)])

    def albedo(self, p: Values, q: Values, w: Values) -> Values:
        house = self._house(p)
        level, storey, bay = self.levels[house], self.storeys[house], self.bays[house]
        grain, blotch = fine(p, q, w, self.offset), coarse(p, q, w, self.offset)
        wall = level * np.maximum(1 + np.float32(0.07) * grain + np.float32(0.12) * blotch, np.float32(0.2))
        along, up = (p - self.edges[house]) / bay, q / storey
        column, row = np.floor(along), np.floor(up)
        x, y, own = (along - column) * bay, (up - row) * storey, cell(column + 31 * house, row)
        # one bay in six of the ground floor has a door instead of a window
        door = (row == 0) & (own < 0.17)
        low = np.where(door, np.float32(-1), np.float32(0.31) * storey)
        left, right, high = 0.30 * bay, 0.70 * bay, 0.79 * storey
        glass = band(x, left, right, w) * band(y, low, high, w)
        frame = band(x, left - _RIM, right + _RIM, w) * band(y, low - _RIM, high + _RIM, w) - glass
        glass *= 1 - 0.8 * band(x, 0.49 * bay, 0.51 * bay, w)
        pane = (0.04 + 0.2 * own * y / storey) * (1 + 0.5 * np.clip(blotch, -1, 1))
        wall += np.maximum(frame, 0) * (np.float32(0.65) - wall)
        wall += glass * (np.where(door, np.float32(0.12), pane) - wall)
        wall *= 1 - 0.35 * band(q, -9.0, 0.5, w) * (1 - glass)
        wall *= 1 - 0.2 * bars(q + np.float32(0.1), 3.1, 0.14, w)
        return np.asarray(np.maximum(wall, np.float32(0.02)), np.float32)
