"""Shift a map, block by block, to where the grey levels of both views agree.

Semi-global matching [Hirschmueller 2008] smooths along paths and truncates its costs: how far its disparities
lie off depends on the texture and the slant, and is one amount over whole parts of a road. That tilts its
plane. Least squares on the grey levels [Lucas and Kanade 1981] does neither: in each block, the left view is
compared with what the right view shows where a plane through the map leads, and the plane is shifted.
"""

from typing import NamedTuple

import cv2
import numpy as np

from rollcli.estimator.moments import Bools, Singles, strips
from rollcli.stereo import sampling
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.sampling import BLOCK
from rollcli.stereo.sgbm import STEEPEST
from rollcli.stereo.views import Views, resized

_KNOWN = 0.7  # share of a block that has to have a disparity: else its mean is not that of its middle
# px: how far the mean of the four blocks around may lie off; further is an edge. At half of it the noisy
# blocks of a road are left as they were, and its median error grows by a sixth; at twice it that is the same
_EDGE = 0.5
# px per row: the least that a road rises by, which is the baseline over the camera's height (0.07 and more)
# times the cosine of the roll. Walls, trees and sky are left as they are: they only take time
_LEAST_RISE = 0.01
# Squared grey levels per pixel: what a noise of one grey level adds to a squared gradient. Blocks with less
# texture keep most of what SGBM says. From 0.2 to 1 the errors of angles are the same
_RIDGE = 0.5
# A weak block, which the ridge holds back, goes as far in each as in two plain ones
_ROUNDS = 2
_LONGEST_STEP = 0.5  # px
_TOGETHER = 1 << 17  # pixels shifted at a time: what they need stays in the processor's cache

_OFF_MIDDLE = np.arange(BLOCK, dtype=np.float32) - np.float32((BLOCK - 1) / 2)
_PLANE = np.stack(  # what a value in the middle, a slope across and a slope down add at each pixel of a block
    [np.ones(BLOCK**2, np.float32), np.tile(_OFF_MIDDLE, BLOCK), np.repeat(_OFF_MIDDLE, BLOCK)]
)


