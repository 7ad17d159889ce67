"""The road matched over a few disparities, along a plane that a match of smaller views has shown.

A right view that is warped along the road's plane shows the road at one disparity [Fan et al., IEEE T-CYB
2021]. Blocks of both views then hold the same pixels, so block matching has no bias of slanted surfaces, and
a few disparities are enough. What lies further off the plane is known from the small match.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Bools, strips
from rollcli.estimator.road.find import Plane
from rollcli.stereo import sampling
from rollcli.stereo.alignment import level, seen_from_right
from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.options import StereoOptions
from rollcli.stereo.sgbm import NARROWEST, SUBPIXELS, match_below, match_views, usable_range, without_lag
from rollcli.stereo.views import Map, Views, resampled, shrink_both

FindRoad = Callable[[Map, float], Plane | None]
"""Finds the road's plane in a map that is so many times smaller; None where there is none."""

# Times: what need not be matched at full size takes a 27th of the time, or a 64th where views are high. At a
# quarter of the size one of 41 real roads of 375 rows was lost, and at an eighteenth roads of 2160 rows
_SMALLER, _OF_HIGH, _HIGH = 3, 4, 480  # the last: rows
# px: lower views show too little of the road at a third of the size. Of 18 real streets of 621x188, two lost
# their road along it, and pitches moved by up to 0.08 degrees
_LEAST_HEIGHT = 300
_WIDTH = 1600  # px: of a view that is matched over the narrowest range; of a wider one roads bend by more
# Shares of the range, from the plane: further off, the small match tells more; and at the range's ends, where
# the best match may lie outside of it
_NEAR, _END = 0.375, 0.0625
# px: width of the matched block, and half its height; with 9, 11 and 15 real roads, or rendered ones, are a
# little less right
_BLOCK = 13
_STRIP = 64  # rows: what they need of a view twice as large stays in the processor's cache
_PARTS = 1024  # of a pixel, that a plane is rounded to: processors differ in the last digits of sums
# px of half the rows, and sixteenths of a pixel. Not to look for them saves 3 % of a pair's time; of 137
# warped empty roads with much noise one is then off by 0.7 degrees, and 80 are suspect in place of 69
_SPECKLE = 50, 2
_SPARE = 9  # rows above the plane's horizon. Of 224 pairs, four were off by more
_MOST_ABOVE = 0.6  # of the height. Of 248 pairs the road's first row was at 0.49 at most
# Shares: of the small map below the horizon that lies on the plane, and of this that is found along it. On 41
# real pairs 0.2 and 0.6, but for two where cars hide the road. Less will do where the whole range shows less
_FEWEST_ON, _FEWEST_FOUND = 0.15, 0.5
_AS_FAR = 3.0  # px: what is found there is as far off as the small map says


