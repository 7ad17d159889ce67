"""How far to search: the disparity range of a pair, found by matching it small."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Matcher = Callable[[float], NDArray[Any]]
"""The disparity map, in pixels with 0 for no data, of a search as wide as given, pixels."""

_ROUNDS = 4
_MIN_SHARE = 0.01  # of the pixels, to say anything


class Range(NamedTuple):
    """The largest disparity of a pair, outliers aside, and the map that shows it."""

    top: float
    disparity: NDArray[Any]


def largest_disparity(match: Matcher, width: int, start: float | None = None) -> Range | None:
    """Find the largest disparity of a pair, and a map of what may be believed.

    Parameters
    ----------
    match : callable
        Matches the pair within a range.
    width : int
        Of the images, pixels.
    start : float, optional
        About how large it is; None: find that, too.

    Returns
    -------
    Range or None
        Pixels; None where nothing can be matched.

    Notes
    -----
    A search over half the width finds any disparity that a pair can have, but leaves out the left half of
    the image. What it finds starts a narrower one, which grows for as long as it meets its end. Where there
    is nothing to match, any candidate wins, and with more of them another one: so only what a search twice as
    wide finds too is believed.
    """
    top = rough_largest(match, width) if start is None else start
    found = None
    for _ in range(_ROUNDS):
        if top is None:
            return None
        searched = 1.4 * top + 4
        narrow, wide = match(searched), match(min(2 * searched, width / 2))
        believed = np.where(np.abs(narrow - wide) < 1, narrow, 0)
        top = _top(believed, 99)
        found = None if top is None else Range(top, np.where(wide > 0, believed, narrow))
        if top is not None and top < 0.85 * searched:
            break
    return found


def rough_largest(match: Matcher, width: int) -> float | None:
    """Find about how large disparities get, by one search over half the width; None where none is found."""
    return _top(match(width / 2), 98)


def _top(disparity: NDArray[Any], percentile: float) -> float | None:
    valid = disparity[disparity > 0]
    return float(np.percentile(valid, percentile)) if valid.size > _MIN_SHARE * disparity.size else None
