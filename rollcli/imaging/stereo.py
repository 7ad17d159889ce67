"""Disparity maps from stereo pairs with OpenCV's semi-global matching [Hirschmüller 2008]."""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.imaging.alignment import moved_up, vertical_offset
from rollcli.imaging.disparity_range import largest_disparity
from rollcli.imaging.stereo_options import StereoOptions as StereoOptions

MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
}
Views = tuple[NDArray[np.uint8], NDArray[np.uint8]]
"""Left and right."""

# Half of what OpenCV's own samples take: on a slanted road less smoothing is less bias (tests/benchmarks)
_SMALL_STEP_COST, _LARGE_STEP_COST = 4, 16
_SUBPIXELS = 16  # OpenCV stores sixteenths of a pixel
_SMALL_WIDTH = 320  # px, to find the range at
_SMALL = StereoOptions(mode="3way", speckle_size=50, speckle_range=1)
_ALIGNED = 0.15  # px: a smaller vertical offset is not worth another match
_ALIGNMENTS = 3
_HIDDEN = 1.3  # a map that was matched with the offset hides a part of it: this many times what it shows


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
    vertical_offset : float
        By how much the right image was moved up before it was matched, px.
    """

    disparity: NDArray[np.float32]
    min_disparity: int
    num_disparities: int
    end_fraction: float
    vertical_offset: float


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

    Examples
    --------
    >>> left = np.random.default_rng(0).integers(0, 256, (60, 200), dtype=np.uint8)
    >>> right = np.roll(left, -12, axis=1)
    >>> disparity = compute_disparity(left, right, num_disparities=32)
    >>> float(np.median(disparity[disparity > 0]))
    12.0
    """
    return match_pair(left, right, StereoOptions(**options)).disparity


def match_pair(left: NDArray[Any], right: NDArray[Any], options: StereoOptions) -> StereoMatch:
    """The disparity map of a rectified pair, with the range that was searched; see `compute_disparity`."""
    if left.shape[:2] != right.shape[:2]:
        sizes = " and ".join(f"{each.shape[1]}x{each.shape[0]}" for each in (left, right))
        raise InputError(f"left and right image differ in size: {sizes}")
    views = _prepared(left, right, options.downscale)
    first, count = options.min_disparity, options.num_disparities
    if count is None:
        count = _find_range(views) - first
    width = views[0].shape[1]
    count = _usable_range(count, first, width, options.block_size)
    if count < 16:
        raise InputError(f"images {width} px wide are too narrow to match from disparity {first} on")
    disparity, offset = _aligned_match(views, first, count, options)
    valid = np.count_nonzero(disparity)
    return StereoMatch(
        disparity=disparity,
        min_disparity=first,
        num_disparities=count,
        end_fraction=np.count_nonzero(disparity >= first + count - 2) / valid if valid else 0.0,
        vertical_offset=offset,
    )


def _aligned_match(
    views: Views, first: int, count: int, options: StereoOptions
) -> tuple[NDArray[np.float32], float]:
    """The disparity of views brought to equal height, and how much lower the right one was."""
    left, right = views
    offset = options.vertical_offset or 0.0
    level = moved_up(right, offset)
    disparity = _match((left, level), first, count, options)
    for _ in range(_ALIGNMENTS if options.vertical_offset is None else 0):
        more = vertical_offset(left, level, disparity)
        if abs(more) < _ALIGNED:
            break
        offset += _HIDDEN * more
        level = moved_up(right, offset)
        disparity = _match((left, level), first, count, options)
    return disparity, offset


def _prepared(left: NDArray[Any], right: NDArray[Any], downscale: float) -> Views:
    """Grey, 8 bits, at the size to match at."""
    # cameras leave some of 16 bits unused: a fixed shift would make their images black
    brightest = max(int(left.max(initial=1)), int(right.max(initial=1)))
    return _plain(left, brightest, downscale), _plain(right, brightest, downscale)


def _plain(image: NDArray[Any], brightest: int, downscale: float) -> NDArray[np.uint8]:
    if image.dtype not in (np.uint8, np.uint16) or not (image.ndim == 2 or image.shape[2:] == (3,)):
        raise InputError(
            f"an image of {image.dtype} and shape {image.shape} cannot be matched: "
            "grey and BGR images of 8 and 16 bits can"
        )
    if image.dtype == np.uint16:
        image = cv2.convertScaleAbs(image, alpha=255 / brightest)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    return _shrunk(grey.astype(np.uint8, copy=False), downscale)


def _shrunk(image: NDArray[Any], factor: float) -> NDArray[np.uint8]:
    if factor == 1:
        return image
    height, width = (max(1, round(side / factor)) for side in image.shape)
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _find_range(views: Views) -> int:
    """Disparities from 0 to this are worth a search, pixels."""
    width = views[0].shape[1]
    factor = max(1.0, width / _SMALL_WIDTH)
    small = _shrunk(views[0], factor), _shrunk(views[1], factor)

    def match(count: float) -> NDArray[np.float32]:
        usable = _usable_range(math.ceil(count), 0, small[0].shape[1], _SMALL.block_size)
        return _match(small, 0, usable, _SMALL) if usable >= 16 else np.zeros(small[0].shape, np.float32)

    top = largest_disparity(match, small[0].shape[1])
    return int(width // 8 if top is None else math.ceil(1.1 * top * factor) + 8)


def _usable_range(count: int, first: int, width: int, block_size: int) -> int:
    """A multiple of 16, as OpenCV wants it, that leaves columns to match; 0 where there is none."""
    furthest = (width - block_size - max(0, first, -first)) // 16 * 16
    return min(-(-max(1, count) // 16) * 16, furthest)


def _match(views: Views, first: int, count: int, options: StereoOptions) -> NDArray[np.float32]:
    """OpenCV SGBM over `count` disparities from `first` on; pixels, no data is 0."""
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
        mode=MODES[options.mode],
    )
    sixteenths = matcher.compute(*views)
    disparity: NDArray[np.float32] = np.divide(np.maximum(sixteenths, 0), _SUBPIXELS, dtype=np.float32)
    return disparity
