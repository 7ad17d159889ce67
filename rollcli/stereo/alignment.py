"""How the right view of a pair lies: its vertical disparity measured, and views levelled by it."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from rollcli.estimator.moments import Singles
from rollcli.stereo import row_fit, sampling
from rollcli.stereo.misalignment import LEVEL, TOLERANCE, Misalignment
from rollcli.stereo.sampling import BLOCK
from rollcli.stereo.views import Map, View, Views, resampled, resized, shrink_both, size_factor

_KNOWN = 0.7  # share of a block that has to have a disparity
_BORDER = 1.0  # px: what lies nearer to the right view's border, or beyond, is not compared
_RIDGE = 0.2  # squared grey levels per pixel: gradients along the rows below this are noise
_LEAST = 2.0  # the same, across the rows: a block with less says nothing
_ROUNDING = 0.99  # of a sum of 64 float32
# One with more counts no more than with this: an edge such as the horizon is off by as much, however strong.
# With 50, views of 1920x1080 that are turned aside were off by up to 0.5 degrees, with 30 by 0.16. With 20
# they are a little better, and of 100 warped empty roads with much noise one is off by 0.2 without a word
_MOST = 30.0
_FEWEST = 40  # blocks
_LONGEST_STEP = 1.5  # px, anywhere; along the rows, shorter ones take twice as many rounds
# px: a round that moves less is the last. With 0.05, angles of 6 of 41 real pairs moved by more than 0.01
# degrees with the last digits of grey levels
_SMALL_STEP = 0.01
# px: the same from the fourth round on. Where noise hides much of what is left, each round takes away a part;
# elsewhere further ones go to and fro by less than what they find is sure to
_UNSURE_STEP, _UNSURE_FROM = 0.05, 4
_HIDDEN = 5.0  # times: on empty roads with much noise a round finds a fifth of what there is


@dataclass(frozen=True)
class Measured:
    """What the vertical disparities of a pair say.

    Attributes
    ----------
    misalignment : Misalignment
        Of the right view, pixels of the size measured at.
    errors : Misalignment
        Standard error of each part.
    share : float
        Of the blocks that were looked at, those that told.
    spread : float
        Standard deviation of their vertical disparities from what is explained, outliers aside, pixels.
    rows : MeasuredRows
        The vertical disparities of the blocks.
    """

    misalignment: Misalignment
    errors: Misalignment
    share: float
    spread: float
    rows: row_fit.MeasuredRows

    @property
    def evidence(self) -> row_fit.ColumnEvidence:
        """What the rows say of the columns; worked out when it is asked for: most measurements need none."""
        return row_fit.column_evidence(self.rows, self.spread)

    def resized(self, factor: float) -> "Measured":
        """Return this measurement, of views `factor` times as large."""
        there, errors = self.misalignment.resized(factor), self.errors.resized(factor)
        rows = self.rows._replace(factor=factor * self.rows.factor)
        return Measured(there, errors, self.share, factor * self.spread, rows)


class Texture(NamedTuple):
    """What is compared of two views: smoothed grey levels, and their gradients in the left one.

    Arrays of shape (H, W): grey levels, and grey levels per pixel along the rows and down the columns; of the
    right view twice as large.
    """

    left: Singles
    right: Singles
    across: Singles
    down: Singles

    @staticmethod
    def of(views: Views) -> "Texture":
        """Work it out; a pair that is measured again and again needs it once."""
        # no more than grey levels between pixels need: a vertical shift of real views depends on the grain
        # that it is seen in, and the match sees all of it. Smoothed three times, 41 real pairs are off by
        # -0.010 degrees in place of +0.001 on average, four times by -0.019
        left = sampling.smoothed(views[0])
        return Texture(left, sampling.smoothed_between(views[1].astype(np.float32)), *_gradients(left))


def measure_misalignment(
    texture: Texture, disparity: Singles, start: Misalignment = LEVEL, rounds: int = 2, every: int = 1
) -> Measured | None:
    """Measure how the right view lies against the left one.

    Least squares on the grey levels at matched pixels [Lucas and Kanade 1981], in small blocks: each gives a
    horizontal shift, which takes up what is wrong in its disparity, and a vertical one. A robust fit to the
    vertical ones is the answer. Each round starts where the one before has moved the blocks, both ways.

    Parameters
    ----------
    texture : Texture
        Of the views as they were given.
    disparity : ndarray of float32, shape (H, W)
        From the left view to the right one that is levelled by `start`, pixels; no data is 0.
    start : Misalignment
        Where to begin.
    rounds : int
        Steps at most.
    every : int
        One block of so many is looked at.

    Returns
    -------
    Measured or None
        None where too few blocks tell.
    """
    if min(disparity.shape) < BLOCK:
        return None
    blocks = _Blocks(texture, disparity, start, every)
    found, last = start, None
    for done in range(1, rounds + 1):
        seen = blocks.vertical(found)
        if len(seen.shift) < _FEWEST:
            return None
        last = fit = row_fit.fit_rows(seen, found, last)
        reach = fit.lies.reach(*disparity.shape)
        step = fit.lies.times(_LONGEST_STEP / max(reach, _LONGEST_STEP))
        before, found = found, (found + step).rounded(*disparity.shape)
        blocks.follow(step)
        enough = _SMALL_STEP if done < _UNSURE_FROM else _UNSURE_STEP
        # or the views would be level even if most of how they lie were still hidden
        if reach < enough or TOLERANCE.allows(found.times(_HIDDEN), fit.errors, disparity.shape):
            break
    height, width = disparity.shape
    rows = row_fit.MeasuredRows(seen, before, (height, width))
    return Measured(found, fit.errors, len(seen.shift) / blocks.count, fit.spread, rows)


def textured_share(view: View) -> float:
    """Return the share of a view's blocks that could tell a vertical disparity, were they matched."""
    if min(view.shape) < BLOCK:
        return 0.0
    across, down = _gradients(sampling.smoothed(view))
    along = sampling.block_means(across * across) + np.float32(_RIDGE)
    weight = sampling.block_means(down * down) - np.square(sampling.block_means(across * down)) / along
    return float(np.mean(weight > _LEAST))


