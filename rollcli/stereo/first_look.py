"""A first look at a pair, on small views: how far to search, and how the right view lies."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.stereo.alignment import Approach, Measured, SmallViews, Texture, level, measure_misalignment
from rollcli.stereo.misalignment import LEVEL, Misalignment, Tolerance
from rollcli.stereo.options import StereoOptions
from rollcli.stereo.sgbm import NARROWEST, match_views, usable_range
from rollcli.stereo.views import Map, Views, shrink_both, size_factor

_RANGE_ROUNDS = 4
# Times the largest disparity that are searched; and the share of these within which it has to lie
_BEYOND, _WITHIN = 1.4, 0.85
_MIN_SHARE = 0.01  # of the pixels, to say anything
# Share of the pixels that a wider range finds, too: 0.36 and more of real pairs, 0.24 of rendered ones with a
# bare sky; 0.10 to 0.17 where another range is right
_HARDLY_BELIEVED = 0.2
# Share of the pixels that are found over the range that views of half the size have shown: from here on no
# wider range is searched. Of 640x480 pairs that takes 7 % of their time. Of 1,400 warped ones as many are off
# by 0.1 degrees, or doubted, as with it
_PLAIN = 0.3


@dataclass(frozen=True)
class SmallMatch:
    """A match of small views; pixels of these.

    Attributes
    ----------
    top : float
        The largest disparity, outliers aside.
    disparity : ndarray of float32
        The map.
    believed : float
        Share of the pixels that are found, where a wider range was searched over that, too.
    measured : Measured or None
        How the right view lies; None where it was not measured, or cannot be told.
    """

    top: float
    disparity: Map
    believed: float
    measured: Measured | None = None


_PIXELS = 16_000  # of the views that are looked at
_OPTIONS = StereoOptions(mode="3way", speckle_size=50, speckle_range=1)
_ROUNDS = 6
_NEAR = 0.25  # of the width: beyond it, so much of a view is hidden that half its size shows too little
# px of the small view, anywhere: the end. Larger views show what is left; with 0.6 pairs that are not level
# are looked at once more, 4 % of their time, and no angle is better; with 1.3 two more of 260 are doubted
_STEP = 1.0
# Of measuring at larger views: rounds, and one block of so many. All blocks come no nearer to what is
# measured after the match; after three rounds a few more streets are matched twice
_CLOSER_ROUNDS, _CLOSER_EVERY = 4, 2
_MARGIN = 1.1  # beyond the largest disparity seen, to search
# Of small views, which tell a scale to 0.2 %: level pairs need no closer look. Real rigs twist more
_AS_GOOD_AS_LEVEL = Tolerance(
    offset=0.15, rotation=0.0005, scale=0.002, twist=0.4, tilt=0.3, curve=0.3, sure=2.0
)
# px of the whole view; standard error of the offset. Above it small views cannot tell: 0.21 and more in dark
# streets that are 0.3 px off, up to 0.11 on level roads of fine grain
_TELLING_ERROR = 0.15
# From a start 3 px off, a view of little texture can end at an offset and a scale that deny each other. Its
# scale tells, with blocks that do not agree or a larger view that does not: other starts then show which
# leaves less. Of 288 warped pairs, wrong ends had errors from 0.018 px or steps from 1.4 px on; of the right
# ones of such a scale, nine in ten had less
_UNSURE_SCALE = 0.003
_UNSURE_ERROR = 0.014  # px of the whole view; standard error of the offset
_UNSURE_STEP = 1.2  # px of the whole view, anywhere; from what small views said
_STARTS = (-4.0, 4.0)  # px of the whole view; offset of the further attempts


@dataclass(frozen=True)
class FirstLook:
    """What small views say about a pair, in pixels of the whole ones.

    Attributes
    ----------
    range : int or None
        Disparities from 0 to this are worth a search; None where nothing was matched.
    measured : Measured or None
        How the right view lies; None where that cannot be told, or was not asked.
    disparity : ndarray of float32, or None
        The small map, in its own pixels; None where nothing was matched.
    """

    range: int | None
    measured: Measured | None
    disparity: Map | None = None


def look_for_range(views: Views) -> FirstLook:
    """Find the range of a pair alone: how its right view lies is not measured."""
    factor = size_factor(views[0].shape, _PIXELS)
    return _seen(_match_small(shrink_both(views, factor)), factor, None)


def first_look(small: SmallViews) -> FirstLook:
    """Find the range of a pair, and how its right view lies, coarse to fine."""
    factor = size_factor(small.shape, _PIXELS)
    views = shrink_both(small.whole, factor)
    texture = Texture.of(views)
    first = _look(views, texture, LEVEL)
    seen = None if first is None or first.measured is None else first.measured.resized(factor)
    telling = seen is not None and seen.errors.offset <= _TELLING_ERROR
    if seen and telling and _AS_GOOD_AS_LEVEL.allows(seen.misalignment, seen.errors, small.shape):
        return _seen(first, factor, replace(seen, misalignment=LEVEL))  # as far as small views tell
    first = _climb(views, texture, LEVEL, first)
    look, sure = _closer(small, first, factor)
    if sure:
        return look
    starts = (Misalignment(offset / factor) for offset in _STARTS)
    attempts = [first, *(_climb(views, texture, start) for start in starts)]
    # the attempt that leaves the least unexplained, of those that tell anything
    clearest = min(
        filter(None, attempts),
        key=lambda each: each.measured.spread if each.measured else math.inf,
        default=None,
    )
    return look if clearest is first else _closer(small, clearest, factor)[0]


def _closer(small: SmallViews, found: SmallMatch | None, factor: float) -> tuple[FirstLook, bool]:
    """Measure at larger views, from where those that are `factor` times smaller have ended; is it sure?"""
    if found is None or found.measured is None:
        return _seen(found, factor, None), False
    coarse = found.measured.resized(factor)
    measured = small.measure(found.disparity, coarse.misalignment, _CLOSER_ROUNDS, _CLOSER_EVERY)
    return _seen(found, factor, measured), _is_sure(coarse, measured, small.shape)


def _is_sure(coarse: Measured, measured: Measured | None, shape: tuple[int, ...]) -> bool:
    if measured is None:
        return False
    if abs(measured.misalignment.scale) < _UNSURE_SCALE:
        return True
    step = (measured.misalignment - coarse.misalignment).reach(*shape)
    return measured.errors.offset < _UNSURE_ERROR and step < _UNSURE_STEP


def _climb(
    views: Views, texture: Texture, start: Misalignment, first: SmallMatch | None = None
) -> SmallMatch | None:
    """Level, match and measure in turn, until the right view lies still; `first` is what `start` gave."""
    shape = views[0].shape
    found, at, approach = None, start, Approach(shape)
    for _ in range(_ROUNDS):
        before, found, first = found, first or _look(views, texture, at, found), None
        if found is None or found.measured is None:
            return found or before
        step = (found.measured.misalignment - at).reach(*shape)
        if step < _STEP:
            return found
        at = approach.next(at, found.measured.misalignment)
    return found


def _look(
    views: Views, texture: Texture, at: Misalignment, before: SmallMatch | None = None
) -> SmallMatch | None:
    """Level, match and measure once; `before` knows how far to search."""
    levelled = views[0], level(views[1], at)
    matched = (before and _match_again(levelled, before.top)) or _match_small(levelled)
    return matched and replace(matched, measured=measure_misalignment(texture, matched.disparity, at))


def _match_again(views: Views, top: float) -> SmallMatch | None:
    """Match over the range that another match has shown to be enough; None where it is not."""
    searched = _BEYOND * top + 4
    return _enough(_match(views, searched), searched)


def _enough(disparity: Map, searched: float) -> SmallMatch | None:
    """Take a map over this range; None where hardly anything is found, or disparities crowd at its end."""
    top = _top(disparity, 99)
    if top is None or top > _WITHIN * searched:
        return None
    return SmallMatch(top, disparity, _known(disparity))


def _match_small(views: Views) -> SmallMatch | None:
    """Match over the range that is found to be enough; None where nothing can be matched.

    A search over half the width finds any disparity that a pair can have, but leaves out the left half of
    the image. What it finds at half the size starts a narrower one. Where glare or darkness is in the right
    half, it finds anything: a search that begins with the smallest disparities grows with the road that comes
    nearer.
    """
    half = shrink_both(views, 2)
    rough, found = _rough(half), None
    if rough is not None and rough < _NEAR * half[0].shape[1]:
        found = _match_up_to(views, 2 * rough, shown=True)
    if found is None:  # a near scene, or grain that is gone at half the size
        found = _match_up_to(views, _rough(views))
    if found is None or found.believed < _HARDLY_BELIEVED:
        grown = _match_up_to(views, NARROWEST / 2)
        found = max(filter(None, (found, grown)), key=lambda each: each.believed, default=None)
    return found


def _rough(views: Views) -> float | None:
    """Find about how large disparities get, by one search over half the width; None where none is found."""
    return _top(_match(views, views[0].shape[1] / 2), 98)


def _match_up_to(views: Views, top: float | None, *, shown: bool = False) -> SmallMatch | None:
    """Match over a range that grows for as long as disparities of about `top` and more meet its end.

    Where there is nothing to match, any candidate wins, and with more of them another one: so only what a
    search twice as wide finds too is believed, unless other views have `shown` the first range and most is
    found in it.
    """
    found = None
    for _ in range(_RANGE_ROUNDS):
        if top is None:
            return None
        searched = _BEYOND * top + 4
        narrow = _match(views, searched)
        if shown and (plain := _enough(narrow, searched)) and plain.believed >= _PLAIN:
            return plain
        shown, wide = False, _match(views, min(2 * searched, views[0].shape[1] / 2))
        believed = np.where(np.abs(narrow - wide) < 1, narrow, np.float32(0))
        top = _top(believed, 99)
        disparity = np.where(wide > 0, believed, narrow)
        found = None if top is None else SmallMatch(top, disparity, _known(believed))
        if top is not None and top < _WITHIN * searched:
            break
    return found


def _known(disparity: Map) -> float:
    return np.count_nonzero(disparity) / disparity.size


def _top(disparity: NDArray[Any], percentile: float) -> float | None:
    valid = disparity[disparity > 0]
    return float(np.percentile(valid, percentile)) if valid.size > _MIN_SHARE * disparity.size else None


def _seen(found: SmallMatch | None, factor: float, measured: Measured | None) -> FirstLook:
    """Say what was found at views that are `factor` times smaller, and how the right one lies."""
    if found is None:
        return FirstLook(None, None)
    return FirstLook(math.ceil(_MARGIN * found.top * factor) + 8, measured, found.disparity)


def _match(pair: Views, count: float) -> Map:
    usable = usable_range(math.ceil(count), 0, pair[0].shape[1], _OPTIONS.block_size)
    if usable < NARROWEST:
        return np.zeros(pair[0].shape, np.float32)
    return match_views(pair, 0, usable, _OPTIONS)
