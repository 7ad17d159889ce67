"""What is wrong with a bag, a topic or a message is one line, and costs no more than it must."""

import contextlib
import sqlite3

import pytest

from tests.files.recordings.bag_files import camera_info, compressed, image, write_bag
from tests.files.recordings.small_bags import mcap
from tests.files.recordings.test_bags import START, STEP, P, drive, maps, rows
from tests.run_cli import rollcli, write_pair


def test_sizes_that_change_within_a_drive_are_told(tmp_path):
    left, right = write_pair(tmp_path, "0.png", maps(1)[0])

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


def test_a_topic_without_messages_is_refused_with_a_line(tmp_path):
    (tmp_path / "drive.mcap").write_bytes(mcap(data=()))
    said = rollcli("estimate", "drive.mcap", "--topic", "/a", cwd=tmp_path).refused()
    assert "drive.mcap: has no messages of /a" in said


def test_frames_of_a_video_in_a_bag_say_what_to_do(tmp_path):
    def make(store):
        yield "/a", START, compressed(store, b"\0\0\0\1\x67" + bytes(20), "h264", START)

    path = write_bag(tmp_path, "drive", "mcap", make).name
    done = rollcli("estimate", path, "--topic", "/a", cwd=tmp_path, status=3)
    assert "export the topic as .mp4, and read the video" in done.out + done.err


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


@pytest.mark.parametrize("every", [1, 2, 3])
def test_every_nth_frame_of_a_bag_that_is_cut_is_followed_by_its_error(tmp_path, every):
    path = write_bag(tmp_path, "cut", "mcap", drive(4))
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 4 // 5])
    done = rollcli("estimate", "cut.mcap", "--every", str(every), cwd=tmp_path)
    assert (done.status, rows(done.out)[-1]["file"]) == (3, "cut.mcap#rest")


def test_messages_that_a_killed_recorder_left_in_its_journal_are_read(tmp_path):
    path = write_bag(tmp_path, "x", "db3", drive(2))
    with contextlib.closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA journal_mode=WAL")
        base.execute(
            "INSERT INTO messages (topic_id, timestamp, data) SELECT topic_id, timestamp, data FROM messages"
        )
        base.commit()
        for ending in ("", "-wal"):  # before the base is closed, which moves them
            (tmp_path / f"killed.db3{ending}").write_bytes((tmp_path / f"x.db3{ending}").read_bytes())
    assert len(rows(rollcli("estimate", "killed.db3", cwd=tmp_path).out)) == 4
