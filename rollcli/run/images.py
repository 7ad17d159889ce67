"""Draw, encode and write the images of a frame."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.estimate import RollEstimate
from rollcli.files.codecs.png import encode_png
from rollcli.files.codecs.tiff import encode_tiff
from rollcli.files.encodings import KITTI_TOP, Encoding, from_disparity
from rollcli.files.formats import Stored, encode_stored
from rollcli.pictures.derotate import derotate
from rollcli.pictures.heights import FittedRoad, heights_over, steadied, unit_of
from rollcli.pictures.heights_preview import draw_heights
from rollcli.pictures.overlay import draw_road, draw_road_on_photo
from rollcli.pictures.vdisparity import draw_v_disparity, row_offset, v_disparity
from rollcli.rig.calibration import Calibration
from rollcli.rig.pose import horizon_row
from rollcli.run.frame import Frame
from rollcli.run.options import EncodingOptions, FrameOptions
from rollcli.run.outputs import image_paths, roomy_path
from rollcli.run.read import Source

TOO_LARGE_FOR_PNG = f"written as TIFF: a disparity is above the {KITTI_TOP:.0f} px of a KITTI PNG"


@dataclass(frozen=True)  # without slots, for the cached heights
class Pictured:
    """A frame whose images are made.

    Attributes
    ----------
    source : Source
    estimate : RollEstimate
        In the pixels of the map: its roll is not the rig's where fx and fy differ.
    options : FrameOptions
    calibration : Calibration or None
        Of the map.
    """

    source: Source
    estimate: RollEstimate
    options: FrameOptions
    calibration: Calibration | None = None

    @cached_property
    def heights(self) -> NDArray[np.float32]:
        """The heights over the road, of a pair steadied; an image and its preview share them."""
        road = FittedRoad.of_estimate(self.estimate)
        heights = heights_over(self.source.shown, road, self.calibration)
        return heights if self.source.stored is not None else steadied(heights)


def encode_images(frame: Frame, pictured: Pictured) -> tuple[dict[str, bytes], str]:
    """Make the images that were requested, by their paths, and what the row should say of them."""
    images, note = {}, ""
    for kind, path in image_paths(frame, pictured.options.images):
        planned = pictured.options.at(path)
        target, data = _ENCODERS[kind.name](planned, pictured)
        images[target] = data
        if target != planned:
            note = TOO_LARGE_FOR_PNG
    return images, note


def encode_turned(
    stored: Stored, roll: float, encoding: str, given: EncodingOptions, *, expand: bool = False
) -> bytes:
    """Rotate a map by `roll` radians, and encode it in its own type, encoding and format."""
    sign = -1 if given.scale is not None and given.scale < 0 else 1
    no_data = [sign * each for each in (*given.invalid, *stored.nodata)]
    if encoding == Encoding.CITYSCAPES:
        no_data.append(1)  # (1 - 1) / 256 is a disparity of 0
    values = stored.values
    if sign < 0:  # positive numbers are data to the rotation; whole ones get room for their lowest
        values = -(values if values.dtype.kind == "f" else values.astype(np.int64))
    turned = sign * derotate(values, roll, expand=expand, invalid=no_data)
    return encode_stored(turned.astype(stored.values.dtype, copy=False), stored.format, stored.nodata)


def encode_computed(path: str, disparity: NDArray[Any], save_as: str, text: str = "") -> tuple[str, bytes]:
    """Name and encode a map computed from a pair: a PNG in KITTI's 16 bits, other formats in pixels.

    A map that reaches further than such a PNG holds becomes a TIFF of the same stem. Both carry `text`.
    """
    if save_as == "png" and np.max(disparity, initial=0) <= KITTI_TOP:
        return path, encode_stored(from_disparity(disparity, "kitti", np.uint16), "png", text=text)
    form = "tiff" if save_as == "png" else save_as
    data = encode_stored(disparity.astype(np.float32, copy=False), form, text=text)
    return (roomy_path(path) if save_as == "png" else path), data


def encode_heights(heights: NDArray[np.float32], save_as: str, unit: str) -> bytes:
    """Encode heights over the road as a float32 TIFF, which names their unit, or NPY."""
    if save_as == "npy":
        return encode_stored(heights, "npy")
    return encode_tiff(heights, description=f"height over the road, {unit}")


_Named = tuple[str, bytes]


def _derotated(path: str, of: Pictured) -> _Named:
    source, theta = of.source, of.estimate.theta
    if source.stored is None:
        return encode_computed(path, derotate(source.shown, theta), of.options.images.save_as)
    return path, encode_turned(source.stored, theta, source.encoding, of.options.encoding)


def _v_disparity(path: str, of: Pictured) -> _Named:
    estimate = of.estimate
    histogram = v_disparity(derotate(of.source.shown, estimate.theta))
    offset = row_offset(estimate.theta, estimate.width, estimate.height)
    horizon = None if of.calibration is None else horizon_row(estimate.tangent, of.calibration)
    row = None if horizon is None else horizon - offset
    return path, encode_png(draw_v_disparity(histogram, estimate.alpha, offset, row))


def _disparity(path: str, of: Pictured) -> _Named:
    return encode_computed(path, of.source.shown, of.options.images.save_as, of.source.provenance.text)


def _road_mask(path: str, of: Pictured) -> _Named:
    source, road = of.source, of.estimate.road_mask
    assert road is not None  # the frame's task asks for it
    if source.photo is not None:
        return path, encode_png(draw_road_on_photo(source.photo, road))
    return path, encode_png(draw_road(source.shown, road))


def _heights(path: str, of: Pictured) -> _Named:
    return path, encode_heights(of.heights, of.options.images.save_as, unit_of(of.calibration))


def _heights_preview(path: str, of: Pictured) -> _Named:
    span, unit = of.options.images.heights_range, unit_of(of.calibration)
    return path, encode_png(draw_heights(of.heights, span, unit, of.source.photo))


# by the names of `KINDS`
_ENCODERS = {
    "derotated": _derotated,
    "vdisparity": _v_disparity,
    "disparity": _disparity,
    "road_mask": _road_mask,
    "heights": _heights,
    "heights_preview": _heights_preview,
}
