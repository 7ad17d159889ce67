"""Bags in all kinds give the rolls of the same frames from files; what is broken in them is told."""

import contextlib
import math
import sqlite3
import struct
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest

import rollcli as package
from rollcli.errors import InputError, UsageError
from rollcli.files.formats import read_image
from rollcli.rig.calibration import Calibration
from tests.files.recordings.bag_files import KINDS, camera_info, compressed, disparity_image, image, write_bag
from tests.run_cli import road_map, rollcli, write_pair
from tests.run_cli import rows_of as rows
from tests.slow import mostly_slow

START = 1_700_000_000_123_456_789
STEP = 100_000_000
P = (350.0, 0, 80, 0, 0, 350, 60, 0, 0, 0, 1, 0)
P_RIGHT = (350.0, 0, 80, -175, 0, 350, 60, 0, 0, 0, 1, 0)
SHARED = Path(__file__).parents[3].parent / "shared" / "bags"


def maps(count):
    return [road_map(math.radians(each)).astype(np.float32) for each in range(count)]


def drive(count, values=None):
    """Messages of a drive of disparity maps, with the calibration of both cameras."""

    def make(store):
        frames = maps(count) if values is None else values
        height, width = frames[0].shape
        for number, each in enumerate(frames):
            stamp = START + number * STEP
            for side, p in (("left", P), ("right", P_RIGHT)):
                info = camera_info(store, stamp, (width, height), p, number=number)
                yield f"/stereo/{side}/camera_info", stamp + 5_000_000, info
            yield "/stereo/disparity", stamp + 5_000_000, disparity_image(store, each, stamp, number)

    return make


def write_split(folder, *makes):
    """Write a bag of several files, as rosbag2 splits it, the last one first. Returns the folder to name."""
    folder.mkdir()
    (folder / "metadata.yaml").touch()
    for number, make in [*enumerate(makes)][::-1]:
        name = f"{folder.name}_{number}"
        write_bag(folder.parent, name, "mcap", make).rename(folder / f"{name}.mcap")
    return folder


@pytest.mark.parametrize("kind", mostly_slow(KINDS, "mcap"))
def test_disparity_images_give_the_rows_of_the_same_maps_in_files(tmp_path, kind):
    (tmp_path / "maps").mkdir()
    for number, each in enumerate(maps(3)):
        np.save(tmp_path / "maps" / f"{number}.npy", each)
    path = write_bag(tmp_path, "drive", kind, drive(3)).name
    numbers = ["--focal", "350", "--principal-point", "80,60", "--baseline", "0.5"]
    files = rows(rollcli("estimate", "maps", *numbers, cwd=tmp_path).out)
    done = rollcli("estimate", path, "-j", "2", "--derotated", "upright", cwd=tmp_path)
    found = rows(done.out)
    assert (done.status, len(found), "changes" in done.err) == (0, 3, False), done.err
    for one, other in zip(files, found, strict=True):
        for column in ("roll_deg", "pitch_deg", "height_m"):
            assert float(one[column]) == pytest.approx(float(other[column]), abs=1e-4), column
    inside = f"{path}/drive.mcap" if kind == "folder" else path
    assert [row["file"] for row in found] == [
        f"{inside}#/stereo/disparity@{START + each * STEP}" for each in range(3)
    ]
    made = sorted(each.name for each in (tmp_path / "upright").iterdir())
    assert made == [f"drive_{START + each * STEP}.npy" for each in range(3)]
    (tmp_path / "rolls.csv").write_text(done.out)
    rollcli("derotate", path, "--from", "rolls.csv", "-o", "again", cwd=tmp_path, status=0)
    for name in made:
        upright, again = (np.load(tmp_path / folder / name) for folder in ("upright", "again"))
        np.testing.assert_allclose(upright, again, rtol=1e-5)  # a result rounds its angles
    one = rollcli("estimate", found[1]["file"], *numbers, cwd=tmp_path)
    assert rows(one.out)[0]["roll_deg"] == found[1]["roll_deg"]
    every = rollcli("estimate", path, f"./{path}", "--every", "2", cwd=tmp_path)
    assert rows(every.out) == [found[0], found[2]]
    listed = rollcli("estimate", path, "--dry-run", cwd=tmp_path).out.splitlines()
    assert listed == [f"read  {row['file']}" for row in found]


