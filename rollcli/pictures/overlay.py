"""Pictures of disparity maps, of the road found in them, and of heights over it."""

import math
from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Singles, strips
from rollcli.pictures.heights import METRES

Pixels = NDArray[np.uint8]


def round_step(least: float) -> float:
    """Return the next round number: 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(each * power for each in (1, 2, 5, 10) if each * power >= least * (1 - 1e-9))


def unit_of_rows(height: int) -> int:
    """Return by what the margins and letters beside a map of so many rows are enlarged."""
    return max(1, height // _UNIT_ROWS)


_ROAD = (220, 230, 40)  # BGR
_TINT = 0.5
_BLOCK = 2**20  # pixels at a time: what they need is large in large maps
_UNIT_ROWS = 480  # sizes below are pixels; a map of so many times these rows has them so many times larger
BAR_WIDTH = 64  # of the colour bar
_LABEL_EVERY = 50  # along the bar
INK, FONT, FONT_SIZE = (60, 60, 60), cv2.FONT_HERSHEY_SIMPLEX, 0.36


def draw_disparity(disparity: NDArray[Any]) -> Pixels:
    """Draw a map in colour: dark is far, bright is near, black is no data.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3)
        BGR.
    """
    values = np.asarray(disparity)
    # 0 for no data, 1..255 for small to large disparities
    top, levels = brightest(values), np.empty(values.shape, np.uint8)
    for rows in strips(len(values), _BLOCK // max(1, values.shape[1])):
        some = values[rows]
        valid = np.isfinite(some) & (some > 0)
        levels[rows] = np.where(valid, np.clip(np.where(valid, some, 0) * (255 / top), 1, 255), 0)
    return cv2.applyColorMap(levels, _colours().reshape(256, 1, 3)).astype(np.uint8, copy=False)


def draw_road(disparity: NDArray[Any], mask: NDArray[Any], photo: NDArray[Any] | None = None) -> Pixels:
    """Draw a map in colour, as `draw_disparity` has it, or a camera image with the road tinted and outlined.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.
    mask : ndarray, shape (H, W)
        Non-zero where the road is.
    photo : ndarray, shape (H', W') or (H', W', 3), optional
        Grey or BGR, uint8 or uint16: drawn in place of the map, at the size of the mask.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3)
        BGR.
    """
    height, width = np.shape(mask)
    picture = draw_disparity(disparity) if photo is None else as_bgr(photo, (width, height))
    road = (np.asarray(mask) != 0).astype(np.uint8)
    tint = np.arange(256)[:, None] * (1 - _TINT) + np.array(_ROAD) * _TINT
    cv2.copyTo(cv2.LUT(picture, tint.astype(np.uint8).reshape(256, 1, 3)), road, picture)
    outlines, _ = cv2.findContours(road, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return cv2.drawContours(picture, outlines, -1, _ROAD, 1).astype(np.uint8, copy=False)


def draw_preview(disparity: NDArray[Any]) -> Pixels:
    """Draw a map in colour, as `draw_disparity` has it, with a colour bar that names disparities in pixels.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.

    Returns
    -------
    ndarray of uint8, shape (H, W + BAR_WIDTH, 3)
        BGR; see `with_bar`.
    """
    picture = draw_disparity(disparity)
    height, top = len(picture), brightest(np.asarray(disparity))
    step = round_step(top * _LABEL_EVERY * unit_of_rows(height) / height) if height > _LABEL_EVERY else top
    labels = (number * step for number in range(int(top / step * (1 + 1e-9)) + 1))
    ticks = [(label / top, f"{label:g}" if label else "0 px") for label in labels]
    return with_bar(picture, _colours()[:0:-1], ticks)


def as_bgr(photo: NDArray[Any], size: tuple[int, int]) -> Pixels:
    """Return a new BGR image, uint8, of a camera image, grey or BGR, uint8 or uint16, at (width, height)."""
    pixels = photo
    if photo.dtype != np.uint8:  # cameras leave some of 16 bits unused: what is bright in the image is white
        white = max(float(np.percentile(photo[::_EVERY, ::_EVERY], _BRIGHT)), 1.0)
        pixels = cv2.convertScaleAbs(photo, alpha=255 / white)
    if pixels.shape[1::-1] != size:
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    picture = cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR) if pixels.ndim == 2 else pixels.copy()
    return picture.astype(np.uint8, copy=False)


def with_bar(picture: Pixels, colours: Pixels, ticks: Iterable[tuple[float, str]]) -> Pixels:
    """Put a colour bar on the right of a picture.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W, 3)
        BGR.
    colours : ndarray of uint8, shape (N, 3)
        BGR, the topmost first.
    ticks : iterable of (float, str)
        Places along the bar, 0 at its bottom and 1 at its top, and what is written there.

    Returns
    -------
    ndarray of uint8, shape (H, W + BAR_WIDTH, 3)
        BGR. Bar and letters are twice as large for 960 rows, three times for 1440, and so on.
    """
    height = len(picture)
    unit = unit_of_rows(height)
    bar = np.full((height, BAR_WIDTH * unit, 3), 255, np.uint8)
    levels = np.linspace(len(colours) - 1, 0, height).astype(np.intp)
    bar[:, 8 * unit : 24 * unit] = colours[::-1][levels][:, None]
    for place, text in ticks:
        row = min(max(round((1 - place) * (height - 1)) + 4 * unit, 9 * unit), height - 4 * unit)
        cv2.putText(bar, text, (28 * unit, row), FONT, FONT_SIZE * unit, INK, unit, cv2.LINE_AA)
    return np.hstack([picture, bar])


def brightest(values: NDArray[Any]) -> float:
    """Return the disparity that gets the brightest colour, px: a few outliers must not darken the rest."""
    valid = np.isfinite(values) & (values > 0)
    return float(np.percentile(values[valid], 99)) if valid.any() else 1.0


def _colours() -> Pixels:
    """Return the BGR of each level, shape (256, 3); even the smallest disparity differs from no data."""
    ramp = np.linspace(40, 255, 256).astype(np.uint8)
    colours = cv2.applyColorMap(ramp, cv2.COLORMAP_INFERNO).reshape(256, 3).astype(np.uint8, copy=False)
    colours[0] = 0
    return colours


# blue, green, red from below the road to above it, evenly spaced, after ColorBrewer's RdBu: the road is white
_BELOW_TO_ABOVE = (
    (172, 195, 222, 247, 130, 77, 43),
    (102, 147, 197, 247, 165, 96, 24),
    (33, 67, 146, 247, 244, 214, 178),
)
_NO_DATA = (60, 60, 60)
_DARKEST = 0.35  # of a colour, where the photo under it is black
_BRIGHT = 98  # per cent of a photo's pixels are darker than what counts as white
_EVERY = 4  # rows and columns of a photo of 16 bits, of which one tells that
_LABELS = 8  # at most, but for the ends


def draw_heights(
    heights: Singles, span: tuple[float, float], unit: str, photo: NDArray[Any] | None = None
) -> Pixels:
    """Draw heights over the road: blue below it, white on it, red above it, with a colour bar.

    Parameters
    ----------
    heights : ndarray of float32, shape (H, W)
        NaN is no data.
    span : tuple of float
        The heights with the outermost colours, lowest first; what lies beyond has them, too. The colours of
        either side of 0 are spread over that side; a range on one side of it has those of that side alone.
    unit : str
        Of heights and span, for the colour bar.
    photo : ndarray, shape (H', W') or (H', W', 3), optional
        Grey or BGR, uint8 or uint16; its light and dark show through the colours, and it is seen in grey
        where there is no data.

    Returns
    -------
    ndarray of uint8, shape (H, W + BAR_WIDTH, 3)
        BGR; see `with_bar`.
    """
    # level 1 is the lowest height, 128 the road, 255 the highest
    places = np.linspace(1, 255, len(_BELOW_TO_ABOVE[0]))
    ramps = [np.interp(np.arange(256), places, ramp) for ramp in _BELOW_TO_ABOVE]
    colours = np.rint(np.column_stack(ramps)).astype(np.uint8)
    knots, ends = _knots(*span)
    levels = np.rint(np.interp(np.nan_to_num(heights), knots, ends)).astype(np.uint8)
    picture = cv2.applyColorMap(levels, colours.reshape(256, 1, 3))
    known = np.isfinite(heights)
    if photo is None:
        picture[~known] = _NO_DATA
    else:
        height, width = heights.shape
        grey = cv2.cvtColor(as_bgr(photo, (width, height)), cv2.COLOR_BGR2GRAY).astype(np.uint8, copy=False)
        white = max(float(np.percentile(grey, _BRIGHT)), 1.0)
        light = np.minimum(grey * np.float32((1 - _DARKEST) / white) + np.float32(_DARKEST), 1)
        picture = (picture * light[..., None]).astype(np.uint8)
        picture[~known] = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)[~known]
    shown = colours[ends[0] : ends[-1] + 1][::-1]
    return with_bar(picture.astype(np.uint8, copy=False), shown, _ticks(span, unit))


def _knots(low: float, high: float) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """Return heights between which colours are evenly spread, and their levels; the road's is 128."""
    if low < 0 < high:
        return (low, 0.0, high), (1, 128, 255)
    return (low, high), ((1, 128) if low < 0 else (128, 255))


def _ticks(span: tuple[float, float], unit: str) -> list[tuple[float, str]]:
    """Return places on the bar, 0 at its bottom and 1 at its top, and what is written there."""
    knots, _ = _knots(*span)
    step = round_step((span[1] - span[0]) / _LABELS)
    inner = [round(number * step, 9) for number in range(int(span[0] / step), int(span[1] / step) + 1)]
    values = [value for value in inner if span[0] + step / 2 < value < span[1] - step / 2]
    zero = "0 m" if unit == METRES else "0 H"
    return [
        (float(np.interp(value, knots, np.linspace(0, 1, len(knots)))), f"{value:+.4g}" if value else zero)
        for value in (span[0], *values, span[1])
    ]
