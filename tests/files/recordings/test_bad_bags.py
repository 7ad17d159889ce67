"""What is wrong with a bag, a topic or a message is one line, and costs no more than it must."""

import contextlib
import os
import sqlite3
import struct

import cv2
import numpy as np
import pytest

from tests.files.recordings.bag_files import camera_info, compressed, disparity_image, image, write_bag
from tests.files.recordings.test_bags import START, STEP, P, drive, maps, rows
from tests.run_cli import rollcli, write_pair

MAGIC = b"\x89MCAP0\r\n"
NO_P = [0.0] * 12


@pytest.fixture
def views(tmp_path):
    write_pair(tmp_path, "0.png", maps(1)[0])
    return [cv2.imread(str(tmp_path / side / "0.png"), 0) for side in ("left", "right")]


def changed(message, **values):
    return type(message)(**{**message.__dict__, **values})


def refused(tmp_path, *given):
    return rollcli("estimate", *given, cwd=tmp_path).refused()


@pytest.mark.parametrize("kind", ["mcap", "bag", "db3"])
def test_images_that_are_not_what_they_say_are_an_error_of_their_frame(tmp_path, kind):
    values = maps(1)[0]
    nothing = np.zeros(0, np.uint8)
    wrong = {
        "is truncated: 76800 bytes are needed, 0 are there": {"data": nothing},
        "has no pixels (0 x 0)": {"data": nothing, "width": 0, "height": 0, "step": 0},
        "its rows have 100 bytes, of 640 that 160 pixels of 32FC1 need": {"step": 100},
        "its rows have 640 bytes, of 8000000000 that": {"width": 2 * 10**9, "height": 2 * 10**9},
        "is truncated: 2560000000000 bytes are needed": {"height": 4 * 10**9},
        "has pixels of the encoding 'yuv422'": {"encoding": "yuv422"},
    }

    def make(store):
        for place, given in enumerate([{}, *wrong.values(), {}]):
            stamp = START + place * STEP
            yield "/depth", stamp, changed(image(store, values, "32FC1", stamp), **given)

    path = write_bag(tmp_path, "drive", kind, make).name
    done = rollcli("estimate", path, cwd=tmp_path)
    found = rows(done.out)
    assert [row["status"] for row in found] == ["ok", *["error"] * len(wrong), "ok"]
    assert done.status == 3
    for row, expected in zip(found[1:-1], wrong, strict=True):
        assert row["message"].startswith(expected), row["message"]


def test_sizes_that_change_within_a_drive_are_told(tmp_path, views):
    left, right = views

    def make(store):
        for place, (one, other) in enumerate([(left, right), (left, right[:-2]), (left[:-20], right[:-20])]):
            stamp = START + place * STEP
            yield "/l", stamp, image(store, one, "mono8", stamp)
            yield "/r", stamp, image(store, other, "mono8", stamp)
            yield "/l/camera_info", stamp, camera_info(store, stamp, (160, 120), P)

    path = write_bag(tmp_path, "drive", "mcap", make).name
    given = ["--focal", "350", "--principal-point", "80,60"]
    done = rollcli("estimate", path, "--left-topic", "/l", "--right-topic", "/r", *given, cwd=tmp_path)
    found = rows(done.out)
    assert (done.status, [row["status"] for row in found]) == (3, ["ok", "error", "ok"])
    assert "left and right image differ in size: 160x120 and 160x118" in found[1]["message"]
    assert [row["height"] for row in found] == ["120", "", "100"]


def test_a_camera_info_without_p_is_told(tmp_path, views):
    def make(store):
        for place in range(2):
            stamp = START + place * STEP
            for side, view in zip(("left", "right"), views, strict=True):
                yield f"/{side}/camera_info", stamp, camera_info(store, stamp, (160, 120), NO_P)
                yield f"/{side}/image_raw", stamp, image(store, view, "mono8", stamp)
            yield "/disparity", stamp, disparity_image(store, maps(1)[0], stamp)

    path = write_bag(tmp_path, "drive", "mcap", make).name
    line = "no CameraInfo with a principal point (P): no pitch and no height without --calib"
    found = rollcli("estimate", path, "--topic", "/disparity", cwd=tmp_path)
    assert (found.status, f"{path}: {line}" in found.err) == (0, True)
    given = ["--left-topic", "/left/image_raw", "--right-topic", "/right/image_raw"]
    for command in (["estimate"], ["disparity", "-o", "maps"]):
        done = rollcli(*command, path, *given, cwd=tmp_path)
        assert (done.status, f"{path}: {line}" in done.err) == (0, True), done.err
        assert "/left/image_raw: raw views are taken as they are" in done.err
    assert len(list((tmp_path / "maps").iterdir())) == 2


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(words):
    return struct.pack("<I", len(words)) + words.encode()


