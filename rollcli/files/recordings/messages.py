"""Messages of ROS to pixels, or to the file that a CompressedImage holds."""

import math
import struct
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError
from rollcli.extras import require_extra
from rollcli.files.bounded import MOST_BYTES
from rollcli.files.codecs import pictures, png
from rollcli.files.codecs.arrays import native, require_decoded_fits
from rollcli.files.recordings.bags import Topic

DISPARITY = "stereo_msgs/DisparityImage"
IMAGE = "sensor_msgs/Image"
COMPRESSED = "sensor_msgs/CompressedImage"
CAMERA_INFO = "sensor_msgs/CameraInfo"
_ZSTD = b"\x28\xb5\x2f\xfd"
_VIDEO_STARTS = (b"\0\0\1", b"\0\0\0\1")  # start codes of H.264 and H.265 [ITU-T H.264, annex B]
_AS_VIDEO = "export the topic as .mp4, and read the video"
_ONLY_MAPS = ("16UC1", "16SC1", "32FC1")
MAP_ENCODINGS = ("mono16", *_ONLY_MAPS)  # of images that hold disparities or depths
# ROS names the first two pixels of a row of the mosaic, OpenCV those of its second row from the second on
_BAYER = {
    "rggb": cv2.COLOR_BayerBG2BGR,
    "bggr": cv2.COLOR_BayerRG2BGR,
    "gbrg": cv2.COLOR_BayerGR2BGR,
    "grbg": cv2.COLOR_BayerGB2BGR,
}
_YUV = {  # two pixels in four bytes
    **dict.fromkeys(("yuv422", "uyvy"), cv2.COLOR_YUV2BGR_UYVY),
    **dict.fromkeys(("yuv422_yuy2", "yuyv"), cv2.COLOR_YUV2BGR_YUY2),
}
# numpy's dtype, and the channels
_PIXELS = {
    **dict.fromkeys(("mono8", "8UC1"), ("u1", 1)),
    **dict.fromkeys(("mono16", "16UC1"), ("u2", 1)),
    "16SC1": ("i2", 1),
    "32FC1": ("f4", 1),
    "64FC1": ("f8", 1),
    **dict.fromkeys(("rgb8", "bgr8", "8UC3"), ("u1", 3)),
    **dict.fromkeys(("rgba8", "bgra8", "8UC4"), ("u1", 4)),
    **dict.fromkeys(("rgb16", "bgr16"), ("u2", 3)),
    **{f"bayer_{order}{8 * size}": (f"u{size}", 1) for order in _BAYER for size in (1, 2)},
    **dict.fromkeys(_YUV, ("u1", 2)),
}
_FISHEYE = ("equidistant", "fisheye")
_ALIKE_PX = 1e-3  # K and P: far below what any calibration is worth
_MODELS = ("plumb_bob", "rational_polynomial", *_FISHEYE)  # that OpenCV undoes


class CameraInfo(NamedTuple):
    """The intrinsics of one camera: of the raw view (D, K, R) and of the rectified one (P); ROS's names."""

    width: int
    height: int
    model: str
    d: tuple[float, ...]
    k: tuple[float, ...]
    r: tuple[float, ...]
    p: tuple[float, ...]

    @property
    def has_p(self) -> bool:
        """Whether P is there: drivers that were not calibrated write zeros."""
        return all(map(math.isfinite, self.p)) and self.p[0] > 0 and self.p[5] > 0

    @property
    def usable(self) -> bool:
        """Whether P is a calibration: a region of the image need not hold the principal point."""
        width, height = self.width or math.inf, self.height or math.inf
        return self.has_p and 0 < self.p[2] < width and 0 < self.p[6] < height

    @property
    def across(self) -> float:
        """How far the origin of P, which may be a third camera, stands to the right of this one, m."""
        return (self.p[3] - self.p[2] * self.p[11]) / self.p[0]

    def pairs_with(self, other: "CameraInfo") -> bool:
        """Tell whether both have the P of one rectified pair: what differs is along the rows alone."""
        # focal lengths, and cy
        return bool(np.ptp(np.take([self.p, other.p], (0, 5, 6), axis=1), axis=0).max() < _ALIKE_PX)

    @property
    def changes_raw_views(self) -> bool:
        """Whether a raw view is not the rectified one."""
        upright = not any(self.r) or np.allclose(self.r, np.eye(3).ravel(), rtol=0, atol=1e-9)
        alike = np.allclose(self.k, np.delete(self.p, (3, 7, 11)), rtol=0, atol=_ALIKE_PX)
        return self.has_p and self.k[0] > 0 and (any(self.d) or not upright or not alike)


def stamp_of(topic: Topic, data: memoryview, log_time: int) -> int:
    """Return the header's time, ns, without decoding the message; the time of recording where it has none."""
    try:
        form = "<II" if topic.encoding == "ros1" else "<iI" if data[1] & 1 else ">iI"
        seconds, nanoseconds = struct.unpack_from(form, data, 4)
    except (struct.error, IndexError):
        return log_time
    return int(seconds) * 10**9 + int(nanoseconds) or log_time


