"""Bags as other programs write them, made by rosbags."""

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra bags")

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

KINDS = ("bag", "db3", "mcap", "folder")
UPRIGHT = tuple(np.eye(3).ravel())
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)


def header(store, stamp, number):
    time = store.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    kind = store.types["std_msgs/msg/Header"]
    return kind(seq=number, stamp=time, frame_id="cam") if store is ROS1 else kind(stamp=time, frame_id="cam")


def image(store, values, encoding, stamp, number=0, padding=0):
    """An Image, whose rows may be longer than their pixels."""
    values = np.ascontiguousarray(values)
    rows = values.reshape(values.shape[0], -1).view(np.uint8)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    return store.types["sensor_msgs/msg/Image"](
        header=header(store, stamp, number),
        height=values.shape[0],
        width=values.shape[1],
        encoding=encoding,
        is_bigendian=int(values.dtype.byteorder == ">"),
        step=rows.shape[1],
        data=rows.ravel(),
    )


def disparity_image(store, values, stamp, number=0, focal=700.0, baseline=0.5, least=0.0):
    """A DisparityImage, as stereo_image_proc fills it."""
    name = "T" if store is ROS1 else "t"
    return store.types["stereo_msgs/msg/DisparityImage"](
        header=header(store, stamp, number),
        image=image(store, values.astype(np.float32), "32FC1", stamp, number),
        f=focal,
        valid_window=store.types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False),
        min_disparity=least,
        max_disparity=128.0,
        delta_d=0.0,
        **{name: baseline},
    )


def camera_info(store, stamp, size, p, d=(), k=UPRIGHT, r=UPRIGHT, number=0, region=(0, 0, 0, 0)):
    """A CameraInfo, of a region (x, y, height, width) of the image; ROS 1 has capital letters."""
    names = "DKRP" if store is ROS1 else "dkrp"
    values = {name: np.array(each, np.float64) for name, each in zip(names, (d, k, r, p), strict=True)}
    return store.types["sensor_msgs/msg/CameraInfo"](
        header=header(store, stamp, number),
        height=size[1],
        width=size[0],
        distortion_model="plumb_bob",
        binning_x=0,
        binning_y=0,
        roi=store.types["sensor_msgs/msg/RegionOfInterest"](*region, False),
        **values,
    )


def compressed(store, data, form, stamp, number=0):
    return store.types["sensor_msgs/msg/CompressedImage"](
        header=header(store, stamp, number), format=form, data=np.frombuffer(data, np.uint8)
    )


def write_bag(folder, name, kind, make, compression=None):
    """Write a bag; `make(store)` yields (topic, log time in ns, message). Returns the path to name.

    Of a topic without messages it yields the type, and no time.
    """
    store = ROS1 if kind == "bag" else ROS2
    if kind == "bag":
        path = folder / f"{name}.bag"
        writer = Writer1(path)
        if compression:
            writer.set_compression(Writer1.CompressionFormat[compression])
    else:
        path = folder / name
        plugin = StoragePlugin.SQLITE3 if kind == "db3" else StoragePlugin.MCAP
        writer = Writer2(path, version=9, storage_plugin=plugin)
    connections = {}
    with writer:
        for topic, time, message in make(store):
            kind_of = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind_of, typestore=store)
            if time is None:
                continue
            serialize = store.serialize_ros1 if store is ROS1 else store.serialize_cdr
            writer.write(connections[topic], time, serialize(message, kind_of))
    if kind in ("db3", "mcap"):
        return next(path.glob(f"*.{kind}")).rename(folder / f"{name}.{kind}")
    return path