def foreign_mcap(path, kind, encoding, count=3):
    """An MCAP of another profile than ROS's, with a topic /camera [https://mcap.dev/spec]."""
    records = [
        record(1, text("") + text("")),
        record(3, struct.pack("<H", 1) + text(kind) + text(encoding) + text("")),
        record(4, struct.pack("<HH", 1, 1) + text("/camera") + text(encoding) + text("")),
        *(record(5, struct.pack("<HIQQ", 1, place, START, START) + bytes(100)) for place in range(count)),
        record(0x0F, bytes(4)),
        record(2, bytes(20)),
    ]

    path.write_bytes(MAGIC + b"".join(records) + MAGIC)


@pytest.mark.parametrize(
    ("kind", "encoding", "expected"),
    [
        ("foxglove.RawImage", "protobuf", "messages of the type foxglove.RawImage, not images of ROS"),
        ("foxglove_msgs/msg/CompressedVideo", "cdr", "such video must be decoded in order"),
        ("sensor_msgs/msg/Image", "json", "/camera is serialized as json; cdr and ros1 are read"),
        ("sensor_msgs/msg/PointCloud2", "cdr", "messages of the type sensor_msgs/PointCloud2, not images"),
    ],
)
def test_topics_that_no_decoder_is_for_are_refused_with_a_line(tmp_path, kind, encoding, expected):
    foreign_mcap(tmp_path / "drive.mcap", kind, encoding)
    assert "its topics: /camera" in refused(tmp_path, "drive.mcap")
    assert expected in refused(tmp_path, "drive.mcap", "--topic", "/camera")
    both = ["--left-topic", "/camera", "--right-topic", "/camera"]
    assert expected in refused(tmp_path, "drive.mcap", *both)
    assert "has no topic /other; its topics: /camera" in refused(tmp_path, "drive.mcap", "--topic", "/other")


def test_video_in_compressed_images_is_refused_with_a_line(tmp_path):
    def make(store):
        for topic in ("/l", "/r"):
            yield topic, START, compressed(store, b"\0\0\0\1\x67" + bytes(500), "h264", START)

    path = write_bag(tmp_path, "drive", "mcap", make).name
    err = refused(tmp_path, path, "--left-topic", "/l", "--right-topic", "/r")
    assert "/l holds video (h264), which must be decoded in order" in err


def test_an_encrypted_bag_is_refused_with_a_line(tmp_path):
    path = write_bag(tmp_path, "drive", "bag", drive(2))
    data = path.read_bytes()
    start = len(b"#ROSBAG V2.0\n")
    (length,) = struct.unpack_from("<I", data, start)
    header, after = data[start + 4 : start + 4 + length], start + 4 + length
    field = text("encryptor=rosbag/AesCbcEncryptor")
    (padding,) = struct.unpack_from("<I", data, after)
    header, padding = header + field, padding - len(field)
    head = struct.pack("<I", len(header)) + header + struct.pack("<I", padding) + b" " * padding
    rest = np.random.default_rng(0).bytes(len(data) - start - len(head))
    path.write_bytes(data[:start] + head + rest)
    assert "drive.bag: is encrypted: decrypt it first" in refused(tmp_path, "drive.bag")


@pytest.mark.parametrize("url", ["s3://bucket/drive.mcap", "http://127.0.0.1:9/drive.bag", "gs://b/d.db3"])
def test_bags_in_buckets_are_refused_with_a_line(tmp_path, url):
    assert f"{url}: recordings are read from local disk: download it first" in refused(tmp_path, url)


def test_without_the_extra_a_line_says_what_to_install(tmp_path):
    path = write_bag(tmp_path, "drive", "mcap", drive(1)).name
    (tmp_path / "hidden" / "rosbags").mkdir(parents=True)
    (tmp_path / "hidden" / "rosbags" / "__init__.py").write_text("raise ModuleNotFoundError(name='rosbags')")
    said = rollcli("estimate", path, cwd=tmp_path, PYTHONPATH=str(tmp_path / "hidden")).refused()
    assert f"{path} needs the extra bags: " in said
    assert "pip install rosbags" in said


