"""The two views of a pair as they are matched: grey, 8 bits, at one size."""

import math
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.estimator.moments import Bools, Singles

Number = TypeVar("Number", np.float32, np.uint8)

View = NDArray[np.uint8]
"""Shape (H, W)."""

Views = tuple[View, View]
"""Left and right."""

Map = Singles
"""Disparities in pixels, shape (H, W); no data is 0."""


def prepare_views(left: NDArray[Any], right: NDArray[Any]) -> Views:
    """Make both views grey and 8 bits deep.

    Raises
    ------
    InputError
        An image is None, or of a kind that cannot be matched, or they differ in size.
    """
    for side, image in (("left", left), ("right", right)):
        if not isinstance(image, np.ndarray) or image.ndim < 2:
            reason = "is None: it was not read" if image is None else "is no array of pixels"
            raise InputError(f"the {side} image {reason}")
    if left.shape[:2] != right.shape[:2]:
        sizes = " and ".join(f"{each.shape[1]}x{each.shape[0]}" for each in (left, right))
        raise InputError(f"left and right image differ in size: {sizes}")
    if 0 in left.shape[:2]:
        raise InputError(f"the images have no pixels: {left.shape[1]}x{left.shape[0]}")
    left, right = np.asarray(left), np.asarray(right)  # of masked arrays what lies below the mask
    deep = [each for each in (left, right) if each.dtype.kind == "u" and each.dtype.itemsize == 2]
    # cameras leave some of 16 bits unused: a fixed shift would make their images black
    white = max(map(_brightest, deep), default=1)
    few = [each[::_EVERY, ::_EVERY].ravel() for each in deep]
    curve = _spread(np.concatenate(few), white, _MOST_SPREAD_OF_16) if few else None
    return _plain(left, white, curve), _plain(right, white, curve)


_HOT = 10_000  # pixels, of which one may be brighter than white: some of a sensor are defect


def _brightest(image: NDArray[Any]) -> int:
    """Return the brightest level but for defect pixels, at least 1."""
    last = image.size - 1 - image.size // _HOT
    return max(1, int(np.partition(image, last, axis=None)[last]))


_EVERY = 8  # rows and columns, of which one tells: enough for quantiles
_QUANTILES = np.linspace(0.05, 0.95, 19)
# times as bright, from which on a view is brightened: none of 79 real pairs differs by more. Of 18 streets 4
# were taken for two scenes where one view was 1.56 times as bright
_AS_BRIGHT = 1.12


def as_bright(views: Views) -> Views:
    """Brighten the darker view to the other's grey levels, where one was exposed longer: costs compare them.

    Cameras may differ in gain, in offset and in gamma: a curve through quantiles of both takes up all three.
    Those that are black or white in one of the views tell nothing: they may have been clipped. Nor does the
    border of either view, which the other may not have.
    """
    levels = _levels(views)
    if not levels[0].size:
        return views
    places = (_QUANTILES * levels[0].size).astype(np.intp)
    left, right = (each[places].astype(np.float64) for each in levels)
    told = (np.minimum(left, right) > 0) & (np.maximum(left, right) < 255)
    gain = float(np.median(left[told] / right[told])) if told.any() else 1.0
    if max(gain, 1 / gain) < _AS_BRIGHT:
        return views
    if gain > 1:
        return views[0], _brighter(right[told], left[told])[views[1]]
    return _brighter(left[told], right[told])[views[0]], views[1]


def _levels(views: Views) -> list[View]:
    """Return grey levels of each view, ascending, where neither is empty."""
    few = [each[::_EVERY, ::_EVERY] for each in views]
    shown = ~(_empty(few[0], views[0]) | _empty(few[1], views[1]))
    return [np.sort(each[shown], kind="stable") for each in few]  # a radix sort, in a fifth of the time


def _brighter(dark: NDArray[np.float64], bright: NDArray[np.float64]) -> View:
    """Return what each grey level becomes, from quantiles of both views: straight between them.

    Below the first and above the last, as many times as bright as these become.
    """
    at, same = np.unique(dark, return_inverse=True)
    to = np.bincount(same, bright) / np.bincount(same)
    at, to = np.append(at, 256), np.append(to, 256 * to[-1] / at[-1])
    curve = np.interp(np.arange(256), np.append(0, at), np.append(0, to))
    return np.asarray(np.minimum(np.rint(curve), 255), np.uint8)


