"""Draw, encode and write the images of a frame."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.result import RollEstimate
from rollcli.files.codecs.png import encode_png
from rollcli.files.encodings import Encoding, from_disparity
from rollcli.files.formats import Stored, encode_stored
from rollcli.files.storage import write_bytes
from rollcli.frames.frame import Frame
from rollcli.frames.options import FrameOptions
from rollcli.frames.outputs import image_paths
from rollcli.frames.read import Source
from rollcli.imaging.derotate import derotate
from rollcli.imaging.overlay import draw_road
from rollcli.imaging.vdisparity import row_offset, v_disparity
from rollcli.imaging.vdisparity_picture import draw_v_disparity


def write_images(
    frame: Frame,
    source: Source,
    estimate: RollEstimate,
    options: FrameOptions,
    horizon: float | None = None,
) -> None:
    """Write the images that were requested, each whole or not at all.

    `horizon` is the y of the road's horizon, px, where a calibration tells it.

    Raises
    ------
    OutputError
        An image cannot be written.
    """
    for kind, path in image_paths(frame, options.images):
        write_bytes(options.at(path), _ENCODERS[kind](source, estimate, options, horizon))


def encode_turned(
    stored: Stored, roll: float, encoding: str, invalid: Iterable[float], *, expand: bool = False
) -> bytes:
    """Rotate a map by `roll` radians, and encode it in its own type, encoding and format."""
    no_data = [*invalid, *stored.nodata]
    if encoding == Encoding.CITYSCAPES:
        no_data.append(1)  # (1 - 1) / 256 is a disparity of 0
    turned = derotate(stored.values, roll, expand=expand, invalid=no_data)
    return encode_stored(turned, stored.format, stored.nodata)


def encode_computed(disparity: NDArray[Any], save_as: str) -> bytes:
    """Encode a map computed from a pair: a PNG in KITTI's 16 bits, other formats in pixels."""
    if save_as == "png":
        return encode_stored(from_disparity(disparity, "kitti", np.uint16), "png")
    return encode_stored(disparity.astype(np.float32, copy=False), save_as)


def _derotated(source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None) -> bytes:
    if source.stored is None:
        return encode_computed(derotate(source.disparity, estimate.theta), options.images.save_as)
    return encode_turned(source.stored, estimate.theta, source.encoding, options.encoding.invalid)


def _v_disparity(
    source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None
) -> bytes:
    histogram = v_disparity(derotate(source.disparity, estimate.theta))
    offset = row_offset(estimate.theta, estimate.width, estimate.height)
    row = None if horizon is None else horizon - offset
    return encode_png(draw_v_disparity(histogram, estimate.alpha, offset, row))


def _disparity(source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None) -> bytes:
    return encode_computed(source.disparity, options.images.save_as)


def _road_mask(source: Source, estimate: RollEstimate, options: FrameOptions, horizon: float | None) -> bytes:
    assert estimate.road_mask is not None  # the frame's task asks for it
    return encode_png(draw_road(source.disparity, estimate.road_mask))


_ENCODERS = {
    "derotated": _derotated,
    "vdisparity": _v_disparity,
    "disparity": _disparity,
    "road_mask": _road_mask,
}