@pytest.mark.parametrize("kind", mostly_slow(KINDS, "mcap"))
def test_views_are_paired_by_their_stamps_never_by_order(tmp_path, kind):
    views = [
        write_pair(tmp_path / "pairs", f"{number}.png", road_map(math.radians(number)), seed=number)
        for number in range(4)
    ]

    def make(store):
        for number, (left, right) in enumerate(views):
            stamp = START + number * STEP
            yield "/l/image_rect", stamp, image(store, left, "mono8", stamp, number, padding=5)
            if number != 1:  # dropped
                late = stamp + 15_000  # as OAK's cameras
                yield "/r/image_rect", late, image(store, right, "mono8", late, number)
        yield "/none", None, store.types["sensor_msgs/msg/Image"]

    path = write_bag(tmp_path, "drive", kind, make).name
    (tmp_path / "pairs/left/1.png").unlink()
    (tmp_path / "pairs/right/1.png").unlink()
    files = rows(rollcli("estimate", "--left", "pairs/left", "--right", "pairs/right", cwd=tmp_path).out)
    given = ["--left-topic", "/l/image_rect", "--right-topic", "/r/image_rect"]
    done = rollcli("estimate", path, *given, cwd=tmp_path, status=0)
    found = rows(done.out)
    assert [row["file"].rpartition("@")[2] for row in found] == [
        str(START + each * STEP) for each in (0, 2, 3)
    ]
    assert [row["right_file"].rpartition("@")[2] for row in found] == [
        str(START + each * STEP + 15_000) for each in (0, 2, 3)
    ]
    for one, other in zip(files, found, strict=True):
        assert float(one["roll_deg"]) == pytest.approx(float(other["roll_deg"]), abs=0.005)
    assert f"1 left view without a partner within 1 ms, left out: @{START + STEP}" in done.err
    far = rollcli("estimate", path, *given, "--sync-tolerance", "0.01", cwd=tmp_path)
    assert "within 0.01 ms" in far.refused()
    none = rollcli("estimate", path, *given[:3], "/none", cwd=tmp_path)
    assert "has no messages of /none\n" in none.refused()


@pytest.mark.parametrize("view", ["image_raw", "image_raw/compressed", "image_mono", "image_color"])
def test_raw_views_are_rectified_and_a_line_says_so(tmp_path, view):
    pair = write_pair(tmp_path / "pairs", "0.png", road_map(math.radians(3)))
    height, width = pair[0].shape
    k = np.array([[350.0, 0, 80], [0, 350, 60], [0, 0, 1]])
    d = np.array([-0.2, 0.05, 0.001, -0.001, 0.0])
    # the raw view by its definition: each of its pixels shows what lies at its undistorted place
    v, u = np.mgrid[:height, :width].astype(np.float64)
    places = cv2.undistortPoints(np.dstack([u, v]).reshape(-1, 1, 2), k, d, P=k).reshape(height, width, 2)
    raw = {
        side: cv2.remap(each, places.astype(np.float32), None, cv2.INTER_CUBIC)
        for side, each in zip(("left", "right"), pair, strict=True)
    }

    def make(store):
        for side, p in (("left", P), ("right", P_RIGHT)):
            yield f"/{side}/camera_info", START, camera_info(store, START, (0, 0), np.zeros(12))  # not loaded
            for stamp, each in ((START, d), (START + 1, d), (START + 2, 2 * d)):  # calibrated anew
                info = camera_info(store, stamp, (width, height), p, each, k.ravel())
                yield f"/{side}/camera_info", stamp, info
            if "compressed" in view:
                png = cv2.imencode(".png", raw[side])[1].tobytes()
                yield f"/{side}/{view}", START, compressed(store, png, "mono8; png", START)
            else:
                yield f"/{side}/{view}", START, image(store, raw[side], "mono8", START)

    path = write_bag(tmp_path, "drive", "mcap", make).name
    for side, each in raw.items():
        new = np.reshape(P, (3, 4))[:, :3]
        places = cv2.initUndistortRectifyMap(k, d, np.eye(3), new, (width, height), cv2.CV_32FC1)
        upright = cv2.remap(each, *places, cv2.INTER_LINEAR)
        rounded = cv2.undistort(each, k, d, None, new)  # its places are rounded to 1/32 px
        assert np.abs(upright.astype(int) - rounded).mean() < 0.5  # levels of 256
        cv2.imwrite(str(tmp_path / "pairs" / side / "0.png"), upright)
    files = rows(rollcli("estimate", "--left", "pairs/left", "--right", "pairs/right", cwd=tmp_path).out)
    given = [f"--{side}-topic=/{side}/{view}" for side in ("left", "right")]
    done = rollcli("estimate", path, *given, cwd=tmp_path)
    assert "raw views are rectified by D, K, R and P of /left/camera_info" in done.err
    assert f"/left/camera_info changes at @{START + 2}: only what it says before is used" in done.err
    found = rows(done.out)[0]
    assert float(found["roll_deg"]) == pytest.approx(float(files[0]["roll_deg"]), abs=0.005)
    assert found["height_m"] != ""


