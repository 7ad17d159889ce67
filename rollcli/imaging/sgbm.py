"""OpenCV's semi-global block matching [Hirschmüller 2008], with one set of smoothness costs."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.imaging.stereo_options import StereoOptions
from rollcli.imaging.views import Views

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


def usable_range(count: int, first: int, width: int, block_size: int) -> int:
    """The range `count` as OpenCV wants it, with columns left to match; below `NARROWEST` there are none."""
    furthest = (width - block_size - max(0, first, -first)) // _STEP * _STEP
    return min(-(-max(1, count) // _STEP) * _STEP, furthest)


def match_views(views: Views, first: int, count: int, options: StereoOptions) -> NDArray[np.float32]:
    """Match over `count` disparities from `first` on.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Pixels; no data is 0.
    """
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
    sixteenths = matcher.compute(*views)
    disparity: NDArray[np.float32] = np.divide(np.maximum(sixteenths, 0), _SUBPIXELS, dtype=np.float32)
    return disparity
