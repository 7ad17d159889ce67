"""Small bags, byte by byte, whole and with damages, and what is read of them."""

import bz2
import contextlib
import json
import math
import os
import re
import sqlite3
import struct
import tempfile
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest

from rollcli.errors import RollcliError
from rollcli.files.recordings import messages
from rollcli.files.recordings.bags import Topic, opened
from tests.recorded import made

_MAGIC = b"\x89MCAP0\r\n"
_DATA = [bytes(range(size)) for size in (100, 70, 3)]  # of messages; the beginning is 64 bytes
_TIMES = (5, 2**33, 7)


def _text(words):
    return struct.pack("<I", len(words)) + words.encode()


def _record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def _topics_of_mcap():
    return [
        _record(3, struct.pack("<H", 7) + _text("sensor_msgs/msg/Image") + _text("ros2msg") + _text("")),
        _record(4, struct.pack("<HH", 1, 7) + _text("/a") + _text("cdr") + _text("")),
        _record(4, struct.pack("<HH", 2, 9) + _text("/b") + _text("json") + _text("")),
    ]


def mcap(compression=None, pack=bytes, *, more=0, indexed=True, data=_DATA):
    """Messages, bare or in a chunk that claims `more` bytes than it has, then their topics again."""
    topics = _topics_of_mcap()
    inside = b"".join(
        _record(5, struct.pack("<HIQQ", each, 0, time, 9) + content)
        for each, time, content in zip((1, 2, 1), _TIMES, data, strict=False)
    )
    if compression is not None:
        packed = pack(inside)
        head = struct.pack("<QQQI", 0, 9, len(inside) + more, 0) + _text(compression)
        inside = _record(6, head + struct.pack("<Q", len(packed)) + packed)
    before = _MAGIC + _record(1, bytes(8)) + b"".join(topics) + inside + _record(0x0F, bytes(4))
    summary = len(before) if indexed else 0
    after = b"".join(topics) if indexed else b""
    return before + after + _record(2, struct.pack("<QQI", summary, 0, 0)) + _MAGIC


def _fields(**fields):
    found = b""
    for name, value in fields.items():
        found += struct.pack("<I", len(name) + 1 + len(value)) + f"{name}=".encode() + value
    return struct.pack("<I", len(found)) + found


def _ros1(compression=None, pack=bytes, *, more=0, indexed=True, **further):
    number = partial(struct.pack, "<I")
    topics = [
        _fields(op=b"\x07", conn=number(each), topic=name) + _sized(_fields(type=kind)[4:])
        for each, name, kind in ((0, b"/a", b"sensor_msgs/Image"), (3, b"/b", b"x/y"))
    ]
    inside = b"".join(
        _fields(op=b"\x02", conn=number(each), time=struct.pack("<II", time & 7, time >> 3)) + _sized(data)
        for each, time, data in zip((0, 3, 0), _TIMES, _DATA, strict=True)
    )
    inside = b"".join(topics) + inside
    if compression is not None:
        packed = pack(inside)
        head = _fields(op=b"\x05", compression=compression.encode(), size=number(len(inside) + more))
        inside = head + _sized(packed)
    start = b"#ROSBAG V2.0\n"

    def opening(index):
        return _fields(op=b"\x03", index_pos=struct.pack("<Q", index), **further) + _sized(b" " * 9)

    index = len(start) + len(opening(0)) + len(inside) if indexed else 0
    other = _fields(op=b"\x06", ver=number(1)) + _sized(bytes(5))
    return start + opening(index) + inside + (b"".join(topics) if indexed else b"") + other


_TABLES = """
CREATE TABLE topics (id INTEGER PRIMARY KEY, name, type, serialization_format);
CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, data);
INSERT INTO topics VALUES (1, '/a', 'sensor_msgs/msg/Image', 'cdr'), (3, '/b', 'x/y', 'json');
INSERT INTO topics VALUES (4, 'none', 'x/msg/z', '');
"""


def _db3(*changes, page=512, lost=0):
    """A base of pages of a size, changed, whose end may be lost."""
    if not hasattr(sqlite3.Connection, "blobopen"):
        pytest.skip("before Python 3.11 the beginning of a message is all of it")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x")
        with contextlib.closing(sqlite3.connect(path)) as base:
            base.executescript(f"PRAGMA page_size={page};{_TABLES}")
            long = [each * 40 for each in _DATA]
            found = zip((1, 3, 4, 1, 9, 3), (*_TIMES, 2, 3, None), (*_DATA, *long), strict=True)
            base.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)", found)
            base.executescript(";".join(changes))
        return path.read_bytes()[: -lost or None]