def check_decoder(topic: Topic) -> None:
    """Refuse a topic that no decoder is for.

    Raises
    ------
    InputError
    """
    if topic.type not in (DISPARITY, IMAGE, COMPRESSED):
        hint = f": {_AS_VIDEO}" if "Video" in topic.type else ""
        kind = topic.type or "unknown"
        raise InputError(f"{topic.name} has messages of the type {kind}, not images of ROS{hint}")
    if topic.encoding not in ("cdr", "ros1"):
        form = topic.encoding or "nothing"
        raise InputError(f"{topic.name} is serialized as {form}; cdr and ros1 are read")


def camera_info(topic: Topic, data: memoryview) -> CameraInfo:
    """Decode a CameraInfo; of a camera that sends a region of its image, that of the region."""
    found = _decoded(topic, data)
    keys = "DKRP" if topic.encoding == "ros1" else "dkrp"  # ROS 1 calls them by capitals
    d, k, r, p = (np.array(getattr(found, key), np.float64) for key in keys)
    of = found.roi if found.roi.width and found.roi.height else found
    for rows in (k.reshape(3, 3), p.reshape(3, 4)) if of is found.roi else ():  # are of the whole image
        rows[:2] -= np.outer((of.x_offset, of.y_offset), rows[2])
    fields = (tuple(each.tolist()) for each in (d, k, r, p))
    return CameraInfo(int(of.width), int(of.height), str(found.distortion_model), *fields)


def image_encoding(topic: Topic, data: memoryview) -> str:
    """Return what the pixels of an Image are, or of a CompressedImage that says it; empty for other types."""
    if topic.type == COMPRESSED:
        return str(_decoded(topic, data).format).partition(";")[0]
    return str(_decoded(topic, data).encoding) if topic.type == IMAGE else ""


def baseline_of(topic: Topic, data: memoryview) -> float:
    """Return T of a DisparityImage, m, of the sign that it has there; 0 where it is not stated."""
    found = _decoded(topic, data)
    length = float(found.T if topic.encoding == "ros1" else found.t)
    return length if math.isfinite(length) else 0.0


def content_of(topic: Topic, data: memoryview, raw_of: CameraInfo | None = None) -> bytes | NDArray[Any]:
    """Return the pixels of a message, (H, W) or BGR (H, W, 3), or the file that a CompressedImage holds.

    Parameters
    ----------
    topic : Topic
    data : memoryview
        The message as it is serialized.
    raw_of : CameraInfo or None
        The message is a raw view of this camera: it is rectified.

    Raises
    ------
    InputError
        It is damaged, or of a type or pixels that no decoder is for.
    """
    check_decoder(topic)
    found = _decoded(topic, data)
    if topic.type == COMPRESSED:
        packed = bytes(found.data)
        if packed.startswith(_VIDEO_STARTS):
            raise InputError(
                f"is a frame of a video (H.264 or H.265), which needs those before it: {_AS_VIDEO}"
            )
        if "compressedDepth" in str(found.format):
            head, packed = packed[:12], packed[max(packed.find(png.SIGNATURE), 0) :]
            if _is_quantized(found):
                return _unquantized(head, packed)
        mosaic = _mosaic_of(str(found.format))
        if raw_of is None and mosaic is None:
            return packed
        decode = png.picture if packed.startswith(png.SIGNATURE) else pictures.decode_picture
        values = decode(packed)
        if mosaic is not None and values.ndim == 2:
            values = cv2.cvtColor(values, mosaic)
        return values if raw_of is None else _rectified(values, raw_of)
    if topic.type == DISPARITY:
        values = _pixels(found.image)
        below = values < float(found.min_disparity)
        known = np.isfinite(values)  # ZED's are all negative, and NaN where there are none
        if values.ndim == 2 and values.dtype.kind == "f" and below.any() and (known & ~below).any():
            values = np.where(below, np.nan, values).astype(values.dtype)
        return values
    values = _pixels(found)
    return values if raw_of is None else _rectified(values, raw_of)


def _mosaic_of(form: str) -> int | None:
    """Return OpenCV's code of a CompressedImage that is packed as the mosaic [compressed_image_transport].

    Older versions made it grey before: "bayer_rggb8; jpeg compressed mono8".
    """
    return _BAYER.get(form[6:10]) if form.startswith("bayer_") and "mono" not in form else None


def ending_of(topic: Topic, data: memoryview) -> str:
    """Return the ending of a file of what a message holds: pixels, or a file of its own."""
    return ".npy" if topic.type != COMPRESSED or _is_quantized(_decoded(topic, data)) else ".png"


