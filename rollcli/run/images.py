"""Draw, encode and write the images of a frame."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.estimate import RollEstimate
from rollcli.files.codecs.png import encode_png
from rollcli.files.encodings import KITTI_TOP, Encoding, from_disparity
from rollcli.files.formats import Stored, encode_stored
from rollcli.pictures.derotate import derotate
from rollcli.pictures.overlay import draw_road, draw_road_on_photo
from rollcli.pictures.vdisparity import draw_v_disparity, row_offset, v_disparity
from rollcli.run.frame import Frame
from rollcli.run.options import FrameOptions
from rollcli.run.outputs import image_paths, roomy_path
from rollcli.run.read import Source

TOO_LARGE_FOR_PNG = f"written as TIFF: a disparity is above the {KITTI_TOP:.0f} px of a KITTI PNG"


def encode_images(
    frame: Frame,
    source: Source,
    estimate: RollEstimate,
    options: FrameOptions,
    horizon: float | None = None,
) -> tuple[dict[str, bytes], str]:
    """Make the images that were requested, by their paths, and what the row should say of them.

    `horizon` is the y of the road's horizon, px, where a calibration tells it.
    """
    images, note = {}, ""
    for kind, path in image_paths(frame, options.images):
        planned = options.at(path)
        target, data = _ENCODERS[kind](planned, source, estimate, options, horizon)
        images[target] = data
        if target != planned:
            note = TOO_LARGE_FOR_PNG
    return images, note


def encode_turned(
    stored: Stored, roll: float, encoding: str, invalid: Iterable[float], *, expand: bool = False
) -> bytes:
    """Rotate a map by `roll` radians, and encode it in its own type, encoding and format."""
    no_data = [*invalid, *stored.nodata]
    if encoding == Encoding.CITYSCAPES:
        no_data.append(1)  # (1 - 1) / 256 is a disparity of 0
    turned = derotate(stored.values, roll, expand=expand, invalid=no_data)
    return encode_stored(turned, stored.format, stored.nodata)


def encode_computed(path: str, disparity: NDArray[Any], save_as: str) -> tuple[str, bytes]:
    """Name and encode a map computed from a pair: a PNG in KITTI's 16 bits, other formats in pixels.

    A map that reaches further than such a PNG holds becomes a TIFF of the same stem.
    """
    if save_as == "png" and np.max(disparity, initial=0) <= KITTI_TOP:
        return path, encode_stored(from_disparity(disparity, "kitti", np.uint16), "png")
    form = "tiff" if save_as == "png" else save_as
    data = encode_stored(disparity.astype(np.float32, copy=False), form)
    return (roomy_path(path) if save_as == "png" else path), data


_Named = tuple[str, bytes]


def _derotated(
    path: str, source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None
) -> _Named:
    if source.stored is None:
        return encode_computed(path, derotate(source.shown, estimate.theta), options.images.save_as)
    return path, encode_turned(source.stored, estimate.theta, source.encoding, options.encoding.invalid)


def _v_disparity(
    path: str, source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None
) -> _Named:
    histogram = v_disparity(derotate(source.shown, estimate.theta))
    offset = row_offset(estimate.theta, estimate.width, estimate.height)
    row = None if horizon is None else horizon - offset
    return path, encode_png(draw_v_disparity(histogram, estimate.alpha, offset, row))


def _disparity(
    path: str, source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None
) -> _Named:
    return encode_computed(path, source.shown, options.images.save_as)


def _road_mask(
    path: str, source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None
) -> _Named:
    assert estimate.road_mask is not None  # the frame's task asks for it
    if source.photo is not None:
        return path, encode_png(draw_road_on_photo(source.photo, estimate.road_mask))
    return path, encode_png(draw_road(source.shown, estimate.road_mask))


_ENCODERS = {
    "derotated": _derotated,
    "vdisparity": _v_disparity,
    "disparity": _disparity,
    "road_mask": _road_mask,
}
