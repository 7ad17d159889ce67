"""The frame of a jump: what was found in cells of several frames is looked at more and more closely."""

import numpy as np

from rollcli.rig.sequence.cells import make_cells
from rollcli.rig.sequence.jumps import Fit, Series
from rollcli.rig.sequence.tuning import TUNING

_SIDE = 3  # cells on each side that are looked at again
_FEWEST = 60  # frames on each side: what is beside a jump tells its levels


def place_jump(series: Series, found: Fit, place: int, width: int) -> int:
    """Return the first frame after a jump.

    Parameters
    ----------
    series : Series
        Frames.
    found : Fit
        The jumps, in cells of `width` frames each.
    place : int
        Which of its jumps.
    width : int
        How many frames were averaged before the search.

    Returns
    -------
    int
        Between the neighbouring jumps.
    """
    firsts = found.cells.first * width
    cell = int(firsts[1] - firsts[0]) if len(firsts) > 1 else width
    starts = [int(firsts[each]) for each in found.starts]
    bounds = [0, *starts, len(series.values)]
    low, start, high = bounds[place] + 1, bounds[place + 1], bounds[place + 2] - 1
    phi = found.noise.phi ** (1 / width)
    reach = 2 * round(found.noise.correlation_time * width)
    while cell > 1:
        side = max(_SIDE * cell, reach, _FEWEST)
        begin, end = max(low - 1, start - side), min(high + 1, start + side)
        finer = max(1, min(cell // 2, -(-(end - begin) // TUNING.cells)))
        part = slice(begin, end)
        weights = np.where(series.used[part], 1 / (series.variances[part] + found.slow_variance), 0.0)
        white = found.white_scale * series.variances[part]
        cells = make_cells(series.values[part], weights, white, found.slow_variance, phi, finer)
        gains = cells.gains(cells.design((), False))
        near = np.abs(cells.first + begin - start) <= max(1.5 * cell, reach / 2)
        inside = near & (cells.first + begin >= low) & (cells.first + begin <= high)
        if not inside.any():
            break
        start = int(cells.first[int(np.where(inside, gains, -1.0).argmax())]) + begin
        cell, reach = finer, 0
    return start