@dataclass(frozen=True, eq=False)
class Levelled:
    """A pair whose right view is levelled when it is resampled: whole, smaller, or along a plane.

    Each match is made once, when it is first asked for.

    Attributes
    ----------
    views : pair of ndarray of uint8, shape (H, W)
        As they were given.
    lies : Misalignment
        How the right one lies.
    seen : ndarray of float32 or None
        A map of the pair at any size, in its own pixels: a tilt moves near points further.
    first, count : int
        The range of disparities, px.
    options : StereoOptions
        How the pair is matched.
    find_road : callable or None
        None: nothing is matched along a road.
    blank : ndarray of bool, shape (H, W), or None
        Pixels of the left view that show nothing: what a match finds there is no data.
    before : Levelled or None
        The pair as it was matched before. Where it lay nearly so, its small map and plane serve again.
    """

    views: Views
    lies: Misalignment
    seen: Map | None
    first: int
    count: int
    options: StereoOptions
    find_road: FindRoad | None
    blank: Bools | None = None
    before: "Levelled | None" = None

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        height, width = self.views[0].shape
        return height, width

    @cached_property
    def _near(self) -> Map | None:
        """The right view's disparities; None where they are not known, or not needed."""
        return seen_from_right(self.seen) if self.seen is not None and self.lies.tilt else None

    @cached_property
    def _alike(self) -> "Levelled | None":
        """The match before; None where the views lay further off than half a pixel of the small map."""
        if self.before is None or (self.lies - self.before.lies).reach(*self.shape) > self._smaller / 2:
            return None
        return self.before

    @cached_property
    def whole(self) -> Views:
        """Both views at their size."""
        return self.views[0], level(self.views[1], self.lies, self._near)

    @property
    def _smaller(self) -> int:
        """How many times smaller the small map is."""
        return _OF_HIGH if self.shape[0] >= _HIGH else _SMALLER

    @cached_property
    def _small(self) -> Map | None:
        """The map of smaller views; None where it would be too narrow."""
        if self._alike is not None:
            return self._alike._small
        left, right = shrink_both(self.views, self._smaller)
        views = left, level(right, self.lies.resized(1 / self._smaller), self._near)
        first, width = self.first // self._smaller, -(-self.count // self._smaller)
        count = usable_range(width, first, left.shape[1], self.options.block_size)
        if count < NARROWEST:
            return None
        disparity = match_views(views, first, count, self.options.for_smaller(self._smaller))
        if self.blank is not None:
            size = left.shape[1], left.shape[0]
            disparity[cv2.resize(self.blank.view(np.uint8), size, interpolation=cv2.INTER_AREA) != 0] = 0
        return disparity

    @cached_property
    def plane(self) -> Plane | None:
        """The road's; None where there is none, or nothing finds it."""
        if self._alike is not None:
            return self._alike.plane
        if self.find_road is None or self._small is None:
            return None
        found = self.find_road(self._small, self._smaller)
        plane = None if found is None else _resized(found, self._small.shape, self.shape)
        return plane if plane and plane[2] > 0 else None  # a level one, which rounding may leave, is no road

    @cached_property
    def top(self) -> int:
        """The first row that the plane reaches, where there is one, and some to spare."""
        assert self.plane is not None
        at_origin, across, down = self.plane
        height, width = self.shape
        horizon = -(at_origin + max(0.0, across * (width - 1))) / down  # at the side where that is higher
        return int(max(0.0, min(horizon - _SPARE, _MOST_ABOVE * height)))

    @cached_property
    def coarse(self) -> Map:
        """The small map, enlarged, where a plane was found in it."""
        assert self._small is not None
        return resampled(self._small, self.shape)

    @property
    def _wants_road(self) -> bool:
        wanted = self.find_road is not None and self.options.is_default
        return wanted and self.shape[0] >= _LEAST_HEIGHT

    @cached_property
    def road(self) -> "_Near | None":
        """The rows that the road's plane reaches, matched along it; None where too little of it is found."""
        near = _match_along(self, self.plane, self.coarse) if self._wants_road and self.plane else None
        if near is None or (found := near.found(near.disparity)) >= _FEWEST_FOUND:
            return near
        return near if found > near.found(self._below) else None  # as at night, or where it is blurred

    @cached_property
    def _below(self) -> Map:
        """The rows that the road's plane reaches, matched over the whole range."""
        return match_below(self.whole, self.first, self.count, self.options, self.top)

    @property
    def lacks_road(self) -> bool:
        """Whether the road was to be matched along its plane, and too little of any was found."""
        return self._wants_road and self.road is None

    def matched(self, *, whole: bool = False) -> Map:
        """Match what an estimate needs: the road, and what lies beside and above it at a part of the size.

        Parameters
        ----------
        whole : bool
            Whether what lies beside and above the road is matched at full size, too.

        Returns
        -------
        ndarray of float32, shape (H, W)
            Pixels; no data is 0, and so is what the left view does not show.
        """
        first, count, options, near = self.first, self.count, self.options, self.road
        if whole or self.plane is None:
            disparity = without_lag(match_views(self.whole, first, count, options), options.mode)
            if near is not None:
                np.copyto(disparity[self.top :], near.disparity, where=near.told & (near.disparity > 0))
        else:
            disparity = self.coarse.copy()
            rows = disparity[self.top :]
            if near is None:
                rows[:] = self._below
                disparity = without_lag(disparity, options.mode)
            else:
                np.copyto(rows, near.disparity, where=near.told)
        if self.blank is not None:
            disparity[self.blank] = 0
        return disparity

    def along(self, plane: Map, middle: int, rows: slice) -> Views:
        """Return some rows of both views, the right one warped so that a plane lies at a disparity `middle`.

        `plane` has the disparities of these rows, px. Grey levels between pixels are those of a view twice as
        large, see `sampling.smoothed_between`; the left view is as smooth.
        """
        left, right = self.views
        columns = np.arange(self.shape[1], dtype=np.float32) + np.float32(middle)
        v = np.arange(self.shape[0], dtype=np.float32)[rows, None]
        warped = np.empty_like(left[rows])
        for part in strips(len(plane), _STRIP):
            near = plane[part]
            at_u, at_v = sampling.seen_at(self.lies, columns - near, v[part], self.shape, near)
            warped[part] = sampling.grey_along(right, at_u, np.broadcast_to(at_v, near.shape))
        return sampling.smoothed_at_pixels(left[rows]), warped


