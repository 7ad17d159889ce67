"""The pictures of a frame: the road on its photo, its map and v-disparity before and after, and heights."""

import base64
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.road.model import Parabola
from rollcli.files.formats import read_image, read_stored
from rollcli.pictures.derotate import derotate
from rollcli.pictures.heights import CAMERA_HEIGHTS, METRES, FittedRoad, heights_over, steadied, unit_of
from rollcli.pictures.overlay import draw_disparity, draw_heights, draw_road
from rollcli.pictures.vdisparity import MiddleColumn, draw_v_disparity, shown_end, v_disparity
from rollcli.report.sources import Subject
from rollcli.run.options import EncodingOptions, FramesOptions
from rollcli.run.read import FRAME_ERRORS, Source, read_source

# small enough that a page with a dozen frames opens at once, large enough to see a stripe of noise
_WIDEST, _QUALITY = 1280, 82
_SAME = math.radians(1e-4)  # a result holds angles to a millionth of a degree

# which picture an image is that `estimate` drew
_WRITTEN = {"road": "road_mask", "level_counts": "vdisparity", "heights": "heights_preview"}

Made = TypeVar("Made")


@dataclass(frozen=True)
class Picture:
    """A WebP file and its size, pixels."""

    data: bytes
    width: int
    height: int

    @property
    def uri(self) -> str:
        """Return the picture as an address that holds it."""
        return "data:image/webp;base64," + base64.b64encode(self.data).decode()


@dataclass(frozen=True)
class Pictures:
    """The pictures of a frame.

    Attributes
    ----------
    made : dict of str to Picture
        Those that there are of "road", "map", "map_counts", "level", "level_counts" and "heights".
    missing : str
        Why there is no map to show.
    """

    made: dict[str, Picture]
    missing: str = ""


@np.errstate(all="ignore")  # what other programs' rows have overflows
def take_pictures(subject: Subject) -> Pictures:
    """Take what can be taken: from the images of the subject, else from its map or pair."""
    source, missing = _attempt(lambda: _source(subject).require_size(subject.frame.file, subject.row))
    level, _ = _attempt(lambda: _level(subject, source))
    makers: dict[str, Callable[[], NDArray[Any] | None]] = {"heights": partial(_heights, subject, source)}
    if source is not None:
        makers["road"] = partial(_road, subject, source)
        makers["map"] = partial(draw_disparity, source.shown)
        makers["map_counts"] = partial(_counts, source.shown, source.shown)
    if level is not None:
        makers["level"] = partial(draw_disparity, level)
        makers["level_counts"] = partial(_level_counts, subject, source, level)
    for name, kind in _WRITTEN.items():
        if kind in subject.images:
            makers[name] = partial(read_image, subject.images[kind])
    drawn = {name: _attempt(make)[0] for name, make in makers.items()}
    return Pictures({name: _encoded(each) for name, each in drawn.items() if each is not None}, missing)


def _attempt(make: Callable[[], Made]) -> tuple[Made | None, str]:
    try:
        return make(), ""
    except FRAME_ERRORS as error:
        return None, str(error) or type(error).__name__


def _source(subject: Subject) -> Source:
    options = subject.options
    if "disparity" in subject.images:
        source = _read(subject, FramesOptions(), "disparity")
        if source.size is not None:
            return source
        height, width = source.disparity.shape
        downscale = options.stereo.downscale if subject.frame.right_file else 1.0
        return replace(source, size=(round(width * downscale), round(height * downscale)))
    if subject.refused:
        raise InputError(subject.refused)
    # a pair's left image is kept where the road is to be drawn on it
    return _read(subject, replace(options, images=options.images._replace(road_mask="")))


def _read(subject: Subject, options: FramesOptions, kind: str = "") -> Source:
    """Read a map or match a pair; `kind`: read this image of it, a map."""
    frame = subject.frame
    if kind:
        frame = frame._replace(path=subject.images[kind], right_path="", right_file="", mask=None)
    if options.encoding.encoding == "depth" and not frame.right_file and frame.calibration is None:
        raise InputError(f"{frame.file}: its depths need its calibration, which the result's record lacks")
    return read_source(frame, options)


def _road(subject: Subject, source: Source) -> NDArray[Any] | None:
    """Draw the road on the left image of a pair, found again."""
    if source.photo is None:
        return None
    request = subject.options.method.request(calibration=source.calibrated(subject.frame.calibration))
    found = estimate_roll(source.disparity, request, mask=source.allowed, road_mask=True)
    # where options that the record does not give back led to another angle, this is not its road
    if found.road_mask is None or abs(found.theta - subject.theta) > _SAME:
        return None
    return draw_road(source.shown, found.road_mask, source.photo)


def _level(subject: Subject, source: Source | None) -> NDArray[Any] | None:
    """Return the map de-rotated: as `estimate` wrote it, else made."""
    if "derotated" in subject.images:
        given = EncodingOptions() if subject.frame.right_file else subject.options.encoding
        return _read(subject, FramesOptions(encoding=given), "derotated").disparity
    return None if source is None else derotate(source.shown, subject.theta)


def _level_counts(subject: Subject, source: Source | None, level: NDArray[Any]) -> NDArray[Any]:
    height, width = level.shape
    column, alpha = MiddleColumn.of_level(subject.theta, width, height), subject.row.alpha
    scale = level if source is None else source.shown
    return _counts(level, scale, None if alpha is None else column.profile(alpha))


def _heights(subject: Subject, source: Source | None) -> NDArray[Any] | None:
    """Draw the heights over the road: as `estimate` wrote them, else those of the map.

    Of a map they are in metres where there is a calibration or the row has the camera's height.
    """
    span, camera = subject.options.images.heights_range, subject.row.height_m
    photo = None if source is None else source.photo
    unit = CAMERA_HEIGHTS if camera is None else METRES
    if "heights" in subject.images:
        written = read_stored(subject.images["heights"]).values.astype(np.float32)
        return draw_heights(written, span, unit, photo)
    calibration = None if source is None else source.calibrated(subject.frame.calibration)
    road = FittedRoad.of_row(subject.row, calibration)
    if source is None or road is None:
        return None
    heights = heights_over(source.shown, road, calibration)
    if unit_of(calibration) == METRES:
        unit = METRES
    else:
        heights *= np.float32(camera or 1.0)
    return draw_heights(steadied(heights) if subject.frame.right_file else heights, span, unit, photo)


def _counts(disparity: NDArray[Any], scale: NDArray[Any], curve: Parabola | None = None) -> NDArray[Any]:
    """Draw the v-disparity from 0 to the largest disparity of `scale`, so that two can be compared."""
    histogram = v_disparity(scale)
    counted = v_disparity(disparity, bins=histogram.counts.shape[1], max_disparity=histogram.max_disparity)
    return draw_v_disparity(counted, curve, end=shown_end(histogram))


def _encoded(picture: NDArray[Any]) -> Picture:
    height, width = picture.shape[:2]
    if width > _WIDEST:
        size = (_WIDEST, max(1, round(height * _WIDEST / width)))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".webp", np.ascontiguousarray(picture), [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    return Picture(data.tobytes(), picture.shape[1], picture.shape[0])