def _is_quantized(image: Any) -> bool:
    return str(image.format).startswith("32FC1") and "compressedDepth" in str(image.format)


def _unquantized(head: bytes, packed: bytes) -> NDArray[Any]:
    """Return depths z, m, of a PNG of a / z + b [compressed_depth_image_transport]; no data is NaN."""
    try:
        a, b = struct.unpack("<4xff", head)
    except struct.error:
        raise InputError("is a damaged compressedDepth message") from None
    stored = png.picture(packed)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depths = np.float32(a) / (stored.astype(np.float32) - np.float32(b))
    return np.where(stored > 0, depths, np.float32(np.nan))


def is_map(topic: Topic, data: memoryview) -> bool:
    """Tell whether the pixels of a message can only be disparities or depths."""
    return topic.type == DISPARITY or image_encoding(topic, data) in _ONLY_MAPS


def _decoded(topic: Topic, data: memoryview) -> Any:
    decode = _decoder(topic.encoding == "ros1")
    try:
        return decode(data, topic.type.replace("/", "/msg/"))
    except Exception as error:  # noqa: BLE001 (a damaged message fails anywhere in the decoder)
        if bytes(data[:4]) == _ZSTD:
            raise InputError(
                "is compressed by itself (--compression-mode message): rewrite the bag without, "
                "by ros2 bag convert"
            ) from None
        raise InputError(f"is a damaged message of {topic.type}: {type(error).__name__}") from None


@lru_cache(maxsize=2)
def _decoder(ros1: bool) -> Any:
    require_extra("bags", "reading a bag")
    from rosbags.typesys import Stores, get_typestore

    if ros1:
        return get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
    return get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr


def _pixels(image: Any) -> NDArray[Any]:
    """Return the pixels of an Image: (H, W), or BGR (H, W, 3); rows may be longer than their pixels."""
    encoding, width, height, step = str(image.encoding), int(image.width), int(image.height), int(image.step)
    if encoding not in _PIXELS:
        raise InputError(f"has pixels of the encoding {encoding[:40]!r}, which is not read")
    kind, channels = _PIXELS[encoding]
    dtype = np.dtype(kind).newbyteorder(">" if image.is_bigendian else "<")
    row = width * channels * dtype.itemsize
    if step < row:
        raise InputError(f"its rows have {step} bytes, of {row} that {width} pixels of {encoding} need")
    data = np.asarray(image.data, np.uint8)
    needed = step * (height - 1) + row
    if needed > min(data.size, MOST_BYTES):
        raise InputError(f"is truncated: {needed} bytes are needed, {data.size} are there")
    require_decoded_fits(width, height, channels * dtype.itemsize, data.size)
    values: NDArray[Any] = np.ndarray((height, width * channels), dtype, data, strides=(step, dtype.itemsize))
    values = native(values)
    if encoding in _YUV:
        if width % 2:
            raise InputError(f"is {width} px wide; pixels of {encoding} come in twos")
        return cv2.cvtColor(values.reshape(height, width, 2), _YUV[encoding])
    if channels > 1:
        values = values.reshape(height, width, channels)[..., :3]
        return np.ascontiguousarray(values[..., ::-1] if encoding.startswith("rgb") else values)
    return cv2.cvtColor(values, _BAYER[encoding[6:10]]) if encoding.startswith("bayer_") else values


def _rectified(values: NDArray[Any], info: CameraInfo) -> NDArray[Any]:
    if values.shape[:2] != (info.height, info.width):
        seen = f"{values.shape[1]}x{values.shape[0]}"
        raise InputError(f"is a raw view of {seen}, and its CameraInfo is of {info.width}x{info.height}")
    wrong = ""
    if any(info.d) and info.model not in ("", *_MODELS):
        wrong = f"the distortion model {info.model[:40]!r}; known are {', '.join(_MODELS)}"
    elif not all(map(math.isfinite, (*info.d, *info.k, *info.r))):
        wrong = "numbers in D, K or R that are not finite"
    else:
        try:
            columns, rows = _rectification(info)
        except cv2.error:
            wrong = f"{len(info.d)} numbers of distortion, which are no {info.model:.40}"
    if wrong:
        raise InputError(f"is a raw view whose CameraInfo has {wrong}")
    return cv2.remap(values, columns, rows, cv2.INTER_LINEAR)


@lru_cache(maxsize=4)  # the two cameras of a rig
def _rectification(info: CameraInfo) -> tuple[NDArray[Any], NDArray[Any]]:
    size = (info.width, info.height)
    k, r, p = (np.array(each).reshape(3, -1) for each in (info.k, info.r, info.p))
    turned = r if r.any() else np.eye(3)
    of, d = (cv2.fisheye, info.d[:4]) if info.model in _FISHEYE else (cv2, info.d)
    found = of.initUndistortRectifyMap(k, np.array(d), turned, p[:, :3], size, cv2.CV_32FC1)
    return found[0], found[1]