def repacked(data, compression, packed, claimed):
    """An MCAP of rosbags' as others write it: topics before its chunk, which is packed, and no index."""
    records, at = [], len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        records.append((opcode, data[at + 9 : at + 9 + length]))
        at += 9 + length
    (chunk,) = (content for opcode, content in records if opcode == 6)
    plain = chunk[40:]
    (size,) = struct.unpack_from("<Q", chunk, 16)
    inside = packed(plain)
    chunk = chunk[:16] + struct.pack("<QI", claimed(size), 0) + text(compression)
    chunk += struct.pack("<Q", len(inside)) + inside
    topics = b"".join(record(opcode, content) for opcode, content in records if opcode in (3, 4))
    ends = record(0x0F, bytes(4)) + record(2, bytes(20))
    return MAGIC + record(1, bytes(8)) + topics + record(6, chunk) + ends + MAGIC


def zstd(plain):
    return pytest.importorskip("zstandard").compress(plain)


def lz4(plain):
    return pytest.importorskip("lz4.frame").compress(plain)


@pytest.mark.parametrize(
    ("compression", "packed", "claimed", "whole", "broken"),
    [
        ("zstd", zstd, int, 3, False),
        ("lz4", lz4, int, 3, False),
        ("zstd", lambda plain: zstd(plain)[:-80_000], int, 1, True),
        ("lz4", lambda plain: lz4(plain)[:-80_000], int, 1, True),
        ("lz4", lz4, lambda size: size + 100, 3, True),
        ("lz4", lz4, lambda size: 2**40, 0, True),
        ("snappy", bytes, int, 0, True),
    ],
)
def test_what_is_whole_of_a_packed_chunk_is_used(tmp_path, compression, packed, claimed, whole, broken):
    noise = np.random.default_rng(0).random((120, 160), np.float32) / 1000
    path = write_bag(tmp_path, "drive", "mcap", drive(3, [each + noise for each in maps(3)]))
    expected = rows(rollcli("estimate", path.name, cwd=tmp_path).out)
    path.write_bytes(repacked(path.read_bytes(), compression, packed, claimed))
    done = rollcli("estimate", path.name, cwd=tmp_path)
    found = rows(done.out)
    assert done.status == (3 if broken else 0)
    if broken:
        rest = found.pop()
        assert (rest["file"], "is damaged or cut off" in rest["message"]) == ("drive.mcap#rest", True)
    # of the one that is not whole, its header may be
    assert [row for row in found if row["status"] != "error"] == expected[:whole]
    assert len(found) <= whole + broken


def test_frames_that_a_bag_does_not_have_are_an_error_of_theirs(tmp_path):
    path = write_bag(tmp_path, "drive", "mcap", drive(1)).name
    done = rollcli("estimate", f"{path}#/nothing@5", f"{path}#/stereo/disparity@5", cwd=tmp_path)
    assert (done.status, [row["message"] for row in rows(done.out)]) == (
        3,
        [f"no such topic in {path}", f"no such frame in {path}"],
    )
    done = rollcli("estimate", path, "--encoding", "foundationstereo", cwd=tmp_path)
    assert (done.status, rows(done.out)[0]["message"]) == (3, "is a frame of a recording, and no file")


def test_a_topic_without_messages_is_refused_with_a_line(tmp_path):
    foreign_mcap(tmp_path / "drive.mcap", "stereo_msgs/msg/DisparityImage", "cdr", count=0)
    assert "drive.mcap: has no messages of /camera" in refused(tmp_path, "drive.mcap")


def test_the_first_messages_may_be_damaged(tmp_path):
    """A map, a calibration and an image of which nothing can be decoded cost no other frame."""
    path = write_bag(tmp_path, "drive", "db3", drive(3))
    whole = rows(rollcli("estimate", path.name, cwd=tmp_path).out)
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute("UPDATE messages SET data = substr(data, 1, 20) WHERE id <= 3")
    done = rollcli("estimate", path.name, cwd=tmp_path)
    found = rows(done.out)
    assert (done.status, found[1:]) == (3, whole[1:])
    assert found[0]["message"].startswith("is a damaged message of stereo_msgs/DisparityImage")
    assert all(float(row["height_m"]) > 0 for row in found[1:])


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE messages SET timestamp = 'soon'",
        "UPDATE messages SET timestamp = 9e999",
        "UPDATE topics SET type = CAST(type AS BLOB), name = CAST(name AS BLOB)",
    ],
)
def test_values_of_another_type_in_the_tables_of_a_bag_are_no_matter(tmp_path, change):
    path = write_bag(tmp_path, "drive", "db3", drive(2))
    whole = rollcli("estimate", path.name, cwd=tmp_path).out
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute(change)
    os.utime(path, (0, 0))  # another file
    done = rollcli("estimate", path.name, cwd=tmp_path)
    assert (done.status, done.out) == (0, whole)