class _Blocks:
    """The blocks of a pair; what does not change from round to round is computed once.

    A block's least-squares shift is the sum of its grey differences, each times a share that the gradients
    decide: `_share` for the shift down the rows, and `_shift_along` for that along them, less `_mixed` times
    the one down the rows. Arrays of pixels have shape (blocks, pixels of a block).
    """

    def __init__(self, texture: Texture, disparity: Singles, start: Misalignment, every: int) -> None:
        self._right, self._shape = texture.right, texture.left.shape
        row, column = (np.arange(side // BLOCK) for side in disparity.shape)
        places = (row[:, None] + 2 * column) % every == 0
        self.count = int(np.count_nonzero(places))
        far = sampling.blocks_at(disparity, places)
        known = np.count_nonzero(far > 0, axis=1) > _KNOWN * BLOCK**2
        places[places] = known
        far, down = far[known], sampling.blocks_at(texture.down, places)
        varies = np.einsum("ij,ij->i", down, down) / BLOCK**2 - np.square(down.mean(axis=1))
        # of a block's squares no more is left than all of them, over a count of `_KNOWN` of it or more
        telling = varies > np.float32(_LEAST * _KNOWN * _ROUNDING)
        places[places] = telling
        far, self._down = far[telling], down[telling]
        self._left, self._across = (
            sampling.blocks_at(each, places) for each in (texture.left, texture.across)
        )
        rows, columns = (BLOCK * place[:, None].astype(np.float32) for place in np.nonzero(places))
        within = np.arange(BLOCK, dtype=np.float32)
        self._v = rows + np.repeat(within, BLOCK)
        self._u = columns + np.tile(within, BLOCK) - far
        self._near = far.sum(axis=1) / np.maximum(np.count_nonzero(far, axis=1), 1).astype(np.float32)
        height, width = self._shape
        u, v = sampling.seen_at(start, self._u, self._v, self._shape, self._near[:, None])
        seen = (far > 0) & (u > _BORDER) & (u < width - 1 - _BORDER)
        seen &= (v > _BORDER) & (v < height - 1 - _BORDER)
        x, y = self._u - np.float32((width - 1) / 2), self._v - np.float32((height - 1) / 2)
        self._weigh(seen.astype(np.float32), x, y)
        self._along = np.zeros(len(self._u), np.float32)

    def _weigh(self, seen: Singles, x: Singles, y: Singles) -> None:
        """Work the shares out from the gradients and places of the pixels that are `seen` (1; others 0)."""
        count = np.maximum(seen.sum(axis=1), np.float32(1))
        across, down = self._across * seen, self._down * seen

        def mean(one: Singles, other: Singles) -> Singles:
            return np.asarray(np.einsum("ij,ij->i", one, other) / count)

        # covariances within a block: the views' brightness may differ from place to place
        mean_across, mean_down = mean(across, seen), mean(down, seen)
        varies = mean(across, across) - np.square(mean_across) + np.float32(_RIDGE)
        self._mixed = (mean(across, down) - mean_across * mean_down) / varies
        weight = mean(down, down) - np.square(mean_down) - np.square(self._mixed) * varies
        weight[(weight <= _LEAST) | (count <= _KNOWN * BLOCK**2)] = 0
        along = across - mean_across[:, None] * seen
        share = down - mean_down[:, None] * seen - self._mixed[:, None] * along
        self._share = share / (np.maximum(weight, np.float32(_LEAST)) * count)[:, None]
        self._shift_along = along / (varies * count)[:, None]
        self._weight = np.minimum(weight, np.float32(_MOST))
        self._x, self._y = mean(x, seen), mean(y, seen)

    def vertical(self, at: Misalignment) -> row_fit.SeenBlocks:
        """Return the vertical disparities that are left when the right view is levelled by `at`."""
        u, v = sampling.seen_at(at, self._u, self._v, self._shape, self._near[:, None])
        if not len(u):
            return row_fit.SeenBlocks(*(self._near,) * 5)
        read_u, read_v, grey = sampling.grey_between(self._right, u, v)
        off = self._left - grey
        # else steps of less than a 64th of a pixel are none, or one, and measuring does not settle
        off -= self._across * (u - read_u) + self._down * (v - read_v)
        shift = np.einsum("ij,ij->i", self._share, off)
        self._along = np.einsum("ij,ij->i", self._shift_along, off)
        told, telling = (self._x, self._y, self._near, shift, self._weight), self._weight > 0
        return row_fit.SeenBlocks(*(each[telling] for each in told))

    def follow(self, step: Misalignment) -> None:
        """Move the blocks along the rows, to where the grey levels agree once the views lie `step` further.

        A disparity that was matched in the wrong row is wrong by what hides that. Noise in the gradients lets
        least squares take up a part of it only: without this, a fifth to a half stays hidden.
        """
        down = step.down(self._x, self._y, self._near)
        moved = np.clip(self._along - self._mixed * down, -_LONGEST_STEP, _LONGEST_STEP)
        self._u += moved[:, None]


def _gradients(view: Singles) -> tuple[Singles, Singles]:
    """Grey levels per pixel along the rows and down the columns."""
    across, down = (cv2.Sobel(view, cv2.CV_32F, *order, ksize=3, scale=0.125) for order in ((1, 0), (0, 1)))
    return across.astype(np.float32, copy=False), down.astype(np.float32, copy=False)


_MEASURED_AT = 120_000  # px: larger views are measured at this size: right to a fifth of the tolerance
_WHOLE_FROM = 1.5  # times smaller: from here on a whole number, since means of whole pixels are quick
# px, once a pair is matched: the whole of most views. A level road of fine grain seems 0.06 % larger at
# 120,000 and 0.02 % at its 307,000. More would take 25 bytes for each pixel of a large photo
_CLOSER = 480_000
_FURTHEST = 2.0  # times the last change; further away, two measurements do not tell
_NO_CHANGE = 1e-6  # px^2
_AROUND = 7  # px of a small map: what is smoothed; a tilt moves by 0.3 px at most, and this is a tenth of it


def level(right: View, misalignment: Misalignment, near: Map | None = None) -> View:
    """Resample the right view once, as a level camera would have seen it; rows at the border repeat.

    Parameters
    ----------
    right : ndarray of uint8, shape (H, W)
    misalignment : Misalignment
    near : ndarray of float32, optional
        Disparities of the right view at any size, in its own pixels: without them a tilt is left as it is.
    """
    if misalignment == LEVEL:
        return right
    height, width = right.shape
    u = np.arange(width, dtype=np.float32)
    v = np.arange(height, dtype=np.float32)[:, None]
    far: Map | float = 0.0
    if near is not None and misalignment.tilt:
        far = resized(near, (width, height), cv2.INTER_LINEAR) * np.float32(width / near.shape[1])
    at_u, at_v = sampling.seen_at(misalignment, u, v, right.shape, far)
    return sampling.sampled(right, at_u, at_v, cv2.INTER_CUBIC)


def seen_from_right(disparity: Map) -> Map:
    """Return a smooth map of the right view's disparities, px, from the left view's; 0 is no data there.

    What hides the rest counts, and gaps are filled from around.
    """
    v, u = np.nonzero(disparity > 0)
    known = disparity[v, u]
    at = np.rint(u - known).astype(np.intp)
    order = np.flatnonzero(at >= 0)[np.argsort(known[at >= 0], kind="stable")]
    seen = np.zeros_like(disparity)
    seen[v[order], at[order]] = known[order]
    around = _AROUND, _AROUND
    share = cv2.blur((seen > 0).astype(np.float32), around)
    return np.divide(cv2.blur(seen, around), np.maximum(share, np.float32(1e-3)), dtype=np.float32)


class Approach:
    """Where to measure next, from where was measured before and what came of it.

    A map that was matched with a misalignment hides a part of it, up to four fifths where the texture is
    slanted. Two measurements tell how much: the next attempt is the fixed point of the line through them
    [Anderson 1965, depth 1].
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape
        self._before: tuple[Misalignment, Misalignment] | None = None

    def next(self, at: Misalignment, measured: Misalignment) -> Misalignment:
        """Return the next start after `measured` was found from `at`."""
        before, self._before = self._before, (measured, measured - at)
        if before is None:
            return measured
        measured_before, left_before = before
        left = measured - at
        change = np.array((left - left_before).shifts(*self._shape))
        share = float(np.dot(left.shifts(*self._shape), change) / (np.dot(change, change) + _NO_CHANGE))
        share = max(-_FURTHEST, min(_FURTHEST, share))
        return measured - (measured - measured_before).times(share)


class SmallViews:
    """The views of a pair at the size that they are measured at; large ones are shrunk once.

    Parameters
    ----------
    whole : pair of ndarray of uint8, shape (H, W)
        Left and right, as they are matched.
    given : pair of ndarray of uint8, optional
        The same before `downscale`, where there was any: at half the size a bend and a scale are told apart
        half as surely.
    pixels : int
        Of the size measured at.

    Attributes
    ----------
    shape : tuple of int
        Of the whole views.
    whole : pair of ndarray of uint8, shape (H, W)
    factor : float
        How many times smaller than the whole ones they are measured at; below 1 after a `downscale`.
    """

    def __init__(self, whole: Views, given: Views | None = None, pixels: int = _MEASURED_AT) -> None:
        self.whole, self._given = whole, given or whole
        self.shape = whole[0].shape
        larger = self._given[0].shape
        factor = size_factor(larger, pixels)
        self._shrunk = round(factor) if factor > _WHOLE_FROM else factor
        self.factor = self._shrunk * self.shape[1] / larger[1]

    @cached_property
    def views(self) -> Views:
        """Both views at that size; a pair that is level at the first look needs none."""
        return shrink_both(self._given, self._shrunk)

    @cached_property
    def closer(self) -> "SmallViews":
        """The same pair at four times as many pixels, as far as it has them."""
        return SmallViews(self.whole, self._given, _CLOSER)

    @cached_property
    def _texture(self) -> Texture:
        return Texture.of(self.views)

    def measure(
        self, disparity: Map, start: Misalignment, rounds: int = 2, every: int = 1
    ) -> Measured | None:
        """Measure how the right view lies.

        Parameters
        ----------
        disparity : ndarray of float32
            Of the pair at any size, in its own pixels; no data is 0.
        start : Misalignment
            Where to begin; pixels of the whole views.
        rounds, every : int
            See `measure_misalignment`; of views of more than 120,000 pixels fewer blocks are looked at.

        Returns
        -------
        Measured or None
            Pixels of the whole views.
        """
        seen = resampled(disparity, self.views[0].shape)
        every *= max(1, round(seen.size / _MEASURED_AT))
        found = measure_misalignment(self._texture, seen, start.resized(1 / self.factor), rounds, every)
        return None if found is None else found.resized(self.factor)
