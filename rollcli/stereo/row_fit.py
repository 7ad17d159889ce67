"""Fit how the right view lies to vertical disparities of blocks, and tell how far they support a scale.

A right camera that is larger by s moves rows by s y and columns by s x. Two other things move rows alike and
no column: a baseline that is tilted against the rows moves them by tilt d, d the disparity, which on a road
grows down the image (0.3 degrees on one day of KITTI: 0.25 px on the near road); and what the lens model
leaves bends them. A scale shows at every depth, in the upper and in the lower half, and as evenly as the rest
of the field is even. How well each of them explains the blocks decides what the columns get.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats, Singles
from rollcli.stereo.misalignment import LEVEL, NO_SUPPORT, ColumnSupport, Misalignment

_FIT_ROUNDS = 60
_SAME_SPREAD = 0.005  # of it: a fit that changes its spread by less keeps it from then on
# px, of each part anywhere: a fit that changes by less has settled. One that stopped with its spread was up
# to 0.1 px off in the corners, by its way there; the next round of measuring took that back
_SAME = 0.001
_SAME_SHARE = 0.02  # of what is found: the next round of measuring takes away more
_TUNING = 1.5  # standard deviations off, a block counts a quarter
_TILE = 64.0  # px of the size measured at: blocks within it err together
_LINEAR = slice(4)  # offset, rotation, scale, twist
# Standard errors: a tilt of less is none, and a curve no lens's. Plain roads cannot tell them from a scale
_SURE = 4.0
_FEWEST_TILES = 17  # of fewer, as of a first look, the sums tell no variance
_EXACT = 1e-9  # px^2 times a weight: views without noise are known no better
_FOCAL = 0.7  # widths: of most rigs
# standard errors: of less nothing is open. Of pairs with a yaw of 0.05 degrees intervals cover 0.95 and more,
# and 0.4 to 0.6 without it; those of level ones are as narrow as then, and with 2 in place of 3 a third wider
_SURELY = 3.0
_ROAD_ACROSS, _ROAD_DOWN = 0.13, 0.4  # of the height, from the centre: where a twist and a pitch turn a road


@dataclass(frozen=True)
class BeliefTuning:
    """What is known of rigs before a pair is seen; no number is fitted to the rolls of a recording.

    Attributes
    ----------
    scale, tilt, bend : float
        How large they are where there are any, standard deviations: share, radians, share.
    has_scale, has_tilt, has_bend : float
        How often there are any. With tilts at 0.06 and not 0.03, halved, cropped and warped real pairs are
        off by a seventh less on average. Of rendered pairs that are turned, larger or lower 95 % move by less
        than 0.033 degrees in place of 0.030. At 0.1 it is a quarter less, and 0.042; and one empty road with
        much noise is off by 0.15 degrees without a word.
    pitch : float
        How often an offset is a pitch, and no shift of the image.
    focal : tuple of float
        Focal lengths of rigs, in widths of the image. Five of them, up to 1.36 times apart, move rendered
        pairs that are pitched by 0.3 degrees by 0.017 degrees on average, these by 0.010.
    yaw, skew : float
        Standard deviations of a yaw, and of the yaw that rows which are skewed alone seem to be, radians. On
        KITTI's grey cameras 1.4 px in the corners look like 0.5 degrees, and lidar sees nothing of it in the
        columns.
    has_yaw, has_skew : float
        How often there is a yaw, and how often rows are skewed alone.
    lens_shape, no_shape : float
        Shapes of second and third degree at the border of what was seen, px, standard deviations: of rows
        that a lens has skewed alone (KITTI's grey cameras: 0.11 along x²), and of others (rendered: 0.02).
    has_left : float
        How often rows are turned since the left camera is rolled against the baseline, and not the right one.
        At 0.1, right views of empty roads that are turned and larger are off by up to 0.26 degrees, not 0.05.
    may_scale, may_other, may_skew, may_left : float
        The same as the interval has it; `may_other` of a tilt and of a bend. Where the rows cannot tell two
        causes apart, it reaches both of them: 0.35 makes twice the standard deviation of a scale all of it.
        With tilts at 0.1, intervals of 41 real roads with nothing above them cover 0.76 in place of 0.90, and
        80 in place of 105 of 216 warped empty roads with much noise are suspect.
    least : float
        What no pair tells of a scale or, in px at the border, of a twist: blocks share a part of their error.
    tiles : float
        Standard errors from tiles are too small by this: scales of consecutive streets scatter so. With 3,
        pairs with lidar are off by -0.035 degrees in place of +0.001; with 1, one of 60 warped rendered roads
        by 0.1 degrees and more in place of none.
    """

    scale: float = 0.004
    tilt: float = 0.005
    bend: float = 0.002
    has_scale: float = 0.5
    has_tilt: float = 0.06
    has_bend: float = 0.03
    pitch: float = 0.4
    focal: tuple[float, ...] = (0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9, 1.0, 1.15, 1.3, 1.5)
    yaw: float = 0.0035
    skew: float = 0.01
    has_yaw: float = 0.5
    has_skew: float = 0.1
    lens_shape: float = 0.1
    no_shape: float = 0.02
    has_left: float = 0.01
    may_scale: float = 0.5
    may_other: float = 0.35
    may_skew: float = 0.3
    may_left: float = 0.1
    least: float = 0.0001
    tiles: float = 2.0


BELIEF = BeliefTuning()


@dataclass(frozen=True, eq=False)
class ColumnEvidence:
    """What the rows of a pair say of the columns, before what is known of rigs; px of the size measured at.

    Attributes
    ----------
    information : ndarray, shape (4, 4)
        Of scale, tilt, bend and curve: inverse covariance of what the blocks tell, the rest being free.
    told : ndarray, shape (4,)
        The same, times their values.
    offset, rotation, twist : float
        As in a misalignment: px, radians, 1/pixels.
    twist_variance : float
    unevenness : float
        Variance of what the lens leaves at the border, px^2.
    shapes, shape_variances : ndarray, shape (4,)
        Of second and third degree at the border, px, px^2.
    moved : float
        Slope along the rows, px per px, that is surely on the road if the rig has moved between the views.
    reach : ndarray, shape (2,)
        How far from the centre blocks were seen, along the rows and down the columns, px.
    shape : tuple of int
        Height and width of the view.
    factor : float
        How many times larger the views are of which this is asked.
    """

    information: Floats
    told: Floats
    offset: float
    rotation: float
    twist: float
    twist_variance: float
    unevenness: float
    shapes: Floats
    shape_variances: Floats
    moved: float
    reach: Floats
    shape: tuple[int, int]
    factor: float

    @staticmethod
    def of_drive(pairs: "Sequence[ColumnEvidence]") -> "ColumnEvidence":
        """Return what pairs of one rig say together: how its cameras lie is the same in all of them.

        Noise is each pair's own; what the lens leaves is shared by all.
        """
        sure = 1 / np.array([each.twist_variance for each in pairs])
        sures = 1 / np.array([each.shape_variances for each in pairs])
        return ColumnEvidence(
            information=np.sum([each.information for each in pairs], axis=0),
            told=np.sum([each.told for each in pairs], axis=0),
            offset=float(np.mean([each.offset for each in pairs])),
            rotation=float(np.mean([each.rotation for each in pairs])),
            twist=float(np.average([each.twist for each in pairs], weights=sure)),
            twist_variance=float(1 / sure.sum()),
            unevenness=float(np.mean([each.unevenness for each in pairs])),
            shapes=np.average([each.shapes for each in pairs], axis=0, weights=sures),
            shape_variances=np.mean([each.shape_variances for each in pairs], axis=0),
            moved=float(np.mean([each.moved for each in pairs])),
            reach=np.mean([each.reach for each in pairs], axis=0),
            shape=pairs[0].shape,
            factor=pairs[0].factor,
        )


class SeenBlocks(NamedTuple):
    """Vertical disparities of blocks; each an array of shape (N,), px.

    Attributes
    ----------
    x, y : ndarray
        From the centre of the right view.
    near : ndarray
        Disparities.
    shift : ndarray
        Vertical disparities.
    weight : ndarray
        Squared grey levels per pixel; what they say counts so much.
    """

    x: Singles
    y: Singles
    near: Singles
    shift: Singles
    weight: Singles


class MeasuredRows(NamedTuple):
    """Blocks of a right view that was levelled by `at`, which is seen `factor` times smaller than it is.

    `shape` is the height and width that it is seen at, px.
    """

    seen: SeenBlocks
    at: Misalignment
    shape: tuple[int, int]
    factor: float = 1.0


class RowFit(NamedTuple):
    """The misalignment that explains most blocks.

    Attributes
    ----------
    lies, errors : Misalignment
        And the standard error of each part.
    spread : float
        Standard deviation of the blocks from it, outliers aside, px.
    off : ndarray, shape (N,)
        How far each block is from it, px.
    frame : _Frame
        Of the blocks.
    """

    lies: Misalignment
    errors: Misalignment
    spread: float
    off: Floats
    frame: "_Frame"


def fit_rows(seen: SeenBlocks, at: Misalignment = LEVEL, before: RowFit | None = None) -> RowFit:
    """Fit offset, rotation, scale, twist and curve, and a tilt where it is sure or begun with.

    Parameters
    ----------
    seen : SeenBlocks
        40 of them or more; what is left of the right view that was levelled by `at`.
    at : Misalignment
    before : RowFit, optional
        Of the same blocks in the round before: those that were far off then count little from the start.
    """
    frame = _Frame.of(seen) if before is None else before.frame
    design = frame.design
    shift, fixed = seen.shift.astype(np.float64), seen.weight.astype(np.float64)
    fit = _robust(design[_LINEAR], shift, fixed, None if before is None else (before.off, before.spread))
    variance = _variance(design[_LINEAR], fit, frame.tile)
    # a plain road's tilt or curve and its scale could cancel each other
    likely = np.array([np.inf] * 4 + [BELIEF.tilt * frame.near, BELIEF.bend * frame.half_height])
    held, to = variance / np.square(likely), np.zeros(6)
    wide, curve = _least_squares(design, shift, fit.weight, held), at.curve * frame.units[5]
    sure = _SURE * np.sqrt(variance * np.diag(wide.inverse))
    many = np.count_nonzero(np.bincount(frame.tile)) >= _FEWEST_TILES
    tilts = at.tilt != 0 or (many and abs(wide.values[4]) > sure[4])
    if not (many and abs(wide.values[5] + curve) > sure[5]):
        # no more than a pitch would have that is all of the offset
        rise = frame.half_height / (2 * _FOCAL * frame.half_width)
        held[5] = variance / max(_SAME, abs(at.offset + fit.values[0]) * rise**2) ** 2
        to[5] = -held[5] * curve
    used = np.array([True] * 4 + [tilts, many])
    if tilts or many:
        few, hold = design[used], (held[used], to[used])
        fit = _settled(_least_squares(few, shift, fit.weight, *hold), few, shift, fixed, fit.spread, *hold)
    errors = np.sqrt(np.square(fit.inverse @ (design[used] * fit.weight * fit.off)).sum(axis=1))
    parts = np.zeros((2, 6))
    parts[:, used] = (fit.values, errors)
    lies, errors_of = (Misalignment(*part.tolist()) for part in parts / frame.units)
    return RowFit(lies, errors_of, fit.spread, fit.off, frame)


def column_evidence(rows: MeasuredRows, spread: float) -> ColumnEvidence:
    """Work out what the rows of a pair say of its columns.

    What else curves the field (four shapes of second and third degree) tells how evenly the lens has left the
    rest.

    Parameters
    ----------
    rows : MeasuredRows
    spread : float
        Of the blocks from what is explained, px of the whole view.
    """
    seen, at, shape, factor = rows
    frame = _Frame.of(seen)
    design = frame.shapes
    shift = seen.shift + np.float64(1) * at.down(seen.x, seen.y, seen.near)
    fixed = seen.weight.astype(np.float64)
    fit = _settled(_least_squares(design[:7], shift, fixed), design[:7], shift, fixed, spread / factor)
    weight = fit.weight
    whole = _least_squares(design, shift, weight)
    variance = _variance(design[_LINEAR], _least_squares(design[_LINEAR], shift, weight), frame.tile)
    x, y, near = frame.half_width, frame.half_height, frame.near
    beyond = np.square(whole.values[7:]) - variance * np.diag(whole.inverse)[7:]
    units = np.array([1, x, y, x * y, near, y * y, y])[:, None]
    by_units = design[:7] * units
    told, other = np.array([2, 4, 6, 5]), np.array([0, 1, 3])
    normal, right = (by_units * weight) @ by_units.T / variance, (by_units * weight) @ shift / variance
    through = normal[np.ix_(told, other)] @ np.linalg.inv(normal[np.ix_(other, other)])
    information = normal[np.ix_(told, told)] - through @ normal[np.ix_(other, told)]
    return ColumnEvidence(
        information=information,
        told=right[told] - through @ right[other],
        offset=float(fit.values[0]),
        rotation=float(fit.values[1] / x),
        twist=float(fit.values[3] / (x * y)),
        twist_variance=float(variance * fit.inverse[3, 3] / (x * y) ** 2),
        unevenness=max(0.0, float(beyond.mean())),
        shapes=whole.values[7:],
        shape_variances=variance / BELIEF.tiles**2 * np.diag(whole.inverse)[7:],
        moved=_moved(design[:7], seen, frame, shift, fixed, fit.spread),
        reach=np.array([x, y]),
        shape=shape,
        factor=factor,
    )


def _moved(
    still: Floats, seen: SeenBlocks, frame: "_Frame", shift: Floats, fixed: Floats, spread: float
) -> float:
    """Return the slope along the rows that a road surely has since the rig has moved between its views.

    Px per px. Near things lie further outward in the later view: by y d in the rows and by x d in the
    columns, times one factor. On the road that is a slope of this factor times its disparity. `still` is the
    design of a rig that has not moved.
    """
    design = np.vstack([still, frame.design[2] * frame.design[4]])
    fit = _settled(_least_squares(design, shift, fixed), design, shift, fixed, spread)
    error = _SURELY * math.sqrt(_variance(design, fit, frame.tile) * float(fit.inverse[7, 7]))
    near = float(seen.near[seen.y > 0].mean()) if (seen.y > 0).any() else 0.0
    surely = max(0.0, abs(float(fit.values[7])) - error)
    return surely * near / (frame.half_height * frame.near)


def column_support(seen: ColumnEvidence, axis: Sequence[float] = (0.0, 0.0)) -> ColumnSupport:
    """Tell what of a scale, a twist and an offset is believed to be in the columns, too.

    Every choice of scale, tilt, bend and pitch explains the blocks, with what is known of rigs; the answer is
    the mean over them, each as likely as it explains what was seen. `axis` is the right view's principal
    point from the middle, px: a yaw or a pitch turns about it, which is in part a scale about the middle.
    """
    (x, y), (height, width) = seen.reach, seen.shape
    lens = seen.unevenness + (BELIEF.least * y) ** 2
    right, below = axis[0] / seen.factor, axis[1] / seen.factor
    from_axis = np.eye(4)
    from_axis[0, 3] = -2 * below
    scale, pitch = _mean_over_causes(
        from_axis.T @ seen.information @ from_axis,
        from_axis.T @ (seen.told + seen.twist * right * seen.information[0]),
        np.array([lens / y**2, 0, 0, lens / y**4]),
        seen.offset / np.square(np.array(BELIEF.focal) * width),
        seen.rotation + seen.twist * below,
    )
    yaw, skew = np.square(np.array([BELIEF.yaw, BELIEF.skew]) / (_FOCAL * width))
    # how many times likelier the shapes are those of a lens than none; a yaw makes none
    curved, even = (seen.shape_variances + each**2 for each in (BELIEF.lens_shape, BELIEF.no_shape))
    better = np.exp((np.square(seen.shapes) * (1 / even - 1 / curved)).sum() / 2)
    ratio = float(np.sqrt(np.prod(even / curved)) * better)
    error = lens / (x * y) ** 2 + seen.twist_variance
    twist, twist_error = _yaw_of_twist(seen.twist, error, yaw, skew, ratio)
    parts = scale[1], 2 * twist_error * height * _ROAD_ACROSS, pitch[1] * height * _ROAD_DOWN, seen.moved
    open_slope = float(np.linalg.norm(parts))
    larger = scale[0] - 2 * twist * right - pitch[0] * below
    return ColumnSupport(larger, twist, pitch[0], open_slope, parts[2]).resized(seen.factor)


def support_of_level(lies: Misalignment, errors: Misalignment, height: int) -> ColumnSupport:
    """Tell what is open in the columns of views that are left as they are, for they are nearly level.

    What of a scale and of a twist is surely in their rows may be in the columns, too. `lies` and `errors` are
    those that were measured, px of views of this height.
    """
    scale, twist = (
        math.sqrt(max(0.0, part**2 - (_SURELY * error) ** 2))
        for part, error in ((lies.scale, errors.scale), (lies.twist, errors.twist))
    )
    return replace(NO_SUPPORT, error=math.hypot(scale, 2 * twist * height * _ROAD_ACROSS))


def _yaw_of_twist(twist: float, error: float, yaw: float, skew: float, ratio: float) -> tuple[float, float]:
    """Return mean and standard deviation of what of a twist is a yaw, where its rows may be skewed alone.

    Parameters
    ----------
    twist : float
        1/pixels.
    error, yaw, skew : float
        Variances: of the twist, of those that yaws make, and of those of rows alone.
    ratio : float
        How many times likelier the rest of the field makes it that the rows alone are skewed.
    """
    other = np.array([error, error + skew])
    yaws = np.array([[0.0], [yaw]])
    whole = yaws + other
    density = np.exp(-(twist**2) / (2 * whole)) / np.sqrt(whole)
    density *= np.array([[1 - BELIEF.has_yaw], [BELIEF.has_yaw]])
    values, variances = twist * yaws / whole, yaws * other / whole
    often = density * [1 - BELIEF.has_skew, BELIEF.has_skew * ratio]
    # rows may be skewed with no other shape: that there is none narrows no interval
    often_doubted = density * [1 - BELIEF.may_skew, BELIEF.may_skew * max(1.0, ratio)]
    mean = float((often * values).sum() / often.sum())
    variance = (often_doubted * (np.square(values - mean) + variances)).sum() / often_doubted.sum()
    return mean, float(np.sqrt(variance))


def _mean_over_causes(
    information: Floats, told: Floats, lens: Floats, pitches: Floats, rotation: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return mean and standard deviation of scale and of pitch over all choices of causes.

    Parameters
    ----------
    information : ndarray, shape (4, 4)
        Of scale, tilt, bend and curve: what the blocks tell, the rest being free.
    told : ndarray, shape (4,)
        The same, times their values.
    lens : ndarray, shape (4,)
        Variances of what the lens leaves in each.
    pitches : ndarray
        Curves that the offset would have, were it a pitch, 1/px.
    rotation : float
        Of the rows, radians: a left camera that is rolled has as large a tilt, and a right one none.
    """
    has = np.array([BELIEF.has_scale, BELIEF.has_tilt, BELIEF.has_bend])
    may = np.array([BELIEF.may_scale, BELIEF.may_other, BELIEF.may_other])
    causes = np.array(list(product((False, True), repeat=3)))
    prior = np.zeros((len(causes), 4))
    prior[:, :3] = causes * np.square([BELIEF.scale, BELIEF.tilt, BELIEF.bend])
    own = prior[:, 0] / (prior[:, 0] + lens[0])  # what of the rows' scale is one of the columns
    prior += lens
    spread = np.eye(4) + information * prior[:, None, :]
    covariance = prior[:, :, None] * np.linalg.inv(spread)
    chances = np.stack([np.log(np.where(causes, often, 1 - often)).sum(axis=1) for often in (has, may)])
    chances -= np.linalg.slogdet(spread)[1] / 2

    known = np.array([(0.0, tilt, 0.0, curve) for tilt in (0.0, rotation) for curve in (0.0, *pitches)])
    how_often = np.append(1 - BELIEF.pitch, np.full(len(pitches), BELIEF.pitch / len(pitches)))
    rest = told - known @ information
    values = np.einsum("cij,pj->cpi", covariance, rest)
    left = np.array([(1 - often, often) for often in (BELIEF.has_left, BELIEF.may_left)])
    fits = np.log(np.kron(left, how_often)) + ((told + rest) * known).sum(axis=1) / 2
    likely = chances[:, :, None] + fits[:, None] + np.einsum("pi,cpi->cp", rest, values) / 2
    shares = np.exp(likely - likely.max(axis=(1, 2), keepdims=True))
    believed, doubted = shares / shares.sum(axis=(1, 2), keepdims=True)

    def summed(values: Floats, variance: Floats | float) -> tuple[float, float]:
        mean = float((believed * values).sum())
        return mean, float(np.sqrt((doubted * (np.square(values - mean) + variance)).sum()))

    scale_variances = np.square(own) * covariance[:, 0, 0] + own * lens[0]
    return summed(own[:, None] * values[..., 0], scale_variances[:, None]), summed(known[:, 3], 0.0)


class _Frame(NamedTuple):
    """Half the extent of what was seen, the tile that each block lies in, and what a misalignment does there.

    `design` has a row for each of the six parts, in `units` of them, and a column for each block.
    """

    half_width: float
    half_height: float
    near: float
    tile: NDArray[np.intp]
    design: Floats

    @staticmethod
    def of(seen: SeenBlocks) -> "_Frame":
        extent = np.array([max(1.0, float(np.abs(each).max())) for each in seen[:3]])
        column, row = (np.floor(each / _TILE).astype(np.intp) for each in seen[:2])
        row -= row.min()
        x, y, near = seen[:3] / extent[:, None]
        design = np.stack([np.ones_like(x), x, y, x * y, near, y * y])
        half_width, half_height, nearest = extent.tolist()
        tile = (column - column.min()) * (row.max() + 1) + row
        return _Frame(half_width, half_height, nearest, tile, design)

    @property
    def units(self) -> Floats:
        """What values of the design's rows are divided by to be parts of a misalignment."""
        x, y = self.half_width, self.half_height
        return np.array([1, x, y, x * y, self.near, y * y])

    @property
    def shapes(self) -> Floats:
        """The design, and what else rows may show: a bend of the lower half, and four shapes."""
        x, y = self.design[1:3]
        return np.stack([*self.design, np.maximum(y, 0), x * x, x * x * y, x * y * y, y**3])


class _Fit(NamedTuple):
    """A weighted least-squares fit: values, inverse of the normal equations, residuals, weights, spread."""

    values: Floats
    inverse: Floats
    off: Floats
    weight: Floats
    spread: float


def _least_squares(
    design: Floats, shift: Floats, weight: Floats, held: Floats | float = 0.0, to: Floats | float = 0.0
) -> _Fit:
    """Fit; `held` and `to` are what is added to the normal equations, to hold values near `to / held`."""
    weighted = design * weight
    normal = weighted @ design.T
    diagonal = normal.ravel()[:: len(normal) + 1]
    diagonal += held + 1e-6 * diagonal.sum()
    # a fifth of the time of `np.linalg.inv`
    inverse = np.asarray(cv2.invert(normal, flags=cv2.DECOMP_CHOLESKY)[1], np.float64)
    values = inverse @ (weighted @ shift + to)
    return _Fit(values, inverse, shift - values @ design, weight, 0.0)


def _robust(design: Floats, shift: Floats, fixed: Floats, start: tuple[Floats, float] | None = None) -> _Fit:
    """Fit in rounds, each block weighed by how far off it was in the last; `start`: before the first.

    Once the spread stays, it is held until the values do: it would go on to the few blocks that agree best.
    """
    off, spread = start or (np.zeros_like(fixed), 1.0)
    for _ in range(_FIT_ROUNDS):
        fit = _least_squares(design, shift, fixed * _believed(off, spread))
        off = fit.off
        before, spread = spread, 1.4826 * _median(np.abs(off)) + 1e-3
        if abs(spread - before) < _SAME_SPREAD * spread:
            break
    return _settled(fit, design, shift, fixed, spread)


def _settled(
    fit: _Fit,
    design: Floats,
    shift: Floats,
    fixed: Floats,
    spread: float,
    held: Floats | float = 0.0,
    to: Floats | float = 0.0,
) -> _Fit:
    """Go on from a fit, each block weighed by how far off it was, until its values stay; `spread` is held."""
    for _ in range(_FIT_ROUNDS):
        values = fit.values
        fit = _least_squares(design, shift, fixed * _believed(fit.off, spread), held, to)
        if np.abs(fit.values - values).max() < max(_SAME, _SAME_SHARE * np.abs(fit.values).max()):
            break
    return fit._replace(spread=spread)


def _variance(design: Floats, fit: _Fit, tile: NDArray[np.intp]) -> float:
    """Return what the inverse of the normal equations is multiplied by to be a covariance of values.

    From well determined values: where two columns are nearly one, sums over tiles do not see the doubt.
    """
    normal = (design * fit.weight) @ design.T
    scores = np.stack([np.bincount(tile, each) for each in design * (fit.weight * fit.off)])
    spread = fit.inverse @ scores  # blocks err together within a tile
    found = BELIEF.tiles**2 * float(np.trace(normal @ (spread @ spread.T))) / len(design)
    return max(found, _EXACT)


def _median(values: Floats) -> float:
    """Return the median, in a fifth of the time that `numpy.median` takes for a few hundred values."""
    middle = (values.size - 1) // 2, values.size // 2
    ordered = np.partition(values, middle)
    return float(ordered[middle[0]] + ordered[middle[1]]) / 2


def _believed(off: Floats, spread: float) -> Floats:
    """Return the weights of blocks by their residuals: far ones hardly count, and none is thrown away."""
    doubt: Floats = 1 + np.square(off / (_TUNING * spread))
    return 1 / np.square(doubt)
