"""Disparity maps from stereo pairs with OpenCV's semi-global matching [Hirschmüller 2008]."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.imaging.stereo_options import StereoOptions as StereoOptions

MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
}
_SUBPIXELS = 16  # OpenCV stores sixteenths of a pixel


@dataclass(frozen=True)
class StereoMatch:
    """A disparity map and the range it was searched in.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        Pixels of the size matched at; no data is 0.
    min_disparity, num_disparities : int
        The range searched.
    end_fraction : float
        Share of the valid pixels within a pixel of the range's end: if large, the range was too short.
    """

    disparity: NDArray[np.float32]
    min_disparity: int
    num_disparities: int
    end_fraction: float


def compute_disparity(left: NDArray[Any], right: NDArray[Any], **options: Any) -> NDArray[np.float32]:
    """The disparity map of a rectified pair.

    Parameters
    ----------
    left, right : ndarray, shape (H, W) or (H, W, 3)
        uint8 or uint16, grey or BGR, of equal size.
    **options
        Fields of `StereoOptions`.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Pixels; no data is 0.

    Raises
    ------
    InputError
        The images differ in size, or are too small to match.
    UsageError
        An option makes no sense.
    """
    return match_pair(left, right, StereoOptions(**options)).disparity


def match_pair(left: NDArray[Any], right: NDArray[Any], options: StereoOptions) -> StereoMatch:
    """The disparity map of a rectified pair, with the range that was searched; see `compute_disparity`."""
    left, right = _prepared(left, options.downscale), _prepared(right, options.downscale)
    if left.shape != right.shape:
        sizes = " and ".join(f"{each.shape[1]}x{each.shape[0]}" for each in (left, right))
        raise InputError(f"left and right image differ in size: {sizes}")
    if options.num_disparities is None:
        options = replace(options, num_disparities=_find_range(left, right, options))
    disparity = _match(left, right, options)
    assert options.num_disparities is not None
    end = options.min_disparity + options.num_disparities - 2
    valid = np.count_nonzero(disparity)
    return StereoMatch(
        disparity=disparity,
        min_disparity=options.min_disparity,
        num_disparities=options.num_disparities,
        end_fraction=np.count_nonzero(disparity >= end) / valid if valid else 0.0,
    )


def _prepared(image: NDArray[Any], downscale: float) -> NDArray[np.uint8]:
    """Grey, 8 bits, at the size to match at."""
    if image.dtype == np.uint16:
        # a camera's 12 bits in 16 would come out black at a fixed shift
        image = cv2.convertScaleAbs(image, alpha=255 / max(int(image.max()), 1))
    if image.dtype != np.uint8 or image.ndim not in (2, 3):
        raise InputError(
            f"an image of {image.dtype} and shape {image.shape} cannot be matched; 8 or 16 bits are"
        )
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    if downscale != 1:
        size = tuple(max(1, round(side / downscale)) for side in image.shape[::-1])
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return image


def _match(left: NDArray[np.uint8], right: NDArray[np.uint8], options: StereoOptions) -> NDArray[np.float32]:
    """OpenCV SGBM over the given range; pixels, no data is 0."""
    assert options.num_disparities is not None
    area = options.block_size**2
    matcher = cv2.StereoSGBM.create(
        minDisparity=options.min_disparity,
        numDisparities=_multiple_of_16(options.num_disparities),
        blockSize=options.block_size,
        P1=8 * area,
        P2=32 * area,
        disp12MaxDiff=1,
        uniquenessRatio=options.uniqueness,
        speckleWindowSize=options.speckle_size,
        speckleRange=options.speckle_range,
        mode=MODES[options.mode],
    )
    sixteenths = matcher.compute(left, right)
    disparity: NDArray[np.float32] = np.maximum(sixteenths, 0) / np.float32(_SUBPIXELS)
    return disparity


def _find_range(left: NDArray[np.uint8], right: NDArray[np.uint8], options: StereoOptions) -> int:
    """The range that the pair itself shows when matched small, with a margin."""
    factor = max(1.0, left.shape[1] / 320)
    small_left, small_right = _prepared(left, factor), _prepared(right, factor)
    half = _multiple_of_16(small_left.shape[1] // 2)
    found = _match(
        small_left, small_right, replace(options, num_disparities=half, min_disparity=0, speckle_size=50)
    )
    valid = found[found > 0]
    if valid.size == 0:
        return 64
    top = float(np.percentile(valid, 99.5)) * factor
    return _multiple_of_16(round(1.1 * top) + 16 - options.min_disparity)


def _multiple_of_16(value: int) -> int:
    return max(16, -(-value // 16) * 16)