def _sized(data):
    return struct.pack("<I", len(data)) + data


def _read(data):
    """Topics, messages, what is broken, and each message read alone, in turn from the last."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x")
        path.write_bytes(data)
        try:
            bag = opened(str(path))
            topics = bag.topics
            found = list(bag.messages(set(topics) - {"none"}, ["/b"]))
        except RollcliError as error:
            return str(error).replace(f"{folder}{os.sep}", "")
        some = [[each.topic, each.log_time, *each.place, _seen(each.data)] for each in found]
        alone = [_alone(bag, each.place) for each in (*found[::-1], *found)]
        only = [each.place[1] for each in bag.messages({"/b"})]
        return {
            "topics": [f"{each.name} {each.type} {each.encoding}" for each in topics.values()],
            "messages": some,
            "alone": alone,
            "only b": only,
            "broken": bag.broken,
            "nothing": [_alone(bag, each) for each in ((0, 0), (found[0].place[0], 9) if found else (9, 9))],
        }


def _seen(data):
    return f"{len(data)}: {sum(data)}"


def _alone(bag, place):
    try:
        return _seen(bag.read(place))
    except RollcliError as error:
        return type(error).__name__


def _shortly(data):
    """How many messages are read, and what is broken."""
    found = _read(data)
    if isinstance(found, str):
        return found
    return f"{len(found['messages'])} of {len(found['topics'])} topics, {found['broken'] or 'whole'}"


def _cut(data):
    return [_shortly(data[:end]) for end in range(0, len(data), 11)]


def _damaged(data):
    return [
        _shortly(data[:at] + bytes([data[at] ^ 129]) + data[at + 1 :])
        for at in range(7, min(len(data), 420), 9)
    ]


def _zstd(data):
    return pytest.importorskip("zstandard", reason="zstandard, of the extra bags, is not here").compress(data)


def _lz4(data):
    return pytest.importorskip("lz4.frame", reason="lz4, of the extra bags, is not here").compress(data)


PACKED = {
    "mcap": {"": bytes, "none": bytes, "zstd": _zstd, "lz4": _lz4, "snappy": bytes},
    "bag": {"none": bytes, "bz2": bz2.compress, "lz4": _lz4},
}
_SHARE = re.compile(" at .*")
MADE = {"mcap": mcap, "bag": _ros1}


def _packed(kind, compression, pack):
    """What is read of a packed chunk, whose size is that of this packer."""
    make = partial(MADE[kind], compression, pack)
    whole = _read(make())
    whole["broken"] = _SHARE.sub("", whole["broken"])
    others = [_shortly(make(more=more)) for more in (-1, 1, 10**9)] + [_shortly(make(indexed=False))]
    return [whole, *(_SHARE.sub("", each) for each in others)]


def _cut_in_a_pack(compression, pack, lost):
    """What is read of messages of noise whose chunk has lost so many bytes of its end."""
    noise = [np.random.default_rng(each).bytes(100_000) for each in range(3)]
    found = _read(mcap(compression, lambda plain: pack(plain)[:-lost], data=noise))
    return [found["messages"], found["alone"], _SHARE.sub("", found["broken"])]


INPUTS = json.loads(Path(__file__).with_name("inputs.json").read_text("utf-8"))


def _camera(changes):
    fields = {**INPUTS["camera"], **changes}
    return messages.CameraInfo(
        **{name: tuple(each) if isinstance(each, list) else each for name, each in fields.items()}
    )


def _info(changes):
    info = _camera(changes)
    return [info.usable, info.changes_raw_views]


STAMPS = {
    "ros1": [struct.pack("<III", 9, 3, 4), struct.pack("<III", 9, 0, 0), bytes(11), b""],
    "cdr": [struct.pack("<4siI", b"\0\1", 3, 4), struct.pack(">4siI", b"", -3, 4), bytes(12), b"\0", b""],
}


def _stamps():
    return {
        form: [messages.stamp_of(Topic("/a", "x", form), memoryview(each), 77) for each in given]
        for form, given in STAMPS.items()
    }


def _image(encoding, width, height, step, size=None, big=False):
    """An Image as a decoder gives it."""
    data = (np.arange(step * height if size is None else size) * 37 % 251).astype(np.uint8)
    shape = {"width": width, "height": height, "step": step}
    return SimpleNamespace(encoding=encoding, is_bigendian=big, data=data, **shape)


def _content(message, kind=messages.IMAGE, raw_of=None):
    """What a message holds that is decoded already."""
    with mock.patch.object(messages, "_decoded", return_value=message):
        found = made(messages.content_of, Topic("/a", kind, "cdr"), memoryview(b""), raw_of)
    if isinstance(found, str):
        return found
    if isinstance(found, bytes):
        return found.decode("latin-1")
    values = found.astype(float) if found.dtype.kind == "f" else found.view(np.uint8)
    return [str(found.dtype), found.shape, *values.ravel().tolist()]


def _disparities(least, encoding="32FC1"):
    """A DisparityImage whose values are 0 to 3.5, or bytes."""
    image = _image(encoding, 4, 2, 16)
    if encoding == "32FC1":
        image.data = (np.arange(8, dtype="<f4") / 2).view(np.uint8)
    return _content(SimpleNamespace(image=image, min_disparity=least), messages.DISPARITY)


def _compressed(form, data):
    given = SimpleNamespace(format=form, data=np.frombuffer(data, np.uint8))
    return _content(given, messages.COMPRESSED)


def _raw(changes):
    """What becomes of a raw view: what is between pixels differs from version to version of OpenCV."""
    found = _content(_image("mono8", 4, 3, 4), raw_of=_camera(changes))
    return found if isinstance(found, str) or not changes.keys() & {"d", "model"} else found[:2]


def _of_decoded(function, form="cdr", **fields):
    """What a function makes of a message that is decoded already."""
    with mock.patch.object(messages, "_decoded", return_value=SimpleNamespace(**fields)):
        return made(function, Topic("/a", messages.IMAGE, form), memoryview(b""))


CASES = {
    **{
        f"bag: {kind}, {what}": partial(lambda kind, make, data: make(data()), kind, make, data)
        for kind, data in (
            ("mcap", mcap),
            ("mcap in a chunk", partial(mcap, "")),
            ("ros1", _ros1),
            ("ros1 in a chunk", partial(_ros1, "none")),
        )
        for what, make in (("whole", _read), ("cut", _cut), ("damaged", _damaged))
    },
    **{
        f"bag: {kind} as {compression or 'it is'}": partial(_packed, kind, compression, pack)
        for kind, packs in PACKED.items()
        for compression, pack in packs.items()
    },
    **{
        f"bag: mcap cut in {each} by {lost}": partial(_cut_in_a_pack, each, PACKED["mcap"][each], lost)
        for each in ("zstd", "lz4")
        for lost in (150_000, 1_000)
    },
    "bag: mcap without an end": lambda: [_shortly(mcap(indexed=False)[:-lost]) for lost in (8, 37, 50)],
    "bag: mcap and zeros": lambda: _shortly(mcap(indexed=False)[:-50] + bytes(99)),
    "bag: db3": lambda: [
        _read(_db3()),
        _read(_db3("UPDATE messages SET data = 'text' WHERE id = 2")),
        _read(_db3("UPDATE messages SET data = NULL, timestamp = 'soon' WHERE id = 3")),
        _read(_db3("DROP TABLE topics")),
        _read(_db3("DROP TABLE messages")),
        _read(_db3("DELETE FROM topics WHERE id > 1")),
        *(_shortly(_db3(lost=pages * 512)) for pages in range(18)),
        *(_shortly(_db3(page=65536, lost=each)) for each in (0, 1, 65000, 70000)),
    ],
    "bag: no bag": lambda: [
        _read(each) for each in (b"", b"MCAP", b"SQLite format 3", _MAGIC, _ros1(encryptor=b"rosbag/Aes"))
    ],
    "camera infos": lambda: {name: _info(changes) for name, changes in INPUTS["cameras"].items()},
    "stamps": _stamps,
    "decoders": lambda: [made(messages.check_decoder, Topic("/a", *each)) for each in INPUTS["topics"]],
    "pixels of messages": lambda: [_content(_image(*each)) for each in INPUTS["images"]],
    "disparities of messages": lambda: (
        [_disparities(each) for each in (-1.0, 0.0, 1.0, 3.5, 9.0)] + [_disparities(9.0, "mono8")]
    ),
    "compressed messages": lambda: [
        _compressed("16UC1; compressedDepth", b"head\x89PNG\r\n\x1a\nrest"),
        _compressed("16UC1; compressedDepth", b"head"),
        _compressed("jpeg", b"head\x89PNG\r\n\x1a\nrest"),
    ],
    "baselines": lambda: [
        [_of_decoded(messages.baseline_of, t=each), _of_decoded(messages.baseline_of, "ros1", T=each)]
        for each in (0.5, -0.25, math.nan, -math.inf)
    ],
    "raw views": lambda: [_raw(each) for each in INPUTS["raw views"]],
}
