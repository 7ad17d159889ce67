"""Disparity maps from stereo pairs: range found, views levelled, then one match."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.estimator.road.find import road_plane
from rollcli.rig.calibration import Calibration, require_calibration
from rollcli.stereo.alignment import Approach, Measured, SmallViews, level, textured_share
from rollcli.stereo.along_road import FindRoad, Levelled
from rollcli.stereo.correction import Correction
from rollcli.stereo.first_look import FirstLook, first_look, look_for_range
from rollcli.stereo.misalignment import (
    LEVEL,
    NO_SUPPORT,
    RECALIBRATE,
    TOLERANCE,
    ColumnSupport,
    Misalignment,
    Tolerance,
)
from rollcli.stereo.options import StereoOptions as StereoOptions
from rollcli.stereo.refinement import refined
from rollcli.stereo.row_fit import column_support, support_of_level
from rollcli.stereo.sgbm import NARROWEST, usable_range
from rollcli.stereo.views import Map, as_bright, as_clear, as_sharp, prepare_views, shows_nothing, shrink

# Shares of the textured blocks that tell
_SURE = 0.3  # from here on the images are what they should be
_FEW = 0.2  # below it, they show two scenes
_PLAIN = 0.4  # from here on swapped images are swapped
_COMPARED_FROM = 120  # px of width; of most narrower pairs of one scene too few blocks match
_LEAST_TEXTURE = 0.07  # share of the blocks; images with less may show the same scene


def check_same_scene(small: SmallViews, look: FirstLook, measured: Measured | None) -> None:
    """See that the images show one scene from the left and from the right.

    Parameters
    ----------
    small : SmallViews
    look : FirstLook
        What was seen before the match.
    measured : Measured or None
        How the right view lies, as far as the match tells.

    Raises
    ------
    InputError
        They are one image, are swapped, mirrored or upside down, or show two scenes.
    """
    matched = max(_share(look.measured), _share(measured))
    if matched >= _SURE:
        return  # most pairs: their texture need not be looked at
    textured = min(map(textured_share, small.views))
    if textured < _LEAST_TEXTURE or matched >= _SURE * textured:
        return
    if np.array_equal(*small.views):
        raise InputError("the left and the right image are the same")
    if _share(first_look(SmallViews(small.views[::-1])).measured) >= _PLAIN * textured:
        raise InputError(
            "the views seem swapped, mirrored or upside down: the scene is matched when the right image is "
            "taken for the left one; disparities below 0 need --min-disparity"
        )
    if matched < _FEW * textured:
        height, width = small.views[0].shape
        small_ones = f"are too small to compare ({width}x{height} px), or " if width < _COMPARED_FROM else ""
        raise InputError(
            f"the two images {small_ones}do not show the same scene or are not rectified: hardly anything in "
            "one is found in the same rows of the other"
        )


def _share(measured: Measured | None) -> float:
    return 0.0 if measured is None else measured.share


_MATCHES = 4  # until a pair counts as one that cannot be levelled
# What is level by half of the blocks is so by all of them: most level pairs are, and take 2 to 5 % less time.
# With 2.8 standard errors in place of 1, two of 17 noisy pairs with a yaw of 0.1 degrees passed, too
_LEVEL_BY_HALF = TOLERANCE._replace(sure=1.0)
_ROUNDS = 8  # of measuring; on empty roads with much noise each takes away a fifth of what is left
# A scale that no rig in use has, in blocks that do not agree. Of 468 warped pairs 12 had both: three angles
# of them were wrong by 0.3 degrees. Of the others two were wrong, by 0.11
_UNUSUAL_SCALE = 0.003
_UNUSUAL_ERROR = 0.01  # px; standard error of the offset
# What refinement takes away where blocks spread by `_KEPT_SPREAD`; of more, the pair is matched again. Noise
# hides more of what is left. At 0.15 px a ninth of the streets are matched twice, at 0.2 half as many; but of
# 216 warped pairs one is off by 0.12 degrees (tests/benchmarks/bench_level.py 12), and warped empty roads
# with much noise by 0.018 (median) in place of 0.016. At 0.25 three times as many of these are off by 0.1
_KEPT = Tolerance(0.3, 0.0014, 0.0014, 0.8, 0.3, 0.3, sure=0.0)
_KEPT_SPREAD = 0.15  # px
# px, radians; of what is level, the part that refinement takes away. 0.05 px turned rendered roads by 0.02 to
# 0.06 degrees, and their intervals covered 0.22; with nothing here, level ones were twice as wrong (95 %)
_AS_GIVEN = Tolerance(0.012, 6e-5)
# px per px; standard deviation of what the rows leave open of the columns. It turns a road by 0.35 degrees
# (95 %) where the baseline is a third of the camera's height
_OPEN_COLUMNS = 0.001
# The same of a pitch alone, which an offset of a few pixels may be: 0.1 degrees (95 %). Offsets of less than
# 2 px, as calibrated rigs have, leave a third of it
_OPEN_PITCH = 0.0003
MUCH_AT_END = 0.05  # share of a map; with more at the end of the searched range, that was too short
_WIDEST = 2**14 - 1  # px: they are made twice as large, and OpenCV reads between pixels of up to 32766
_FURTHEST = 12.0, 0.03, 0.02  # offset, rotation and scale that no rig in use has: px, radians, share
# the doubts of a pair: its correction was still changing when it was given up, or could not be checked; its
# columns may be far from where they are believed to be; it is not level once it was levelled as a file says
NOT_LEVELLED = "the views are not level, and could not be levelled, as if not rectified or of two moments"
TOO_LITTLE = "too little can be compared to tell whether the views are level"
NOT_TOLD_BY_ROWS = (
    f"the rows do not tell whether the right view is larger, bent or of another moment: {RECALIBRATE}"
)
PITCH_NOT_TOLD = (
    f"the rows do not tell whether the right camera is pitched or its image shifted: {RECALIBRATE}"
)
CONTRADICTS = "the views do not lie as the correction says"


@dataclass(frozen=True)
class StereoMatch:
    """A disparity map, the range it was searched in, and how the right view lay.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        Pixels of the size matched at; no data is 0.
    min_disparity, num_disparities : int
        The range searched.
    end_fraction : float
        Share of the valid pixels within a pixel of the range's end: if large, the range was too short.
    corrected : Misalignment
        What the right view was levelled by, pixels of the size matched at; `LEVEL` if it was left as it is.
    larger : float
        By which share the right view's columns are believed to have been larger, which the map is free of.
    measured : Measured or None
        How the right view lies, with the standard error of each part, px of the size matched at; None where
        that was not asked, or could not be told.
    lacks_road : bool
        Whether the road was to be matched along its plane, and too little of any was found: all below the
        horizon was then matched over the whole range.
    slope_error : float
        Standard deviation of the slope along the rows that levelling left in the disparities, px per px, also
        where the views were level enough to be left as they are; 0 if nothing was measured.
    doubt : str
        Why the views may not be level now; empty if there is no reason.
    as_told : bool
        Whether it was levelled by what a user said, not by what was measured.
    match_whole : callable
        Makes `whole`.
    """

    disparity: Map
    min_disparity: int
    num_disparities: int
    end_fraction: float
    corrected: Misalignment
    larger: float
    measured: Measured | None
    lacks_road: bool
    slope_error: float
    doubt: str
    as_told: bool
    match_whole: Callable[[], Map]

    @cached_property
    def whole(self) -> Map:
        """The map with all of it at full size, to be looked at; matched when it is first asked for."""
        return self.match_whole()

    @property
    def lies(self) -> Misalignment | None:
        """How the right view lies: as corrected, or as measured where that did not correct it.

        None where nothing was measured, or what was measured could not be corrected.
        """
        if self.measured is None or self.doubt in (TOO_LITTLE, NOT_LEVELLED):
            return None
        as_measured = self.as_told or self.corrected == LEVEL
        return self.measured.misalignment if as_measured else self.corrected


_DEFAULT = StereoOptions()


@np.errstate(all="ignore")
def compute_disparity(
    left: NDArray[Any],
    right: NDArray[Any],
    *,
    num_disparities: int | None = _DEFAULT.num_disparities,
    min_disparity: int = _DEFAULT.min_disparity,
    block_size: int = _DEFAULT.block_size,
    mode: str = _DEFAULT.mode,
    uniqueness: int = _DEFAULT.uniqueness,
    speckle_size: int = _DEFAULT.speckle_size,
    speckle_range: int = _DEFAULT.speckle_range,
    downscale: float = _DEFAULT.downscale,
    align: str | os.PathLike[str] = "auto",
    vertical_offset: float | None = _DEFAULT.vertical_offset,
    calibration: Calibration | None = None,
) -> Map:
    """Return the disparity map of a rectified pair.

    Parameters
    ----------
    left, right : ndarray, shape (H, W) or (H, W, 3)
        uint8 or uint16, grey or BGR, of equal size.
    num_disparities, min_disparity, block_size, mode, uniqueness, speckle_size, speckle_range, downscale
        See `StereoOptions`; so for `align` and `vertical_offset`.
    calibration : Calibration, optional
        Of the pair: a right camera that is turned turns its columns about the principal point, else about the
        middle.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Pixels; no data is 0.

    Raises
    ------
    InputError
        The images differ in size, are too small to match, are swapped, or do not show the same scene.
    UsageError
        An option makes no sense.

    Notes
    -----
    Everything is matched by OpenCV's SGBM. Where a road is found and no option says how to match, its
    disparities are those of a match along its plane, as in `rollcli.estimate_pair`, whose interval
    alone knows what levelling left uncertain: an array does not carry it.

    Examples
    --------
    >>> left = np.random.default_rng(0).integers(0, 256, (60, 200), dtype=np.uint8)
    >>> right = np.roll(left, -12, axis=1)
    >>> disparity = compute_disparity(left, right, num_disparities=32)
    >>> float(np.median(disparity[disparity > 0]))
    12.0
    """
    search = num_disparities, min_disparity, block_size, mode, uniqueness, speckle_size, speckle_range
    options = StereoOptions(*search, downscale, align, vertical_offset)
    require_calibration(calibration)
    return match_pair(left, right, options, road_plane, calibration).whole


def match_pair(
    left: NDArray[Any],
    right: NDArray[Any],
    options: StereoOptions,
    find_road: FindRoad | None = None,
    rig: Calibration | None = None,
) -> StereoMatch:
    """Match a rectified pair, and keep all that was found on the way.

    Parameters
    ----------
    left, right, options
        See `compute_disparity`.
    find_road : callable, optional
        Finds the road's plane in a smaller map of the pair. The road is then matched along it, and what lies
        beside and above it is that of the smaller map; without it all is matched at full size.
    rig : Calibration, optional
        Of the views as they are given: a yaw or a pitch of the right camera turns its columns about the
        principal point.

    Raises
    ------
    InputError, UsageError
        See `compute_disparity`.
    """
    given = as_sharp(as_clear(as_bright(prepare_views(left, right))))
    views = shrink(given[0], options.downscale), shrink(given[1], options.downscale)
    (height, width), first = views[0].shape[:2], options.min_disparity
    if usable_range(1, first, width, options.block_size) < NARROWEST:
        raise InputError(f"images {width} px wide are too narrow to match from disparity {first} on")
    if width > _WIDEST:
        raise InputError(f"images {width} px wide cannot be matched, {_WIDEST} can: give --downscale 2")
    told = options.given_alignment(width, height)
    small = SmallViews(views, given)
    look = _look_at(small, options, told)
    looked_for = (width // 8 if look.range is None else look.range) - first
    count = usable_range(options.num_disparities or looked_for, first, width, options.block_size)
    most = count if options.num_disparities else usable_range(2 * count, first, width, options.block_size)

    blank, find_road = shows_nothing(views[0]), find_road if first >= 0 else None
    tried: list[tuple[Levelled, float]] = []  # with the share of its map at the range's end

    def match(lies: Misalignment) -> Map:
        before = tried[-1][0] if tried else None
        searched = count if before is None else before.count
        pair = Levelled(views, lies, look.disparity, first, searched, options, find_road, blank, before)
        disparity = pair.matched()
        at_end = _share_at_end(disparity, pair)
        if pair.count < most and at_end > MUCH_AT_END:
            pair = replace(pair, count=most, before=None)
            disparity = pair.matched()
            at_end = _share_at_end(disparity, pair)
        tried.append((pair, at_end))
        return disparity

    if options.measures_alignment:
        found = _match_levelled(match, small, look, first < 0)
    else:
        found = _match_as_told(match, small, told, check=options.checks_alignment)
    (pair, end_fraction), corrected = tried[-1], found.corrected
    axis = _axis(rig, given[0].shape, options.downscale)
    support = found.support(axis, height)
    lies = found.left_to_refine(small.shape)
    # levelling takes pixels for square: of others, a turn is less or more in the columns than in the rows
    skew = 0.0 if rig is None else corrected.rotation * (1 - rig.aspect**-2)

    def finished(disparity: Map) -> Map:
        return _with_believed_columns(refined(disparity, views, lies), corrected, support, (skew, axis[1]))

    disparity = finished(found.disparity)
    return StereoMatch(
        disparity=disparity,
        min_disparity=first,
        num_disparities=pair.count,
        end_fraction=end_fraction,
        corrected=corrected,
        larger=support.scale,
        measured=found.measured,
        lacks_road=pair.lacks_road,
        slope_error=support.error,
        doubt=found.doubt or _doubt_of_columns(support),
        as_told=not options.measures_alignment,
        match_whole=lambda: disparity if find_road is None else finished(pair.matched(whole=True)),
    )


def _axis(rig: Calibration | None, shape: tuple[int, ...], downscale: float) -> tuple[float, float]:
    """Return where the right camera's principal point is from the middle, px of the size matched at.

    `shape` is that of the views as they are given.
    """
    if rig is None:
        return 0.0, 0.0
    height, width = shape
    right, below = rig.for_size(width, height).right_axis(width, height)
    return right / downscale, below / downscale


def _look_at(small: SmallViews, options: StereoOptions, told: Correction) -> FirstLook:
    """Look at a pair for what is neither given nor told."""
    if options.measures_alignment:
        return first_look(small)
    if options.num_disparities is None:
        left, right = small.whole
        return look_for_range((left, level(right, told.lies)))
    return FirstLook(None, None)


class _Matched(NamedTuple):
    """A map before it is refined.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        Pixels; no data is 0.
    corrected : Misalignment
        What the right view was levelled by.
    measured : Measured or None
        How it lies; None where that was not asked, or could not be told.
    doubt : str
        Why the views may not be level now; empty if there is no reason.
    told : ColumnSupport or None
        What a drive says of the columns; None where the pair's own rows have to.
    """

    disparity: Map
    corrected: Misalignment
    measured: Measured | None
    doubt: str = ""
    told: ColumnSupport | None = None

    def support(self, axis: Sequence[float], height: int) -> ColumnSupport:
        """Tell what is in the columns of views of this height; `axis` as in `column_support`."""
        if self.corrected != LEVEL and self.told is not None:
            return self.told
        if self.measured is None or (self.corrected == LEVEL and self.doubt):
            return NO_SUPPORT
        if self.corrected == LEVEL:
            return support_of_level(self.measured.misalignment, self.measured.errors, height)
        return column_support(self.measured.evidence, axis)

    def left_to_refine(self, shape: tuple[int, ...]) -> Misalignment:
        """Return how views of this shape lie, also where that was too little to level them for."""
        if self.corrected != LEVEL or self.measured is None or self.doubt:
            return self.corrected
        seen = Misalignment(*self.measured.misalignment.parts[:2])
        return LEVEL if _AS_GIVEN.allows(seen, self.measured.errors, shape) else seen


def _match_as_told(
    match: Callable[[Misalignment], Map], small: SmallViews, told: Correction, *, check: bool
) -> _Matched:
    """Match views that lie as is told, and `check` whether they do."""
    disparity, columns = match(told.lies), told.columns
    measured = small.measure(disparity, told.lies) if check else None
    if measured is None:
        return _Matched(disparity, told.lies, None, told=columns)
    lies, errors, shape = measured.misalignment, measured.errors, small.shape
    since = lies - told.lies
    # but for what refinement takes away
    if not _KEPT._replace(sure=4.0).allows(since, errors, shape):
        return _Matched(disparity, told.lies, measured, CONTRADICTS, columns)
    if columns is not None and not TOLERANCE.allows(replace(since, offset=0.0), errors, shape):
        # columns may have moved as much as rows have
        error = support_of_level(since, errors, shape[0]).error
        columns = replace(columns, error=math.hypot(columns.error, error))
    corrected = told.of_pair(lies.offset, errors.offset).rounded(*shape)
    return _Matched(disparity, corrected, measured, told=columns)


def _match_levelled(
    match: Callable[[Misalignment], Map], small: SmallViews, look: FirstLook, any_scene: bool
) -> _Matched:
    """Match once the views are level."""
    seen, shape, looked_at = look.measured, small.shape, LEVEL
    if seen is not None and not TOLERANCE.allows(seen.misalignment, seen.errors, shape):
        looked_at = seen.misalignment
    wanted, approach = looked_at, Approach(shape)
    for matched in range(_MATCHES):
        at = wanted
        disparity = match(at)
        measured = small.closer.measure(disparity, at, _ROUNDS, every=2) if at == LEVEL else None
        if measured is None or not _LEVEL_BY_HALF.allows(measured.misalignment, measured.errors, shape):
            measured = small.closer.measure(disparity, at, _ROUNDS)
        if not any_scene:
            check_same_scene(small, look, measured)
        if measured is None:
            return _Matched(disparity, at, look.measured, TOO_LITTLE)
        # where this measurement and that before it lead to; level if either is
        lies, errors = measured.misalignment, measured.errors
        wanted = approach.next(at, lies)
        if TOLERANCE.allows(lies, errors, shape) or TOLERANCE.allows(wanted, errors, shape):
            wanted = LEVEL
        if wanted == at:
            return _Matched(disparity, at, measured, _doubt(at, errors))
        left = (lies - at).times(measured.spread / _KEPT_SPREAD)
        if wanted != LEVEL and _KEPT.allows(left, errors, shape):  # refinement does the rest
            return _Matched(disparity, lies, measured, _doubt(lies, errors))
        if matched == 1 and looked_at != LEVEL:  # which may have led astray
            wanted, approach = LEVEL, Approach(shape)
    return _Matched(disparity, at, measured, NOT_LEVELLED)


def _doubt(corrected: Misalignment, errors: Misalignment) -> str:
    far = any(abs(part) > most for part, most in zip(corrected.parts[:3], _FURTHEST, strict=True))
    far |= abs(corrected.scale) > _UNUSUAL_SCALE and errors.offset > _UNUSUAL_ERROR
    return "the views lie too far from level to be sure of the correction" if far else ""


def _doubt_of_columns(support: ColumnSupport) -> str:
    if support.error > _OPEN_COLUMNS:
        return NOT_TOLD_BY_ROWS
    return PITCH_NOT_TOLD if support.pitch_error > _OPEN_PITCH else ""


def _share_at_end(disparity: Map, pair: Levelled) -> float:
    """Return the share of the valid pixels within a pixel of the end of the range."""
    valid, at_end = cv2.countNonZero(disparity), disparity >= pair.first + pair.count - 2
    if pair.road is not None:  # what is matched along the road's plane, no range ends
        at_end[pair.top :] &= disparity[pair.top :] != pair.road.disparity
    return float(np.count_nonzero(at_end) / valid) if valid else 0.0


def _with_believed_columns(
    disparity: Map, matched: Misalignment, support: ColumnSupport, skewed: tuple[float, float]
) -> Map:
    """Return the map of a pair whose columns lie as is believed.

    Views are warped by all that their rows show, for the match needs rows that agree. A scale of the rows is
    in the columns only as far as it is supported, and the rest of it is taken out of the disparities again. A
    yaw moves the columns by t x^2 where it moves the rows by t x y, and a pitch by q x y where it moves the
    rows by q y^2.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Of views of which the right one was levelled by `matched`, px; no data is 0.
    matched : Misalignment
        Pixels of this size.
    support : ColumnSupport
        What is in the columns.
    skewed : tuple of float
        By how many px too much each row was moved along than the one above, where pixels are not square; and
        the row that was moved rightly, px from the middle.
    """
    skew, below = skewed
    if matched == LEVEL or (support == NO_SUPPORT and not matched.scale and not skew):
        return disparity
    height, width = disparity.shape
    u = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
    v = np.arange(height, dtype=np.float32)[:, None] - np.float32((height - 1) / 2)
    x = u - disparity
    moved = x * np.float32(support.twist)
    moved += np.float32(support.pitch) * v + np.float32(support.scale - matched.scale)
    moved *= x
    moved += disparity
    if skew:
        moved += np.float32(skew) * (v - np.float32(below))
    np.maximum(moved, np.float32(1e-3), out=moved)
    moved *= disparity > 0
    return moved
