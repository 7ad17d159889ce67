"""OpenCV's semi-global block matching [Hirschmüller 2008], with one set of smoothness costs."""

from dataclasses import replace

import cv2
import numpy as np

from rollcli.errors import InputError
from rollcli.imaging.stereo_options import StereoOptions
from rollcli.imaging.views import Map, Views, resampled, shrink_both

_MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
}
# Half of what OpenCV's own samples take: on a slanted road less smoothing is less bias (tests/benchmarks)
_SMALL_STEP_COST, _LARGE_STEP_COST = 4, 16
_SUBPIXELS = 16  # OpenCV stores sixteenths of a pixel
_STEP = 16  # px: widths that OpenCV takes
NARROWEST = _STEP
ALL_ROWS = slice(None)
_HH_BYTES = 4  # for each pixel and disparity: OpenCV keeps two costs of 16 bits
_MOST_HH_BYTES = 2**32  # 1920x1080 pixels over 256 disparities take less than half
# Rows beside those that are needed: what lies there smooths what is needed. The first 16 rows then differ by
# 0.001 px from a match of all rows, with 8 by 0.004, with none by 0.07
_MARGIN = 16
_SMALLER = 3  # times: what need not be matched at full size takes a 27th of the time


def usable_range(count: int, first: int, width: int, block_size: int) -> int:
    """Return the range `count` as OpenCV takes it; below `NARROWEST` there are no columns left to match."""
    furthest = (width - block_size - max(0, first, -first)) // _STEP * _STEP
    return min(-(-max(1, count) // _STEP) * _STEP, furthest)


def match_views(views: Views, first: int, count: int, options: StereoOptions) -> Map:
    """Match over `count` disparities from `first` on.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Pixels; no data is 0.

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
    sixteenths = np.maximum(matcher.compute(*views), 0)
    disparity = cv2.addWeighted(sixteenths, 1 / _SUBPIXELS, sixteenths, 0, 0, dtype=cv2.CV_32F)
    return disparity.astype(np.float32, copy=False)


def match_rows(
    views: Views, first: int, count: int, options: StereoOptions, rows: slice = ALL_ROWS, above: int = 0
) -> Map:
    """Match only what some rows need, and of these the ones above a row at a third of the size.

    Parameters
    ----------
    views, first, count, options
        See `match_views`.
    rows : slice
        Rows that are needed; elsewhere the map may hold no data.
    above : int
        The first row at full size. A third of the size takes a 27th of the time.
    """
    height, width = views[0].shape
    start, stop, _ = rows.indices(height)
    top, bottom = max(0, min(max(start, above), stop) - _MARGIN), min(height, stop + _MARGIN)
    if (top, bottom) == (0, height):
        return match_views(views, first, count, options)
    disparity = np.zeros((height, width), np.float32)
    left, right = (view[top:bottom] for view in views)
    disparity[top:bottom] = match_views((left, right), first, count, options)
    if start < top:
        left, right = (view[start : top + _MARGIN] for view in views)
        disparity[start:top] = _match_coarsely((left, right), first, count, options)[: top - start]
    return disparity


def _match_coarsely(views: Views, first: int, count: int, options: StereoOptions) -> Map:
    """Match at a third of the size; the map has the size of the views."""
    small = shrink_both(views, _SMALLER)
    first //= _SMALLER
    count = usable_range(-(-count // _SMALLER), first, small[0].shape[1], options.block_size)
    if count < NARROWEST:
        return np.zeros(views[0].shape, np.float32)
    patches = replace(options, speckle_size=options.speckle_size // _SMALLER**2)
    return resampled(match_views(small, first, count, patches), views[0].shape)
