"""OpenCV's semi-global block matching [Hirschmüller 2008], with one set of costs, and its lag on slopes."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.stereo.options import StereoOptions
from rollcli.stereo.views import Map, Views

# Of a mode, the most that it lags, px, on what rises ever more steeply, and the rise, px per row, with
# half of that. 0.1 px is 0.025 degrees of pitch at KITTI's size, and 0.045 at 640x480
LAGS = {"3way": (0.25, 0.22), "sgbm": (0.50, 0.25)}
_REACH = 6  # rows above and below: SGBM's steps of 1/16 px are then a hundredth of a road's rise
STEEPEST = 1.0  # px per px: more is an edge between two things
_GRID_STEP = 4  # of the grid on which the rise is taken: the lag is smooth
_AROUND = 9  # cells of the grid: where the rise is not known, it is that around


def without_lag(disparity: Map, mode: str) -> NDArray[np.float32]:
    """Add to each pixel what SGBM lags behind there.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        As SGBM finds it, px; no data is <= 0 and stays.
    mode : str
        One of `options.MODES`.

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    height, width = disparity.shape
    if mode not in LAGS or height <= 2 * _REACH:
        return disparity
    most, half_at = LAGS[mode]
    columns = disparity[:, ::_GRID_STEP]
    upper, lower = columns[: -2 * _REACH : _GRID_STEP], columns[2 * _REACH :: _GRID_STEP]
    rise = (lower - upper) / (2 * _REACH)
    known = ((upper > 0) & (lower > 0) & (np.abs(rise) < STEEPEST)).astype(np.float32)
    up = np.maximum(rise, 0)
    lags = (most * up / (up + half_at)).astype(np.float32) * known
    around = cv2.blur(known, (_AROUND, _AROUND))
    filled = np.where(known > 0, lags, cv2.blur(lags, (_AROUND, _AROUND)) / np.maximum(around, 1e-3))
    added = cv2.resize(filled, (width, height), interpolation=cv2.INTER_LINEAR).astype(np.float32, copy=False)
    added *= disparity > 0
    added += disparity
    return added


_MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
}
# Half of what OpenCV's own samples take: on a slanted road less smoothing is less bias
_SMALL_STEP_COST, _LARGE_STEP_COST = 4, 16
SUBPIXELS = 16  # OpenCV stores sixteenths of a pixel
_STEP = 16  # px: widths that OpenCV takes
NARROWEST = _STEP
_HH_BYTES = 4  # for each pixel and disparity: OpenCV keeps two costs of 16 bits
_MOST_HH_BYTES = 2**32  # 1920x1080 pixels over 256 disparities take less than half
# Rows above those that are needed: what lies there smooths what is needed. The first 16 rows then differ by
# 0.001 px from a match of all rows, with 8 by 0.004, with none by 0.07
MARGIN = 16


def usable_range(count: int, first: int, width: int, block_size: int) -> int:
    """Return the range `count` as OpenCV takes it; below `NARROWEST` there are no columns left to match."""
    furthest = (width - block_size - max(0, first, -first)) // _STEP * _STEP
    return min(-(-max(1, count) // _STEP) * _STEP, furthest)


def match_views(views: Views, first: int, count: int, options: StereoOptions) -> Map:
    """Match over `count` disparities from `first` on.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Pixels; no data is 0: also at `first` and below, where the best match may lie outside of the range.

    Raises
    ------
    InputError
        The mode hh would take too much memory.
    """
    height, width = views[0].shape
    taken = _HH_BYTES * height * (width - count) * count if options.mode == "hh" else 0
    if taken > _MOST_HH_BYTES:
        raise InputError(
            f"matching {width}x{height} pixels over {count} disparities in the mode hh would take "
            f"{taken / 2**30:.1f} GiB, and {_MOST_HH_BYTES >> 30} are allowed; give --downscale 2, fewer "
            "--num-disparities, or --sgbm-mode 3way"
        )
    area = options.block_size**2
    matcher = cv2.StereoSGBM.create(
        minDisparity=first,
        numDisparities=count,
        blockSize=options.block_size,
        P1=_SMALL_STEP_COST * area,
        P2=_LARGE_STEP_COST * area,
        disp12MaxDiff=1,
        uniquenessRatio=options.uniqueness,
        speckleWindowSize=options.speckle_size,
        speckleRange=options.speckle_range,
        mode=_MODES[options.mode],
    )
    # what has no match is (first - 1) * 16 to OpenCV, which is a disparity where first > 1
    _, sixteenths = cv2.threshold(matcher.compute(*views), SUBPIXELS * max(first, 0), 0, cv2.THRESH_TOZERO)
    disparity = cv2.addWeighted(sixteenths, 1 / SUBPIXELS, sixteenths, 0, 0, dtype=cv2.CV_32F)
    return disparity.astype(np.float32, copy=False)


def match_below(views: Views, first: int, count: int, options: StereoOptions, top: int) -> Map:
    """Match the rows from `top` on, shape (H - top, W); the other parameters are those of `match_views`."""
    above = max(0, top - MARGIN)
    left, right = (view[above:] for view in views)
    return match_views((left, right), first, count, options)[top - above :]
