"""The images of a frame, drawn and written."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rollcli.batch.options import FrameOptions, ImageOptions
from rollcli.batch.outputs import image_paths
from rollcli.files.atomic import write_atomic
from rollcli.files.encodings import from_disparity
from rollcli.files.formats import encode_stored
from rollcli.files.png import encode_png
from rollcli.imaging.derotate import derotate
from rollcli.imaging.overlay import draw_road
from rollcli.imaging.vdisparity import draw_v_disparity, row_offset, v_disparity

if TYPE_CHECKING:
    from rollcli.batch.job import Frame
    from rollcli.batch.source import Source
    from rollcli.estimator.estimate import RollEstimate


def write_images(frame: "Frame", source: "Source", estimate: "RollEstimate", options: FrameOptions) -> None:
    """Write the images that were asked for, each whole or not at all.

    Raises
    ------
    OutputError
        An image cannot be written.
    """
    for kind, path in image_paths(frame, options.images):
        write_atomic(options.at(path), _ENCODERS[kind](source, estimate, options))


def _derotated(source: "Source", estimate: "RollEstimate", options: FrameOptions) -> bytes:
    if source.stored is None:
        return _encoded(derotate(source.disparity, estimate.theta), options.images)
    stored = source.stored
    invalid = (*options.encoding.invalid, *stored.nodata)
    return encode_stored(
        derotate(stored.values, estimate.theta, invalid=invalid), stored.format, stored.nodata
    )


def _v_disparity(source: "Source", estimate: "RollEstimate", options: FrameOptions) -> bytes:
    histogram = v_disparity(derotate(source.disparity, estimate.theta))
    offset = row_offset(estimate.theta, estimate.width, estimate.height)
    return encode_png(draw_v_disparity(histogram, estimate.alpha, offset))


def _disparity(source: "Source", estimate: "RollEstimate", options: FrameOptions) -> bytes:
    return _encoded(source.disparity, options.images)


def _road_mask(source: "Source", estimate: "RollEstimate", options: FrameOptions) -> bytes:
    return encode_png(draw_road(source.disparity, estimate.road_mask(source.disparity)))


_ENCODERS = {
    "derotated": _derotated,
    "vdisparity": _v_disparity,
    "disparity": _disparity,
    "road_mask": _road_mask,
}


def _encoded(disparity: NDArray[Any], images: ImageOptions) -> bytes:
    """A computed map: KITTI's 16 bits in a PNG, pixels as they are elsewhere."""
    if images.save_as == "png":
        return encode_stored(from_disparity(disparity, "kitti", np.uint16), "png")
    return encode_stored(disparity.astype(np.float32, copy=False), images.save_as)
