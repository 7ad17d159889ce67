"""A chart as PNG."""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.report.drawing.colours import LIGHT, rgb
from rollcli.report.drawing.sketch import Item, Line, Marks, Points, Sketch, Words

_FINER = 2  # drawn so many times larger, then averaged: smooth edges, and lines of any width
_SHIFT = 4  # bits of a coordinate after the point
_CORNERS = 24  # of what stands for a circle
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_CAPITAL = 21.0  # height of a capital of the font at scale 1, pixels
_CAPITAL_SHARE = 0.72  # of a font's size, in the fonts of browsers

Canvas = NDArray[np.uint8]


def png_file(sketch: Sketch, scale: float = 1.5) -> bytes:
    """Return a chart on white.

    Parameters
    ----------
    sketch : Sketch
    scale : float
        Pixels of the picture for each of the sketch.

    Returns
    -------
    bytes
        A PNG, 8 bit, RGB.
    """
    finer = scale * _FINER
    size = (math.ceil(sketch.height * finer), math.ceil(sketch.width * finer), 3)
    canvas = np.full(size, rgb("card"), np.uint8)
    left, top, width, height = (round(each * finer) for each in sketch.frame)
    inside = canvas[top : top + height, left : left + width].copy()  # cuts off what lies outside of it
    for item in sketch.inside:
        _draw(inside, item, sketch.font, finer)
    canvas[top : top + height, left : left + width] = inside
    for item in sketch.around:
        _draw(canvas, item, sketch.font, finer)
    target = (round(sketch.width * scale), round(sketch.height * scale))
    picture = cv2.resize(canvas, target, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return data.tobytes()


def _draw(canvas: Canvas, item: Item, font: float, scale: float) -> None:
    if isinstance(item, Words):
        _draw_words(canvas, item, font, scale)
        return
    points, pen = item.points * scale, 0
    if isinstance(item, Line):
        pen = max(1, round(item.width * scale))
        parts = _dashes(points, item.dash * scale) if item.dash else [points]
    elif isinstance(item, Marks):
        pen = round(item.size * scale / 4) if item.symbol == "cross" else 0
        parts = [stroke + point for point in points for stroke in _shape(item, scale)]
    else:
        parts = [points]
    opacity, colour = LIGHT[item.colour][1], rgb(item.colour)
    if not parts:
        return
    if opacity == 1:
        _paint(canvas, parts, colour, pen)
        return
    part, corner = _around(canvas, points, pen)
    painted = part.copy()
    _paint(painted, [each - corner for each in parts], colour, pen)
    part[:] = cv2.addWeighted(painted, opacity, part, 1 - opacity, 0)


def _paint(canvas: Canvas, parts: Sequence[Points], colour: tuple[int, int, int], pen: int) -> None:
    """Draw lines of this width, or fill shapes where it is 0."""
    fixed = [np.rint(part * 2**_SHIFT).astype(np.int32) for part in parts]
    if pen:
        cv2.polylines(canvas, fixed, False, colour, pen, cv2.LINE_AA, _SHIFT)
    else:
        for each in fixed:  # one by one: where two overlap, fillPoly would leave a hole
            cv2.fillPoly(canvas, [each], colour, cv2.LINE_AA, _SHIFT)


def _around(canvas: Canvas, points: Points, pen: int) -> tuple[Canvas, Points]:
    """Return the part of a canvas that holds these points, and its corner."""
    size = np.array(canvas.shape[1::-1])
    low = np.clip(np.floor(points.min(axis=0)) - pen - 2, 0, size - 1).astype(int)
    high = np.clip(np.ceil(points.max(axis=0)) + pen + 2, low + 1, size).astype(int)
    return canvas[low[1] : high[1], low[0] : high[0]], low.astype(float)


def _shape(marks: Marks, scale: float) -> list[Points]:
    """Return the strokes or the outline of a mark around the origin."""
    half = marks.size * scale / 2
    if marks.symbol == "cross":
        return [half * np.array([(-1.0, -1.0), (1.0, 1.0)]), half * np.array([(-1.0, 1.0), (1.0, -1.0)])]
    if marks.symbol == "diamond":
        return [half * np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])]
    turns = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
    return [half * np.column_stack([np.cos(turns), np.sin(turns)])]


def _dashes(points: Points, dash: float) -> list[Points]:
    """Cut a line into dashes with gaps of the same length between them."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    parts = []
    for start in np.arange(0, along[-1], 2 * dash):
        ends = np.array([start, min(start + dash, along[-1])])
        places = np.unique(np.concatenate([ends, along[(along > ends[0]) & (along < ends[1])]]))
        parts.append(np.column_stack([np.interp(places, along, points[:, axis]) for axis in (0, 1)]))
    return parts


def _draw_words(canvas: Canvas, words: Words, font: float, scale: float) -> None:
    """Write a line; what the font does not have is written with what it has."""
    text = words.text.replace("−", "-")
    pixels = font * scale
    size, pen = pixels * _CAPITAL_SHARE / _CAPITAL, max(1, round(pixels / 13))
    (width, height), below = cv2.getTextSize(text, _FONT, size, pen)
    patch = np.full((height + below + 2 * pen, width + 2 * pen, 3), rgb("card"), np.uint8)
    cv2.putText(patch, text, (pen, height + pen), _FONT, size, rgb(words.colour), pen, cv2.LINE_AA)
    before = {"start": 0.0, "middle": width / 2, "end": float(width)}[words.anchor]
    x, y = words.x * scale, words.y * scale
    if words.upright:
        patch = np.rot90(patch)
        left, top = x - height - pen, y - width + before - pen
    else:
        left, top = x - before - pen, y - height - pen
    _put(canvas, patch, round(left), round(top))


def _put(canvas: Canvas, patch: Canvas, left: int, top: int) -> None:
    """Lay dark words on the canvas where both overlap."""
    x0, y0 = max(left, 0), max(top, 0)
    part = canvas[y0 : max(top + patch.shape[0], 0), x0 : max(left + patch.shape[1], 0)]
    cut = patch[y0 - top : y0 - top + part.shape[0], x0 - left : x0 - left + part.shape[1]]
    np.minimum(part, cut, out=part)