@pytest.mark.parametrize("kind", mostly_slow(["bag", "db3", "mcap"], "bag"))
def test_a_bag_that_is_cut_gives_every_whole_message_and_a_line(tmp_path, kind):
    frames = [
        each + np.float32(0.001) * np.random.default_rng(1).random(each.shape, np.float32) for each in maps(6)
    ]
    path = write_bag(tmp_path, "drive", kind, drive(6, frames))
    whole = {row["file"]: row["roll_deg"] for row in rows(rollcli("estimate", path.name, cwd=tmp_path).out)}
    data = path.read_bytes()
    counts = []
    for tenth in range(1, 10):
        path.write_bytes(data[: len(data) * tenth // 10])
        done = rollcli("estimate", path.name, "-j", "1", cwd=tmp_path)
        found = rows(done.out)
        assert done.status == (3 if found else 2)
        counts.append(max(len(found) - 1, 0))
        assert all(whole[row["file"]] == row["roll_deg"] for row in found[:-1])
        if found:
            assert (found[-1]["file"], found[-1]["status"]) == (f"{path.name}#rest", "error")
            assert "cut off" in found[-1]["message"]
    assert counts == sorted(counts)
    assert counts[-1] >= 4


@pytest.mark.parametrize("compression", mostly_slow(["LZ4", "BZ2"], "LZ4"))
def test_what_follows_a_damaged_chunk_of_a_bag_is_used(tmp_path, compression):
    noise = np.random.default_rng(1)  # of a chunk for each frame
    frames = [4 * cv2.resize(each, (640, 480)) + noise.random((480, 640)) / 1000 for each in maps(4)]
    path = write_bag(tmp_path, "drive", "bag", drive(4, frames), compression)
    whole = rows(rollcli("estimate", path.name, cwd=tmp_path).out)
    data = bytearray(path.read_bytes())
    second = data.index(b"op=\x05", data.index(b"op=\x05") + 1)
    data[second + 200 : second + 20_000] = bytes(19_800)
    path.write_bytes(data)
    done = rollcli("estimate", path.name, cwd=tmp_path)
    found = rows(done.out)
    assert done.status == 3
    assert [row for row in found if row["status"] != "error"] == [whole[0], *whole[2:]]
    assert found[-1]["file"] == "drive.bag#rest"
    assert f"is damaged or cut off in what begins at byte {second - 8} of" in found[-1]["message"]


@pytest.mark.skipif(not SHARED.is_dir(), reason="the bags of other programs are not here")
def test_bags_of_other_programs_without_images_end_in_a_line_with_their_topics():
    paths = [path for path in sorted(SHARED.iterdir()) if path.suffix in (".bag", ".db3", ".mcap")]
    for path in paths:
        done = rollcli("estimate", str(path), cwd=SHARED, status=2)
        assert len(done.err.splitlines()) == 1, path
        assert "its topics: " in done.err or "it has no topics" in done.err, path


def test_python_iterates_the_frames_of_a_bag(tmp_path):
    path = write_bag(tmp_path, "drive", "bag", drive(2))
    with ThreadPoolExecutor(3) as pool:
        found, *others = pool.map(list, map(package.open_recording, [path] * 9))
    assert path.resolve() not in [each.resolve() for each in Path("/proc/self/fd").glob("*")]  # closed
    assert [each.stamp for each in found] == [START, START + STEP]
    for frames in (found, *others):
        np.testing.assert_array_equal([each.disparity for each in frames], maps(2))
    assert (found[0].calibration.fx, found[0].calibration.baseline) == (350, 0.5)
    path.write_bytes(path.read_bytes()[:-90_000])
    with pytest.raises(InputError, match="cut off in what"):
        list(package.open_recording(path))


def test_python_iterates_the_views_of_a_bag(tmp_path):
    colours = np.broadcast_to(np.array([30, 90, 200], np.uint8), (24, 32, 3))

    def make(store):
        yield "/grey", START, image(store, colours[..., 0], "mono8", START)
        yield "/rgb", START, image(store, colours[..., ::-1], "rgb8", START, padding=3)
        y, u, v = 116, 85, 181  # the same colour [ITU-R BT.601]
        for name, two in (("yuv422", [[u, y], [v, y]]), ("yuv422_yuy2", [[y, u], [y, v]])):
            packed = np.tile(np.array(two, np.uint8), (24, 16, 1))
            yield f"/{name}", START, image(store, packed, name, START, padding=3)
            yield f"/odd/{name}", START, image(store, packed[:, 1:], name, START)
        jpeg = cv2.imencode(".jpg", colours, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes()
        yield "/jpeg/compressed", START, compressed(store, jpeg, "bgr8; jpeg", START)
        mosaic = np.tile(np.array([[200, 90], [90, 30]], np.uint8), (12, 16))
        png = cv2.imencode(".png", mosaic)[1].tobytes()
        for target in ("", "mono8"):  # to which that of older versions was turned before
            form = f"bayer_rggb8; png compressed {target}"
            yield f"/bayer{target}", START, compressed(store, png, form, START)
        yield "/32FC1", START, image(store, np.ones((24, 32), np.float32), "32FC1", START)
        yield "/late", START, image(store, colours[..., 0], "mono8", START + 9_000_000)
        # P may refer to a third camera, or to the right one
        for side, x, z in (("a", 22.4, 0.005), ("b", -168.0, 0.004), ("c", 0.0, 0.0)):
            p = (350.0, 0, 16, x, 0, 350, 12, 0, 0, 0, 1, z)
            yield f"/{side}/camera_info", START, camera_info(store, START, (32, 24), p)
            yield f"/{side}/rect", START, image(store, colours[..., 0], "mono8", START)

    path = write_bag(tmp_path, "drive", "mcap", make)
    for topic in ("/rgb", "/jpeg/compressed", "/bayer", "/yuv422", "/yuv422_yuy2"):
        (frame,) = package.open_recording(path, left_topic=topic, right_topic="/grey")
        np.testing.assert_array_equal(frame.right, colours[..., 0])
        assert (frame.stamp, frame.disparity) == (START, None)
        assert np.abs(frame.left.astype(int) - colours).max() <= (0 if topic in ("/rgb", "/bayer") else 2)
    (frame,) = package.open_recording(path, left_topic="/bayermono8", right_topic="/grey")
    assert frame.left.shape == (24, 32)
    for right, times_focal in (("/b/rect", 22.4 + 168 - 16 * 0.001), ("/c/rect", 22.4 - 16 * 0.005)):
        (frame,) = package.open_recording(path, left_topic="/a/rect", right_topic=right)
        assert frame.calibration.baseline == pytest.approx(times_focal / 350)
    (frame,) = package.open_recording(path, left_topic="/a/rect", right_topic="/grey")
    assert frame.calibration.baseline is None
    late = {"left_topic": "/rgb", "right_topic": "/late"}
    assert len(list(package.open_recording(path, **late, sync_tolerance=0.01))) == 1
    with pytest.raises(InputError, match="is 31 px wide; pixels of yuv422 come in twos"):
        list(package.open_recording(path, left_topic="/odd/yuv422", right_topic="/grey"))
    with pytest.raises(InputError, match=r"/32FC1@\d+: holds float32; a camera image is uint8 or uint16"):
        list(package.open_recording(path, left_topic="/32FC1", right_topic="/grey"))
    for said, given in (
        ("are within 8 ms", {**late, "sync_tolerance": 0.008}),
        ("left_topic and right_topic are given together", {"left_topic": "/grey"}),
        ("is a bag: give topic, or left_topic and right_topic, and nothing", {**late, "topic": "/32FC1"}),
        ("a sync_tolerance of nan s: give 0 or more", {**late, "sync_tolerance": math.nan}),
        ("encoding and scale are of maps, and these are views", {**late, "encoding": "kitti"}),
    ):
        with pytest.raises(UsageError, match=said):
            list(package.open_recording(path, **given))


def test_the_only_topic_of_maps_is_found_among_others_and_behind_damage(tmp_path):
    values = maps(2)

    def make(store):
        damaged = image(store, values[0], "32FC1", START)
        for number in range(3):
            stamp = START + number * STEP
            yield "/photo", stamp, image(store, np.zeros((120, 160, 3), np.uint8), "bgr8", stamp)
            yield "/photo", stamp + 1, image(store, np.zeros((120, 160, 3), np.uint8), "bgr8", stamp + 1)
            one = image(store, values[1], "32FC1", stamp)
            yield "/maps", stamp, damaged if number == 0 else one

    path = write_bag(tmp_path, "drive", "db3", make)
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute("UPDATE messages SET data = substr(data, 1, 20) WHERE id = 3")
    done = rollcli("estimate", path.name, cwd=tmp_path)
    assert [row["status"] for row in rows(done.out)] == ["error", "ok", "ok"]


@pytest.mark.parametrize("cy", [360.0, 300.0])
def test_one_camera_gives_the_calibration_of_maps_that_state_their_baseline(tmp_path, cy):
    """It sends a region of its image, which need not hold the principal point."""

    p, region = (350.0, 0, 280, 0, 0, 350, cy, *P[7:]), (200, 300, 120, 160)

    def make(store):
        yield "/stereo/left/camera_info", START, camera_info(store, START, (640, 480), p, region=region)
        yield "/stereo/disparity", START, disparity_image(store, maps(1)[0], START, baseline=-0.25)

    path = write_bag(tmp_path, "drive", "mcap", make)
    (frame,) = package.open_recording(path)
    region = Calibration(350, 350, 80, 60, 0.25, 0.0, 160, 120, source=f"CameraInfo of {path}")
    assert frame.calibration == (region if cy == 360 else None)


@pytest.mark.parametrize(
    ("names", "across"), [("ab", (22.4, -168.0)), ("ab", (190.4, 0.0)), (("left", "right"), (0.0, 190.4))]
)
def test_maps_of_cameras_whose_p_refers_to_another_one_have_a_calibration(tmp_path, names, across):
    """Or whose right one has its Tx with the wrong sign, or sees other pixels, as beside aligned depths."""

    def make(store):
        for side, x, zoom in zip(names, across, (1, 1.1), strict=True):
            p = np.multiply((*P[:3], x, *P[4:]), np.repeat([zoom, 1], [8, 4]))
            yield f"/{side}/camera_info", START, camera_info(store, START, (160, 120), p)
        yield "/maps", START, image(store, maps(1)[0], "32FC1", START)

    (frame,) = package.open_recording(write_bag(tmp_path, "drive", "mcap", make))
    assert (frame.calibration.baseline, frame.calibration.doffs) == (pytest.approx(190.4 / 350), 0)


def test_a_bag_of_several_files_is_one_drive(tmp_path):
    """Each has its own messages; raw views of one without a CameraInfo stay raw, which is said."""
    values = maps(2)

    def part(number):
        def make(store):
            stamp = START + number * STEP
            yield "/disparity", stamp, disparity_image(store, values[number], stamp)
            for side, p in (("left", P), ("right", P_RIGHT)):
                view = np.full((120, 160), 40 + number, np.uint8)
                yield f"/{side}/image_raw", stamp, image(store, view, "mono8", stamp)
                if number == 0:
                    k = np.diag([350.0, 350, 1]).ravel()
                    yield f"/{side}/camera_info", stamp, camera_info(store, stamp, (160, 120), p, [1] * 5, k)

        return make

    folder = write_split(tmp_path / "split", part(0), part(1))
    found = rollcli("estimate", "split", "--topic", "/disparity", cwd=tmp_path)
    names = [f"split/split_{each}.mcap#/disparity@{START + each * STEP}" for each in range(2)]
    assert [row["file"] for row in rows(found.out)] == names
    given = ["--left-topic", "/left/image_raw", "--right-topic", "/right/image_raw"]
    said = rollcli("disparity", "split", *given, "-o", "maps", cwd=tmp_path).err
    assert "split/split_1.mcap: has no /left/camera_info: its raw views are taken as they are" in said
    assert "split_0.mcap: has no" not in said
    (folder / "split_2.mcap").touch()  # begun as the power failed
    (folder / "metadata.yaml").unlink()  # which a recorder writes last of all
    for path in ("split", "split/*.mcap"):
        cut = rollcli("estimate", path, "--topic", "/disparity", cwd=tmp_path, status=3)
        *whole, last = rows(cut.out)
        assert [row["file"] for row in whole] == names
        assert (last["file"], last["message"]) == ("split/split_2.mcap#rest", "split/split_2.mcap: is empty")
    read = package.open_recording(folder, topic="/disparity")
    assert [next(read).name for _ in names] == [f"{folder.parent}/{each}" for each in names]
    with pytest.raises(InputError, match=r"split_2.mcap: is empty"):
        next(read)
    (folder / "split_1.mcap").rename(folder / "split_1.mcap.zstd")
    refusal = rollcli("estimate", "split", cwd=tmp_path).refused()
    assert "split/split_1.mcap.zstd: is compressed as a whole; unpack it by zstd -d" in refusal


@pytest.mark.parametrize(
    ("topic", "p"),
    [
        ("/stereo/right/camera_info", (350.0, 0, 90, *P_RIGHT[3:])),
        ("/stereo/down/camera_info", (*P[:6], 20, *P[7:])),
    ],
)
def test_pitch_and_height_of_disparity_images_take_the_left_camera_alone(tmp_path, topic, p):
    """They are x_l - x_r - (cx_l - cx_r); of several cameras it is that of the nearest namespace."""

    def other(store):
        yield from (each for each in drive(2)(store) if each[0] != topic)
        yield topic, START, camera_info(store, START, (160, 120), p)

    paths = [write_bag(tmp_path, name, "mcap", make) for name, make in (("a", drive(2)), ("b", other))]
    whole, found = (rows(rollcli("estimate", path, cwd=tmp_path).out) for path in paths)
    sides = "cam0=[350 0 80; 0 350 60; 0 0 1]\ncam1=[350 0 89; 0 350 60; 0 0 1]"
    (tmp_path / "calib.txt").write_text(f"{sides}\ndoffs=9\nbaseline=500\nwidth=160\nheight=120\n", "utf-16")
    both = paths[:1], [row["file"] for row in whole]
    given = [rows(rollcli("estimate", *each, "--calib", "calib.txt", cwd=tmp_path).out) for each in both]
    for one, *others in zip(whole, found, *given, strict=True):
        for two in others:
            assert (one["pitch_deg"], one["height_m"]) == (two["pitch_deg"], two["height_m"])


def test_a_bag_with_the_camera_info_of_the_right_view_alone_says_so(tmp_path):
    def right(store):
        yield from (each for each in drive(1)(store) if "left" not in each[0])

    done = rollcli("estimate", write_bag(tmp_path, "drive", "mcap", right), cwd=tmp_path)
    assert "no CameraInfo of the left view, but with a negative Tx" in done.err


@pytest.mark.parametrize("given", [(), ("--scale", "-1")])
def test_negative_disparities_with_nan_are_not_below_the_least_one(tmp_path, given):
    def negative(store):
        for number, each in enumerate(maps(2)):
            values = np.where(np.arange(160) < 20, np.nan, -each)
            yield "/d", START + number, disparity_image(store, values, START + number, number, least=1.0)

    found = rows(rollcli("estimate", write_bag(tmp_path, "zed", "mcap", negative), *given, cwd=tmp_path).out)
    if given:
        assert [float(row["roll_deg"]) for row in found] == pytest.approx([0, 1], abs=0.05)
    else:
        assert all("--scale -1" in row["message"] for row in found)


def test_depths_that_are_packed_as_inverses_are_depths(tmp_path):
    """As compressed_depth_image_transport stores 32FC1: a / z + b, in a PNG behind a, b and a format."""
    a, b = 100.0 * 101, 1 - 100.0 * 101 / 50
    camera = ["--focal", "350", "--principal-point", "80,60", "--baseline", "0.5"]

    def make(store):
        for number, each in enumerate(maps(2)):
            depth = np.where(each > 0, 175 / np.maximum(each, 1e-6), np.inf)
            depth[0, 0] = 49.99  # which 1 stands for
            stored = np.where(depth < 50, a / depth + b, 0).round().astype(np.uint16)
            packed = struct.pack("<iff", 0, a, b) + cv2.imencode(".png", stored)[1].tobytes()
            stamp = START + number
            yield "/z", stamp, compressed(store, packed, "32FC1; compressedDepth png", stamp)

    path = write_bag(tmp_path, "depth", "mcap", make)
    given = ["--encoding", "depth", *camera, "--derotated", tmp_path / "up"]
    found = rows(rollcli("estimate", path, *given, cwd=tmp_path).out)
    assert [float(row["roll_deg"]) for row in found] == pytest.approx([0, 1], abs=0.05)
    first, _ = package.open_recording(path, encoding="depth")
    assert first.disparity[0, 0] == pytest.approx(1 / 50, rel=1e-3)
    for number, each in enumerate(maps(2)):
        np.save(tmp_path / f"{number}.npy", each)
    true = rows(rollcli("estimate", "0.npy", "1.npy", *camera, cwd=tmp_path).out)
    for one, other in zip(found, true, strict=True):
        assert float(one["height_m"]) == pytest.approx(float(other["height_m"]), abs=0.005)
    assert np.load(tmp_path / "up" / f"depth_{START}.npy").dtype == np.float32


def test_rows_are_in_the_order_of_stamps_whatever_was_recorded_first(tmp_path):
    """And in whichever of its files."""

    def mixed(*numbers):
        def make(store):
            for number in numbers:
                stamp = START + number * STEP
                yield "/d", stamp, disparity_image(store, maps(4)[number], stamp, number)

        return make

    write_split(tmp_path / "mixed", mixed(3, 0), mixed(2, 1))
    found = rows(rollcli("estimate", "mixed", cwd=tmp_path).out)
    assert [float(row["roll_deg"]) for row in found] == pytest.approx([0, 1, 2, 3], abs=0.1)


def test_a_raw_view_that_is_read_by_its_name_is_rectified_and_a_map_is_not(tmp_path):
    view, d = np.random.default_rng(0).integers(0, 255, (120, 160), np.uint8), (-0.2, 0.0, 0.0, 0.0, 0.0)
    k = (340.0, 0, 82, 0, 340, 58, 0, 0, 1)

    def make(store):
        yield "/l/camera_info", START, camera_info(store, START, (160, 120), P, d, k)
        yield "/l/image_raw", START, image(store, view, "mono8", START)
        png = cv2.imencode(".png", view.astype(np.uint16))[1].tobytes()
        yield "/l/image_raw/compressed", START, compressed(store, png, "16UC1; png compressed ", START)

    name = f"{write_bag(tmp_path, 'raw', 'mcap', make)}#/l/image_raw@{START}"
    seen = np.array(k).reshape(3, 3), np.array(d), np.eye(3), np.array(P).reshape(3, 4)[:, :3]
    where = cv2.initUndistortRectifyMap(*seen, (160, 120), cv2.CV_32FC1)
    expected = cv2.remap(view, *where, cv2.INTER_LINEAR)
    np.testing.assert_array_equal(read_image(name, name), expected)
    depths = name.replace("@", "/compressed@")  # maps are not rectified
    np.testing.assert_array_equal(read_image(depths, depths), view)
    # recorded anew under the same name, in another order
    write_bag(tmp_path, "b", "mcap", lambda store: [*make(store)][::-1]).rename(tmp_path / "raw.mcap")
    np.testing.assert_array_equal(read_image(name, name), expected)