def _resized(plane: Plane, shape: tuple[int, ...], to: tuple[int, ...]) -> Plane:
    """Return the plane of a map of another shape."""
    across, down = to[1] / shape[1], to[0] / shape[0]
    at_origin, a, b = across * plane[0], plane[1], plane[2] * across / down
    # the middle of a pixel is half a pixel from its corner
    at_origin += a * (1 - across) / 2 + b * (1 - down) / 2
    at_origin, a, b = (round(each * _PARTS) / _PARTS for each in (at_origin, a, b))
    return at_origin, a, b


class _Near(NamedTuple):
    """Rows that were matched along a plane; arrays of their shape.

    Attributes
    ----------
    disparity : ndarray of float32
        Pixels; 0 where none is found.
    told : ndarray of bool
        Where the small map is near the plane, or shows nothing.
    seen : ndarray of float32
        What the small map shows near the plane, px; 0 elsewhere.
    """

    disparity: Map
    told: Bools
    seen: Map

    def found(self, disparity: Map) -> float:
        """Return the share of what is seen near the plane that a match of these rows finds again."""
        again = (disparity > 0) & (np.abs(self.seen - disparity) < np.float32(_AS_FAR)) & (self.seen > 0)
        return float(np.count_nonzero(again) / np.count_nonzero(self.seen))


def _match_along(pair: Levelled, plane: Plane, coarse: Map) -> _Near | None:
    """Match the rows that a plane reaches; None where too little of the `coarse` map is found there again."""
    (height, width), first = pair.shape, pair.top
    top = max(0, first - _BLOCK - 1)
    count = NARROWEST * math.ceil(width / _WIDTH)
    if height - top <= 2 * _BLOCK or width <= count + _BLOCK:
        return None
    at_origin, across, down = map(np.float32, plane)
    u = np.arange(width, dtype=np.float32)
    straight = across * u + (at_origin + down * np.arange(top, height, dtype=np.float32)[:, None])
    views = pair.along(np.maximum(straight, 0), count // 2, slice(top, height))
    sixteenths, straight = _match_blocks(views, count)[first - top :], straight[first - top :]

    end = round(_END * count * SUBPIXELS)
    known = (sixteenths > end) & (sixteenths < (count - 1) * SUBPIXELS - end)
    shift = sixteenths.astype(np.float32) * np.float32(1 / SUBPIXELS)
    # the plane is that of the pixel which the right view shows there
    disparity = np.maximum(straight - across * shift, 0) + (shift - np.float32(count // 2))
    known &= (disparity > 0) & (disparity <= u)
    seen = coarse[first:]
    lies_on = np.abs(seen - straight) < np.float32(_NEAR * count)
    shown = seen > 0
    lies_on &= shown
    if np.count_nonzero(lies_on) < max(1, _FEWEST_ON * np.count_nonzero(shown)):
        return None
    return _Near(disparity * known, lies_on | ~shown, seen * lies_on)


def _match_blocks(views: Views, count: int) -> NDArray[np.int16]:
    """Match blocks of views that show a road at one disparity; sixteenths of a pixel, below 0 for no data.

    Blocks of half the rows are about twice as high as wide, and take half the time. Beyond the first and the
    last row the road goes on as it is: else none of it would be found where a block reaches beyond them.
    """
    beside = _BLOCK // 2
    matcher = cv2.StereoBM.create(count, _BLOCK)
    matcher.setUniquenessRatio(0)  # a seventh of the match, and no angle changes
    matcher.setDisp12MaxDiff(1)
    matcher.setSpeckleWindowSize(_SPECKLE[0])
    matcher.setSpeckleRange(_SPECKLE[1])
    found = matcher.compute(
        *(
            cv2.copyMakeBorder(sampling.half_the_rows(each), beside, beside, 0, 0, cv2.BORDER_REFLECT_101)
            for each in views
        )
    )
    rows = np.repeat(found[beside:-beside].astype(np.int16, copy=False), 2, axis=0)
    return rows[: len(views[0])]
