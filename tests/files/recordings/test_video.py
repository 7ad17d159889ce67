"""Videos, and images that hold both views, give the rolls of the same frames from files."""

import json
import math
import os
import re
import struct
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

import rollcli as package
from rollcli.errors import InputError, UsageError
from rollcli.files.formats import read_image
from tests.binary_files import png_chunk
from tests.run_cli import keep_rows, road_map, rollcli, write_pair
from tests.run_cli import rows_of as rows
from tests.slow import mostly_slow

# FFmpeg asks for this once in a process, here for the videos that are written
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# lossless, so that frames are those of the files
LOSSLESS = {"drive.avi": "FFV1", "drive.mkv": "FFV1", "drive.mov": "png ", "drive.mp4": "FFV1"}
COUNT = 5


def write_video(path, frames, codec=None):
    height, width = frames[0].shape[:2]
    fourcc = cv2.VideoWriter_fourcc(*(codec or LOSSLESS[path.name]))
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, 10, (width, height))
    if not writer.isOpened():
        pytest.skip(f"this OpenCV writes no {path.name}")
    for each in frames:
        writer.write(each if each.ndim == 3 else cv2.cvtColor(each, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def packets_of(path):
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_FORMAT, -1])
    return [capture.retrieve()[1].tobytes() for _ in iter(capture.grab, False)]


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A folder with left/ and right/, the rows of these pairs, and the views."""
    folder = tmp_path_factory.mktemp("drive")
    rolls = [math.radians(number - 2) for number in range(COUNT)]
    pairs = [write_pair(folder, f"{at}.png", road_map(roll), seed=at) for at, roll in enumerate(rolls)]
    views = [[cv2.cvtColor(each, cv2.COLOR_GRAY2BGR) for each in pair] for pair in pairs]
    done = rollcli("estimate", "--left", "left", "--right", "right", cwd=folder, status=0)
    return folder, rows(done.out), views


def without_names(found):
    return [{key: each for key, each in row.items() if key not in ("file", "right_file")} for row in found]


def padded(png, size):
    """The same PNG, as long as is asked, by a chunk of text."""
    return png[:-12] + png_chunk(b"tEXt", b"a" * (size - len(png) - 12)) + png[-12:]


def beside(views):
    return [np.hstack(each) for each in views]


@pytest.mark.parametrize("name", mostly_slow(LOSSLESS, "drive.avi"))
def test_a_video_gives_the_rows_of_the_same_pairs_in_files(tmp_path, drive, name):
    _, expected, views = drive
    write_video(tmp_path / name, beside(views))
    one = rollcli("estimate", "--side-by-side", name, "--disparity", "maps", cwd=tmp_path)
    assert (one.status, without_names(rows(one.out))) == (0, without_names(expected)), one.err
    two = rollcli("estimate", name, "--side-by-side", "-j", "2", cwd=tmp_path)
    assert two.out == one.out
    names = [f"{name}#{each:06d}" for each in range(COUNT)]
    assert [row["file"] for row in rows(one.out)] == names
    assert [row["right_file"] for row in rows(one.out)] == names
    made = [f"drive_{each:06d}.png" for each in range(COUNT)]
    assert sorted(each.name for each in (tmp_path / "maps").iterdir()) == made
    rollcli("disparity", name, "--side-by-side=left-right", "-o", "again", cwd=tmp_path, status=0)
    for each in made:
        assert (tmp_path / "maps" / each).read_bytes() == (tmp_path / "again" / each).read_bytes()
    every = rollcli("estimate", name, "--side-by-side", "--every", "2", cwd=tmp_path)
    assert rows(every.out) == rows(one.out)[::2]
    alone = rollcli("estimate", names[3], "--side-by-side", cwd=tmp_path)
    assert rows(alone.out) == [rows(one.out)[3]]
    listed = rollcli("estimate", name, "--side-by-side", "--dry-run", "--derotated", "up", cwd=tmp_path)
    assert listed.out.splitlines()[:2] == [f"read  {names[0]}", "write up/drive_000000.png"]


@pytest.mark.slow
def test_two_videos_are_paired_by_the_numbers_of_their_frames(tmp_path, drive):
    _, expected, views = drive
    for side, name in enumerate(("a.avi", "b.avi")):
        write_video(tmp_path / name, [each[side] for each in views], "FFV1")
    pair = ("--left", "a.avi", "--right", "b.avi")
    done = rollcli("estimate", *pair, "-j", "2", cwd=tmp_path)
    assert (done.status, without_names(rows(done.out))) == (0, without_names(expected)), done.err
    assert [rows(done.out)[4][key] for key in ("file", "right_file")] == ["a.avi#000004", "b.avi#000004"]
    write_video(tmp_path / "b.avi", [each[1] for each in views[1:]], "FFV1")
    refusal = rollcli("estimate", *pair, cwd=tmp_path).refused()
    assert "a.avi has 5 frames, b.avi 4" in refusal
    write_video(tmp_path / "b.avi", [each[1][:, 2:] for each in views], "FFV1")
    refusal = rollcli("disparity", *pair, "-o", "maps", cwd=tmp_path).refused()
    assert "give two views of one size" in refusal


@pytest.mark.parametrize(("layout", "join"), [("left-right", np.hstack), ("top-bottom", np.vstack)])
def test_images_side_by_side_give_the_same_rows_as_their_halves(tmp_path, drive, layout, join):
    _, expected, views = drive
    (tmp_path / "both").mkdir()
    for number, each in enumerate(views):
        cv2.imwrite(str(tmp_path / "both" / f"{number}.png"), join(each))
    done = rollcli("estimate", "both", "--side-by-side", layout, cwd=tmp_path)
    assert (done.status, without_names(rows(done.out))) == (0, without_names(expected)), done.err
    odd = join(views[1])
    cv2.imwrite(str(tmp_path / "both" / "1.png"), odd[:-1, :-1])
    mixed = rollcli("estimate", "both", "--side-by-side", layout, cwd=tmp_path)
    found = rows(mixed.out)
    assert (mixed.status, [row["status"] for row in found].count("error")) == (3, 1)
    assert "cannot be halved into two views" in found[1]["message"]


@pytest.mark.slow
def test_the_correction_of_views_side_by_side_is_that_of_their_files(tmp_path):
    (tmp_path / "both").mkdir()
    for number in range(8):
        disparity = road_map(0.01 * number, width=320, height=200)
        views = write_pair(tmp_path, f"{number}.png", disparity, seed=number)
        cv2.imwrite(str(tmp_path / "both" / f"{number}.png"), np.hstack(views))
    for name, given in {"a": ["--left", "left", "--right", "right"], "b": ["both", "--side-by-side"]}.items():
        assert rollcli("estimate", *given, "-o", f"{name}.csv", cwd=tmp_path).status == 0
        rollcli("rig", f"{name}.csv", "--correction", f"{name}.json", cwd=tmp_path, status=0)
    correction = (tmp_path / "a.json").read_bytes()
    assert json.loads(correction)["columns"] is not None
    assert (tmp_path / "b.json").read_bytes() == correction


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive.avi", "drive.mkv"])
def test_a_video_that_is_cut_gives_every_whole_frame_and_a_line(tmp_path, drive, name):
    path = write_video(tmp_path / name, beside(drive[2]), "MJPG")
    whole = rows(rollcli("estimate", name, "--side-by-side", cwd=tmp_path).out)
    data = path.read_bytes()
    ends = [data.index(packet.rstrip(b"\0")) + len(packet) for packet in packets_of(path)]
    for tenth in range(1, 10):
        cut = len(data) * tenth // 10
        path.write_bytes(data[:cut])
        done = rollcli("estimate", name, "--side-by-side", cwd=tmp_path)
        there = sum(end <= cut for end in ends)
        if not there:
            assert (done.status, done.err.count("\n")) == (2, 1), done.err
            assert "is cut off" in done.err
            continue
        found = rows(done.out)
        assert (done.status, len(found), found[:-1]) == (3, there + 1, whole[:there]), done.err
        assert (found[-1]["file"], found[-1]["status"]) == (f"{name}#rest", "error")
        assert "is cut off" in found[-1]["message"]


@pytest.mark.parametrize("name", ["drive.mp4", "drive.mov"])
def test_a_video_whose_index_is_cut_off_is_refused_with_a_line_and_costs_no_other(tmp_path, drive, name):
    path = write_video(tmp_path / name, beside(drive[2]))
    data = path.read_bytes()
    for tenth in range(1, 10):
        path.write_bytes(data[: len(data) * tenth // 10])
        refusal = rollcli("estimate", name, "--side-by-side", cwd=tmp_path).refused()
        assert f"{name}: cannot be opened: it is cut off" in refusal
    write_video(tmp_path / "whole.avi", beside(drive[2]), "MJPG")
    first, *others = rows(rollcli("estimate", ".", "--side-by-side", cwd=tmp_path, status=3).out)
    assert (first["file"], first["message"].startswith(f"{name}: cannot be opened")) == (f"{name}#rest", True)
    assert [row["file"] for row in others] == [f"whole.avi#{each:06d}" for each in range(COUNT)]


def test_a_video_that_was_cut_by_its_edit_list_has_the_frames_that_it_shows(tmp_path, drive):
    path = write_video(tmp_path / "drive.mp4", beside(drive[2]), "mp4v")
    whole = rows(rollcli("estimate", "drive.mp4", "--side-by-side", cwd=tmp_path).out)
    data = bytearray(path.read_bytes())
    at = data.index(b"elst") + 12  # behind version, flags and the number of entries
    (duration,) = struct.unpack_from(">I", data, at)
    struct.pack_into(">I", data, at, duration * 3 // COUNT)
    path.write_bytes(data)
    done = rollcli("estimate", "drive.mp4", "--side-by-side", cwd=tmp_path)
    assert (done.status, rows(done.out)) == (0, whole[: len(rows(done.out))]), done.err
    capture, shown = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG), 0
    while capture.read()[0]:
        shown += 1
    assert (len(rows(done.out)), shown < COUNT) == (shown, True)


@pytest.mark.slow
def test_a_pair_of_videos_of_which_one_is_cut_off_uses_what_both_have(tmp_path, drive):
    for side, name in enumerate(("a.avi", "b.avi")):
        write_video(tmp_path / name, [each[side] for each in drive[2]], "FFV1")
    whole = rows(rollcli("estimate", "--left", "a.avi", "--right", "b.avi", cwd=tmp_path).out)
    data = (tmp_path / "b.avi").read_bytes()
    (tmp_path / "b.avi").write_bytes(data[: len(data) * 7 // 10])
    done = rollcli("estimate", "--left", "a.avi", "--right", "b.avi", cwd=tmp_path)
    found = rows(done.out)
    assert (done.status, found[:-1]) == (3, whole[: len(found) - 1])
    assert len(found) >= 3
    assert (found[-1]["file"], "is cut off" in found[-1]["message"]) == ("b.avi#rest", True)
    (tmp_path / "each").mkdir()  # the mask and the calibration of each whole frame
    for number in range(len(found) - 1):
        cv2.imwrite(str(tmp_path / "each" / f"a_{number:06d}.png"), np.ones((120, 160), np.uint8))
        (tmp_path / "each" / f"a_{number:06d}").write_text("cam0=[175 0 80; 0 175 60; 0 0 1]\nbaseline=500")
    for given in ("--mask=each", "--calib=each"):
        again = rollcli("estimate", "--left", "a.avi", "--right", "b.avi", given, cwd=tmp_path)
        assert (again.status, len(rows(again.out)), rows(again.out)[-1]) == (3, len(found), found[-1])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive.mkv", "drive.mp4"])
def test_an_interrupted_run_over_a_video_is_resumed_to_the_same_bytes(tmp_path, drive, name):
    path = write_video(tmp_path / name, beside(drive[2]), "MJPG")
    damaged = packets_of(path)[1].rstrip(b"\0")  # gives no frame: one behind it takes its number
    path.write_bytes(path.read_bytes().replace(damaged, bytes(len(damaged))))
    given = ["estimate", name, "--side-by-side", "-o", "rolls.csv"]
    assert rollcli(*given, "-j", "1", cwd=tmp_path).status == 3
    inputs = (tmp_path / "rolls.csv.inputs").read_bytes()
    whole = keep_rows(tmp_path / "rolls.csv", 2)
    assert [row["status"] == "error" for row in rows(whole.decode())] == [False] * (COUNT - 1) + [True]
    refusal = rollcli(*given[:3], "top-bottom", *given[3:], "--resume", cwd=tmp_path).refused()
    assert "side-by-side" in refusal
    assert rollcli(*given, "--resume", "-j", "3", cwd=tmp_path).status == 3
    assert (tmp_path / "rolls.csv").read_bytes() == whole
    assert (tmp_path / "rolls.csv.inputs").read_bytes() == inputs


@pytest.mark.slow
def test_a_result_of_a_video_goes_on_to_the_other_commands(tmp_path, drive):
    write_video(tmp_path / "drive.mkv", beside(drive[2]))
    line = ("estimate", "drive.mkv", "--side-by-side", "-o", "rolls.csv", "--disparity", "maps")
    rollcli(*line, cwd=tmp_path, status=0)
    for given in (
        ["derotate", "maps", "--from", "rolls.csv", "-o", "upright"],
        ["heights", "maps", "--from", "rolls.csv", "-o", "heights"],
        ["vdisparity", "maps", "-o", "counted"],
        ["report", "rolls.csv", "-o", "page.html"],
        ["report", "rolls.csv", "-o", "again.html", "--images", "maps"],
        ["rig", "rolls.csv"],
    ):
        rollcli(*given, cwd=tmp_path, status=0)
    assert (tmp_path / "upright" / "drive_000003.png").is_file()
    elsewhere = rollcli("report", "../rolls.csv", "-o", "page.html", cwd=tmp_path / "maps")
    assert (elsewhere.status, "pictures of 5 frames" in elsewhere.err) == (0, True), elsewhere.err
    for name in ("derotate", "vdisparity", "heights"):
        further = ["--from", "rolls.csv"] if name != "vdisparity" else []
        refusal = rollcli(name, "drive.mkv", *further, "-o", "none", cwd=tmp_path).refused()
        assert "drive.mkv: is a video, of views and not of maps" in refusal


def test_what_is_no_usable_video_is_told_in_a_line(tmp_path, drive):
    frames = beside(drive[2])
    write_video(tmp_path / "drive.mkv", frames)
    odd = write_video(tmp_path / "odd.avi", frames, "png ")  # the writer makes widths even
    smaller = cv2.imencode(".png", frames[0][:, :101])[1].tobytes()
    larger = re.compile(rb"\x89PNG.*?IEND....", re.DOTALL)
    odd.write_bytes(larger.sub(lambda found: padded(smaller, len(found[0])), odd.read_bytes()))
    write_video(tmp_path / "narrow.mkv", [cv2.resize(each, (160, 120)) for each in frames], "FFV1")
    (tmp_path / "noise.mp4").write_bytes(np.random.default_rng(0).bytes(5000))
    (tmp_path / "header.mp4").write_bytes(b"\0\0\0\x18ftypisom" + np.random.default_rng(0).bytes(5000))
    (tmp_path / "list.mp4").write_text("#EXTM3U\nhttp://127.0.0.1:9/a.ts\n")
    (tmp_path / "empty.mp4").write_bytes(b"")
    camera = ["--focal", "175", "--principal-point"]
    for given, expected in (
        (["drive.mkv"], "drive.mkv: is a video, of views and not of maps: give --side-by-side"),
        (["--left", "drive.mkv"], "--left and --right are given together"),
        (["--side-by-side"], "name pairs in one way"),
        (["drive.mkv", "--side-by-side", "--left", "a", "--right", "b"], "name pairs in one way"),
        (["odd.avi", "--side-by-side"], "odd.avi: is 101 px wide, which cannot be halved"),
        (["gone.png", "narrow.mkv", "--side-by-side"], ": its views would be 80x120 px, higher than wide"),
        (["narrow.mkv", "--side-by-side", *camera, "79,60"], ": its views would be 80x120 px"),
        (["noise.mp4", "--side-by-side"], "noise.mp4: is no MP4, MOV, AVI or Matroska file"),
        (["header.mp4", "--side-by-side"], "header.mp4: cannot be opened"),
        (["list.mp4", "--side-by-side"], "list.mp4: is no MP4, MOV, AVI or Matroska file"),
        (["empty.mp4", "--side-by-side"], "empty.mp4: is no MP4"),
        (["none.mp4", "--side-by-side"], "none.mp4: no such file"),
        (["s3://bucket/a.mp4", "--side-by-side"], "recordings are read from local disk: download it first"),
    ):
        done = rollcli("estimate", *given, cwd=tmp_path)
        assert (done.status, done.out, done.err.count("\n")) == (2, "", 1), (given, done.err)
        assert expected in done.err, done.err
    done = rollcli("estimate", "narrow.mkv", "odd.avi", "--side-by-side", *camera, "40,60", cwd=tmp_path)
    assert len(rows(done.out)) == COUNT + 1, done.err
    assert "odd.avi#rest: has frames of 101x120 px, which cannot be halved into two views" in done.err


def test_python_iterates_the_frames_of_a_video(tmp_path, drive):
    path = write_video(tmp_path / "drive.mkv", beside(drive[2]))
    with ThreadPoolExecutor(2) as pool:
        found, other = pool.map(list, [package.open_recording(path, side_by_side="left-right") for _ in "ab"])
    assert "OPENCV_FFMPEG_CAPTURE_OPTIONS" not in os.environ  # which other videos are opened by
    assert [each.name for each in found] == [f"{path}#{each:06d}" for each in range(COUNT)]
    for side, name in enumerate(("a.avi", "b.avi")):
        write_video(tmp_path / name, [each[side] for each in drive[2]], "FFV1")
    for frames in (found, other, package.open_recording(tmp_path / "a.avi", right=tmp_path / "b.avi")):
        np.testing.assert_array_equal([(each.left, each.right) for each in frames], drive[2])
    for topic, said in ((None, "is a video: give side_by_side"), ("/maps", "is a video, and has no topics")):
        with pytest.raises(UsageError, match=said):
            list(package.open_recording(path, topic=topic))
    for elsewhere in ("s3://bucket/a.avi", "s3://bucket/a.mcap"):
        with pytest.raises(UsageError, match="recordings are read from local disk: download it first"):
            list(package.open_recording(elsewhere, side_by_side="left-right"))
    path.write_bytes(path.read_bytes()[:-20_000])
    with pytest.raises(InputError, match="is cut off"):
        list(package.open_recording(path, side_by_side="left-right"))


def longer(data):
    """An MP4 whose largest box says its length in 64 bits, where FFmpeg leaves eight bytes for them."""
    at = data.index(b"\0\0\0\x08free")
    (length,) = struct.unpack_from(">I", data, at + 8)
    return data[:at] + struct.pack(">I4sQ", 1, b"mdat", length + 8) + data[at + 16 :]


def to_the_end(data):
    """An MP4 whose last box reaches to the end of the file, however long that is."""
    at = data.index(b"moov") - 4
    return data[:at] + bytes(4) + data[at + 4 :]


def of_no_length(data):
    """A Matroska file as one writes it that cannot go back to the beginning: its segment has no length."""
    at = data.index(SEGMENT) + 4
    return data[:at] + b"\x01" + b"\xff" * 7 + data[at + 8 :]


def of_no_lengths(data):
    """The same, and its frames, too."""
    at = data.index(CLUSTER) + 4
    (length,) = struct.unpack_from(">H", data, at)  # two bytes, of which the first bits say so
    assert length >> 14 == 1
    return of_no_length(data[:at] + b"\x7f\xff" + data[at + 2 :])


SEGMENT, CLUSTER = b"\x18\x53\x80\x67", b"\x1f\x43\xb6\x75"


@pytest.mark.parametrize(
    ("name", "codec", "change", "broken"),
    [
        ("drive.mp4", "mp4v", longer, False),
        ("drive.mp4", "mp4v", to_the_end, False),
        ("drive.mp4", "mp4v", lambda data: data.replace(b"elst", b"skip"), False),
        ("drive.avi", "MJPG", lambda data: data + b"what a recorder notes behind it", False),
        ("drive.mkv", "MJPG", of_no_length, False),
        ("drive.mkv", "MJPG", of_no_lengths, True),
        ("drive.mkv", "MJPG", lambda data: data + SEGMENT, True),
    ],
)
def test_lengths_that_a_video_says_in_other_ways_say_the_same(tmp_path, name, codec, change, broken):
    frames = [np.full((48, 128, 3), 40 * each, np.uint8) for each in range(3)]
    path = write_video(tmp_path / name, frames, codec)
    found = list(package.open_recording(path, side_by_side="left-right"))
    path.write_bytes(change(path.read_bytes()))
    again = package.open_recording(path, side_by_side="left-right")
    np.testing.assert_array_equal([next(again).left for _ in found], [each.left for each in found])
    if broken:
        with pytest.raises(InputError, match=r"drive.mkv#rest: is cut off"):
            next(again)
    assert (len(found), next(again, None)) == (3, None)


def test_frames_of_a_video_are_read_in_any_order_and_others_are_errors(tmp_path, drive):
    views = beside(drive[2])
    write_video(tmp_path / "drive.mkv", views).rename(tmp_path / "drive.webm")
    for number in (3, 0, 0, 4):
        np.testing.assert_array_equal(read_image(tmp_path / f"drive.webm#{number:06d}"), views[number])
    expected = {
        "drive.webm#000001": "",
        "drive.webm#000099": "no such frame: drive.webm has 5 that can be decoded",
        "drive.webm#one": "no such frame in drive.webm",
        "drive.webm#rest": "is whole; the whole frames before are used",
    }
    done = rollcli("estimate", *expected, "--side-by-side", cwd=tmp_path)
    assert (done.status, {row["file"]: row["message"] for row in rows(done.out)}) == (3, expected)