def refined(disparity: Singles, views: Views, lies: Misalignment = LEVEL) -> Singles:
    """Shift each part of a map to where the grey levels agree.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Pixels, right to about half a pixel; no data is <= 0 and stays.
    views : pair of ndarray of uint8, shape (H, W)
        As they were given.
    lies : Misalignment
        How the right one lies, pixels; it may have been levelled by a little less or more for the match.

    Returns
    -------
    ndarray of float32, shape (H, W)
        What does not rise down the image, as a road does, parts with little texture, edges and what lies
        alone are left as they are.
    """
    height, width = (side // BLOCK for side in disparity.shape)
    if min(height, width) < 2:
        return disparity
    known = disparity > 0
    planes = _Planes.through(disparity, known)
    shifts = np.zeros((height, width), np.float32)
    for rows in strips(height, _TOGETHER // (width * BLOCK**2)):
        if planes.told[rows].any():
            shifts[rows][planes.told[rows]] = _found(views, planes, rows, lies)
    result = disparity.copy()
    whole = slice(0, height * BLOCK), slice(0, width * BLOCK)
    cv2.add(disparity[whole], _between(shifts), dst=result[whole], mask=known.view(np.uint8)[whole])
    return np.maximum(result, 0, out=result)  # what is shifted beyond infinity has no disparity


class _Planes(NamedTuple):
    """A plane through each block; arrays of shape (h, w).

    Attributes
    ----------
    middle : ndarray of float32
        Disparity in the middle, px.
    across, down : ndarray of float32
        Slopes, px per px.
    told : ndarray of bool
        Whether the map tells a plane there.
    """

    middle: Singles
    across: Singles
    down: Singles
    told: Bools

    @staticmethod
    def through(disparity: Singles, known: Bools) -> "_Planes":
        """Lay them through a map with these `known` pixels."""
        share = sampling.block_means(known.astype(np.float32))
        middle = sampling.block_means(disparity)
        middle /= np.maximum(share, np.float32(1e-3))
        beside = np.pad(middle, 1, mode="reflect", reflect_type="odd")  # beyond, as straight on as within
        left, right, above, below = beside[1:-1, :-2], beside[1:-1, 2:], beside[:-2, 1:-1], beside[2:, 1:-1]
        apart = np.float32(2 * BLOCK)
        across, down = (right - left) / apart, (below - above) / apart
        told = (share > _KNOWN) & (np.abs((left + right + above + below) / 4 - middle) < _EDGE)
        told &= (np.abs(across) < STEEPEST) & (down > _LEAST_RISE) & (down < STEEPEST)
        return _Planes(middle, across, down, told)


def _found(views: Views, planes: _Planes, rows: slice, lies: Misalignment) -> Singles:
    """Find the shifts of the planes that are told in some rows of blocks, px."""
    told, pixels = planes.told[rows], slice(rows.start * BLOCK, rows.stop * BLOCK)
    middle, across, down = (each[rows][told] for each in (planes.middle, planes.across, planes.down))
    row, column = (BLOCK * place.astype(np.float32) - _OFF_MIDDLE[0] for place in np.nonzero(told))
    row += np.float32(pixels.start)
    height, width = views[0].shape
    u, v = sampling.seen_at(lies, column - middle, row, (height, width), middle)
    x, y = column - middle - np.float32((width - 1) / 2), row - np.float32((height - 1) / 2)
    along, below = lies.slopes(x, y)  # within a block, what bends the rows is straight
    wider = 1 + lies.scale
    u = np.stack([u, wider * (1 - across), -wider * down - lies.rotation], axis=1) @ _PLANE
    v = np.stack([v, along * (1 - across), 1 + below - along * down], axis=1) @ _PLANE
    if lies == LEVEL:
        left, right, near = (*(view[pixels].astype(np.float32) for view in views), pixels)
    else:
        # its rows lie between those of the left one, and smoothing sees a row beside each. OpenCV's cubic
        # turned roads by 0.026 degrees (median) where a view lies 0.05 px off, a view twice as large by 0.012
        above = max(0, pixels.start - 1)
        left = sampling.smoothed(views[0][above : pixels.stop + 1])[pixels.start - above :]
        near = sampling.rows_around(v, height)
        right = sampling.smoothed_between(views[1][near].astype(np.float32))
    v -= np.float32(near.start)
    gradient = cv2.Sobel(left, cv2.CV_32F, 1, 0, ksize=1, scale=0.5).astype(np.float32, copy=False)
    grey = sampling.blocks_at(left, told)
    weight = sampling.blocks_at(gradient, told)
    weight -= weight.mean(axis=1, keepdims=True)  # one view may be brighter than the other
    power, ridge = np.einsum("ij,ij->i", weight, weight), np.float32(_RIDGE * BLOCK**2)
    # of what is left, a plain round takes the share s = power / (power + ridge), and this one s (2 - s);
    # and the right view is 1 - across as much stretched as the left one
    weight *= ((1 - across) * (power + 2 * ridge) / np.square(power + ridge))[:, None]
    shift: Singles = np.zeros_like(row)
    for _ in range(_ROUNDS):
        if lies == LEVEL:
            off = sampling.sampled(right, u, v, cv2.INTER_LINEAR) - grey
        else:
            off = sampling.grey_between(right, u, v)[2] - grey
        step = np.clip(np.einsum("ij,ij->i", weight, off), -_LONGEST_STEP, _LONGEST_STEP)
        u -= step[:, None]
        shift += step
    return shift


def _between(blocks: Singles) -> Singles:
    """Return values of blocks at every pixel, interpolated between their middles."""
    wider = np.pad(blocks, 1, mode="reflect", reflect_type="odd")
    size = wider.shape[1] * BLOCK, wider.shape[0] * BLOCK
    return resized(wider, size, cv2.INTER_LINEAR)[BLOCK:-BLOCK, BLOCK:-BLOCK]
