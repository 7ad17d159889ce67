"""Constant plateaus at the ends of a map's numbers: what a matcher writes for pixels that it did not match.

OpenCV writes the disparity before its range, which is a positive one where the range begins at 2 or later; a
range that is too short, eight bits that overflow and a far end of depths pile up at the last number.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class PlateauTuning:
    """What makes a plateau of the first or the last number of a map.

    Of 105 real maps of five matchers none has one: their ends hold 7 % of the pixels at most, and then 1.7
    times as many as the number beside it, for whole pixels are steps. OpenCV's mark fills 20 to 50 % of the
    maps that have it, the first disparity of its range 2 to 11 %, and each number beside that 0.2 %.

    Attributes
    ----------
    share : float
        Of the pixels with data; fewer do no harm.
    times : float
        As many as of the number beside it, or that as many as of the next one.
    edge : float
        Of `share`, in the second case: how many the number beside it must be.
    every : int
        Take each such row and column: enough for shares.
    least : int
        Pixels with data that tell shares, among those taken.
    """

    share: float = 0.05
    times: float = 4.0
    edge: float = 0.2
    every: int = 4
    least: int = 100


TUNING = PlateauTuning()


def without_plateaus(disparity: NDArray[Any]) -> str:
    """Set constant plateaus at the ends of the range to 0, which is no data, in place; say what was set.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.

    Returns
    -------
    str
        Empty where there is none.
    """
    few = disparity[:: TUNING.every, :: TUNING.every]
    few = few[few > 0]
    if few.size < TUNING.least:
        return ""
    said = []
    for which, end in (("smallest", np.min), ("largest", np.max)):
        found = _plateau(few, end)
        for value in found:
            disparity[disparity == value] = 0
        if found:
            share = np.isin(few, found).mean()
            said.append(
                f"{share:.0%} of the disparities are the {which}, {found[0]:g} px: they are taken as no data"
            )
    return "; ".join(said)


def _plateau(values: NDArray[Any], end: Callable[[NDArray[Any]], Any]) -> list[Any]:
    """Return what makes a plateau, from the end on: nothing, one number, or a mark and the range's edge."""
    least, ends, counts = TUNING.share * values.size, list[Any](), list[int]()
    while len(ends) < 3 and values.size:
        ends.append(end(values))
        rest = values[values != ends[-1]]
        counts.append(values.size - rest.size)
        if counts[0] < least:
            return []
        values = rest
    if len(ends) < 3:  # of a map of a few numbers, shares tell nothing
        return []
    of_one, of_two = (counts[place] > TUNING.times * counts[place + 1] for place in (0, 1))
    return ends[:2] if of_two and counts[1] > TUNING.edge * least else ends[:1] if of_one else []