_OUTSIDE = 0.01  # share of the pixels that may be darker, and brighter: lamps are
# grey levels, from the first of the others to the last, from which on views stay as they are: all of 79 real
# pairs have 211 and more, rendered ones 140
_CLEAR = 128
_SPREAD = 16, 240  # where the first and the last come to lie; what is beyond goes on to black and to white
# times: more spreads noise. Of the 41 pairs at an eighth of their brightness with a noise of one grey level,
# one that is ok is off by more than 0.25 degrees; with 8 times five are
_MOST_SPREAD = 4.0
_MOST_SPREAD_OF_16 = 16.0  # which have finer steps


def as_clear(views: Views) -> Views:
    """Spread the grey levels of views that are dark or hazy: how much is texture is told in grey levels.

    Of 41 real pairs at a quarter of their brightness the mean error is -0.004 degrees in place of -0.044, and
    0.98 are covered in place of 0.90 (tests/benchmarks/bench_lidar.py).
    """
    curve = _spread(np.concatenate(_levels(views)), 255, _MOST_SPREAD)
    return views if curve is None else (curve[views[0]], curve[views[1]])


def _spread(levels: NDArray[Any], white: int, most: float) -> View | None:
    """Return what each level becomes of images that have these, 0 aside; None where they are clear."""
    levels = levels[levels > 0]
    if not levels.size:
        return None
    outside = int(_OUTSIDE * levels.size)
    first, last = (int(each) for each in np.sort(levels, kind="stable")[[outside, -1 - outside]])
    share = (last - first) / white
    if not 0 < share < _CLEAR / 255:
        return None
    darkest, brightest = _SPREAD
    brightest = min(brightest, darkest + round(most * 255 * share))
    every = np.arange(np.iinfo(levels.dtype).max + 1)
    become = np.interp(every, (0, first, last, white), (0, darkest, brightest, 255))
    return np.asarray(np.rint(become), np.uint8)


# times as much of it, from which on a view is smoothed: none of 79 real pairs differs by more than 1.22, and
# all of those with lidar by 1.33 and more where the right view is blurred by 0.5 px
_AS_SHARP = 1.25
_BLURS = 0.25, 4.0  # px, the least and the most
_HALVINGS = 8


def as_sharp(views: Views) -> Views:
    """Smooth the sharper view until it is as sharp as the other, where one is out of focus.

    Where fine texture is in one view alone, costs compare it with none, and so do the least squares that
    measure how the right view lies.
    """
    fine = _fineness(views[0]), _fineness(views[1])
    if max(fine) < _AS_SHARP * min(fine):
        return views
    sharper = int(fine[1] > fine[0])
    least, most = _BLURS
    for _ in range(_HALVINGS):
        middle = (least + most) / 2
        blurred: View = cv2.GaussianBlur(views[sharper], (0, 0), middle).astype(np.uint8, copy=False)
        if _fineness(blurred) > min(fine):
            least = middle
        else:
            most = middle
    return (views[0], blurred) if sharper else (blurred, views[1])


def _fineness(view: View) -> float:
    """Return how much of what varies down the columns does so from row to row; gain and offset leave it."""
    few = view[:, ::_EVERY].astype(np.float32)
    near, far = (float(np.sum(np.square(few[step:] - few[:-step]))) for step in (1, 4))
    return near / far if far else 1.0


_DARK = 128  # grey level; skies are brighter, and of one level where they are overexposed
_PATCH = np.ones((3, 3), np.uint8)  # px: single pixels are clipped where there is texture
_AROUND = np.ones((5, 5), np.uint8)  # px: makes a patch as large again, and a pixel larger


def shows_nothing(view: View) -> Bools | None:
    """Return the pixels of a view in patches that are clipped or have no data; None: there are none.

    What is clipped to black or white looks the same, and a match fills it from beside it.
    """
    flat = _empty(view, view) | (view == 255)
    if not flat.any():
        return None
    patches = cv2.erode(flat.view(np.uint8), _PATCH)
    return cv2.dilate(patches, _AROUND).view(np.bool_) if patches.any() else None


