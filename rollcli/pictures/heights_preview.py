"""Pictures of heights over the road, in colours that are the same in every frame."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.pictures.heights import METRES
from rollcli.pictures.overlay import BAR_WIDTH as BAR_WIDTH
from rollcli.pictures.overlay import as_bgr, with_bar
from rollcli.pictures.round_step import round_step

# BGR from below the road to above it, evenly spaced, after ColorBrewer's RdBu: its middle, the road, is white
_BELOW_TO_ABOVE = (
    (172, 102, 33),
    (195, 147, 67),
    (222, 197, 146),
    (247, 247, 247),
    (130, 165, 244),
    (77, 96, 214),
    (43, 24, 178),
)
_NO_DATA = (60, 60, 60)
_DARKEST = 0.35  # of a colour, where the photo under it is black
_BRIGHT = 98  # per cent of a photo's pixels are darker than what counts as white
_LABELS = 8  # at most, but for the ends


def draw_heights(
    heights: NDArray[np.float32], span: tuple[float, float], unit: str, photo: NDArray[Any] | None = None
) -> NDArray[np.uint8]:
    """Draw heights over the road: blue below it, white on it, red above it, with a colour bar.

    Parameters
    ----------
    heights : ndarray of float32, shape (H, W)
        NaN is no data.
    span : tuple of float
        The heights with the outermost colours, lowest first; what lies beyond has them, too. The colours of
        either side of 0 are spread over that side.
    unit : str
        Of heights and span, for the colour bar.
    photo : ndarray, shape (H', W') or (H', W', 3), optional
        Grey or BGR, uint8 or uint16; its light and dark show through the colours, and it is seen in grey
        where there is no data.

    Returns
    -------
    ndarray of uint8, shape (H, W + BAR_WIDTH, 3)
        BGR.
    """
    colours = _colours()
    picture = cv2.applyColorMap(_levels(heights, span), colours.reshape(256, 1, 3))
    known = np.isfinite(heights)
    if photo is None:
        picture[~known] = _NO_DATA
    else:
        height, width = heights.shape
        grey = cv2.cvtColor(as_bgr(photo, (width, height)), cv2.COLOR_BGR2GRAY)
        white = max(float(np.percentile(grey, _BRIGHT)), 1.0)
        light = np.minimum(grey * np.float32((1 - _DARKEST) / white) + np.float32(_DARKEST), 1)
        picture = (picture * light[..., None]).astype(np.uint8)
        picture[~known] = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)[~known]
    return with_bar(picture.astype(np.uint8, copy=False), colours[:0:-1], _ticks(span, unit))


def _levels(heights: NDArray[np.float32], span: tuple[float, float]) -> NDArray[np.uint8]:
    """Return 1 for the lowest height, 128 for the road, 255 for the highest."""
    levels: NDArray[np.uint8] = np.rint(
        np.interp(np.nan_to_num(heights), _knots(*span), (1.0, 128.0, 255.0))
    ).astype(np.uint8)
    return levels


def _knots(low: float, high: float) -> tuple[float, float, float]:
    """Return the heights of the first, the middle and the last colour; the road has the middle one."""
    return low, 0.0 if low < 0 < high else (low + high) / 2, high


def _ticks(span: tuple[float, float], unit: str) -> list[tuple[float, str]]:
    """Return places on the bar, 0 at its bottom and 1 at its top, and what is written there."""
    knots = _knots(*span)
    step = round_step((span[1] - span[0]) / _LABELS)
    inner = [round(number * step, 9) for number in range(int(span[0] / step), int(span[1] / step) + 1)]
    values = [value for value in inner if span[0] + step / 2 < value < span[1] - step / 2]
    zero = "0 m" if unit == METRES else "0 H"
    return [
        (float(np.interp(value, knots, (0.0, 0.5, 1.0))), f"{value:+.4g}" if value else zero)
        for value in (span[0], *values, span[1])
    ]


def _colours() -> NDArray[np.uint8]:
    """Return the BGR of each level, shape (256, 3); level 0 is not used."""
    places = np.linspace(1, 255, len(_BELOW_TO_ABOVE))
    ramps = [np.interp(np.arange(256), places, ramp) for ramp in zip(*_BELOW_TO_ABOVE, strict=True)]
    colours: NDArray[np.uint8] = np.rint(np.column_stack(ramps)).astype(np.uint8)
    return colours