def _empty(pixels: View, view: View) -> Bools:
    """Return which pixels of a view are black, as the border is that rectification leaves.

    So are those of a dark edge of one grey level throughout: bars of videos have 16.
    """
    empty: Bools = pixels == 0
    for edge in (view[0], view[-1], view[:, 0], view[:, -1]):
        if 0 < edge[0] < _DARK and (edge == edge[0]).all():
            empty |= pixels == edge[0]
    return empty


def matched_shape(shape: tuple[int, ...], downscale: float) -> tuple[int, int]:
    """Return the shape that an image of this shape is matched at."""
    height, width = (max(1, round(side / downscale)) for side in shape[:2])
    return height, width


def size_factor(shape: tuple[int, ...], pixels: int) -> float:
    """Return the factor that shrinks a view of this shape to that many pixels; 1 if it has no more."""
    return max(1.0, math.sqrt(shape[0] * shape[1] / pixels))


_HALVED_FROM = 4  # times smaller: views are halved first; means of four pixels take a thirtieth of the time


def shrink(view: NDArray[Any], factor: float) -> View:
    """Shrink the view by `factor`, to be matched: each side as its calibration is; 1 leaves it as it is."""
    if factor == 1:
        return view
    height, width = matched_shape(view.shape, factor)
    return cv2.resize(view, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _by_halves(view: View, factor: float) -> View:
    """Shrink a view by halves, to be looked at: an odd side becomes up to half a pixel too long."""
    height, width = matched_shape(view.shape, factor)
    while factor == 2 or factor >= _HALVED_FROM:
        view, factor = _halved(view), factor / 2
    return shrink(view, factor)[:height, :width]


def _halved(view: NDArray[Any]) -> View:
    """Return means of four pixels. An odd last row or column counts twice: else it takes ten times longer."""
    height, width = view.shape
    if height % 2 or width % 2:
        view = cv2.copyMakeBorder(view, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    size = (width + 1) // 2, (height + 1) // 2
    return cv2.resize(view, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def shrink_both(views: Views, factor: float) -> Views:
    """Both views, `factor` times smaller, to be looked at."""
    left, right = (_third(each, factor) if round(factor) == 3 else _by_halves(each, factor) for each in views)
    return left, right


def _third(view: View, factor: float) -> View:
    """Shrink a view to about a third: means of nine pixels about each point take a quarter of areas' time."""
    height, width = matched_shape(view.shape, factor)
    means = cv2.blur(view, (3, 3)).astype(np.uint8, copy=False)
    return resized(means, (width, height), cv2.INTER_LINEAR_EXACT)


def resized(pixels: NDArray[Number], size: tuple[int, int], how: int) -> NDArray[Number]:
    """Return an image at another size, width and height, as OpenCV interpolates it."""
    return cv2.resize(pixels, size, interpolation=how).astype(pixels.dtype, copy=False)


def resampled(disparity: Map, shape: tuple[int, ...]) -> Map:
    """Return a map at another size, in pixels of that; 0 where not all that a value is made of is known."""
    if disparity.shape == shape:
        return disparity
    size = shape[1], shape[0]
    scale = np.float32(shape[1] / disparity.shape[1])
    if scale < 1:  # one pixel of a few says the same, and edges stay edges
        return resized(disparity, size, cv2.INTER_NEAREST) * scale
    known = resized((disparity > 0) * np.uint8(255), size, cv2.INTER_LINEAR)
    larger = resized(disparity * scale, size, cv2.INTER_LINEAR)
    larger *= known == 255
    return larger


def _plain(image: NDArray[Any], white: int, curve: View | None) -> View:
    image = image.astype(image.dtype.newbyteorder("="), copy=False)
    if image.dtype not in (np.uint8, np.uint16) or not (image.ndim == 2 or image.shape[2:] == (3,)):
        raise InputError(
            f"an image of {image.dtype} and shape {image.shape} cannot be matched: "
            "grey and BGR images of 8 and 16 bits can"
        )
    if image.dtype == np.uint16:
        image = cv2.convertScaleAbs(image, alpha=255 / white) if curve is None else curve[image]
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    return grey.astype(np.uint8, copy=False)
