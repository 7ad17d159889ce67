"""A result is updated to the bytes of a run on the inputs as they are; identical bytes count as unchanged."""

import os
from unittest.mock import Mock

import pytest

from rollcli.files.storage import read_bytes, remove, write_bytes
from rollcli.run import result_file
from tests.object_store import objects_below, upload
from tests.run_cli import contents, estimated, road_map, rollcli, write_kitti, write_maps
from tests.slow import mostly_slow

FRAMES = 8
IMAGES = ("--derotated", "up")


def estimate(folder, *arguments, status=0, result="rolls.csv", inputs=("maps",)):
    return rollcli("estimate", *inputs, "-o", result, *arguments, cwd=folder, status=status)


def put(folder, *names, roll=0.1):
    for name in names:
        write_kitti(folder / "maps" / f"{name}.png", road_map(roll, seed=len(name)))


def touch(folder):
    """Give every map another time, as a checkout or a cache does."""
    for number, path in enumerate((folder / "maps").iterdir()):
        os.utime(path, ns=(0, 10**9 * (number + 2**31)))


def inodes(folder):
    return {path.name: path.stat().st_ino for path in (folder / "up").iterdir()}


@pytest.fixture
def folder(tmp_path):
    """A whole result of a few maps, with an image each."""
    return estimated(tmp_path, FRAMES, *IMAGES, broken={3: b"no map"})


def anew(folder, tmp_path_factory, result):
    """What a run makes of the maps as they are now."""
    other = tmp_path_factory.mktemp("anew")
    (other / "maps").symlink_to(folder / "maps")
    estimate(other, *IMAGES, status=3, result=result)
    return contents(other, without="maps")


@pytest.mark.parametrize("form", mostly_slow(["csv", "parquet"], "csv"))
def test_a_resume_of_parts_takes_identical_bytes_with_other_times_and_no_others(folder, request, form):
    place = str(folder / "parts") if form == "parquet" else request.getfixturevalue("bucket")

    def everything(name, less=""):
        return objects_below(f"{place}/{name}.{form}{less}")

    line = {"result": f"{place}/rolls.{form}", "status": 3}
    estimate(folder, "--part-rows", "3", **line)
    whole = everything("rolls")
    remove(f"{place}/rolls.{form}/part-00001.{form}")
    touch(folder)
    done = estimate(folder, "--part-rows", "3", "--resume", **line)
    assert "(5 kept)" in done.err
    assert everything("rolls") == whole
    estimate(folder, "--part-rows", "3", result=f"{place}/anew.{form}", status=3)
    assert everything("rolls", ".inputs") == everything("anew", ".inputs")
    remove(f"{place}/rolls.{form}/part-00001.{form}")
    put(folder, "frame4", roll=0.3)  # has no row
    estimate(folder, "--part-rows", "3", "--resume", **line)
    put(folder, "frame1", roll=0.3)
    line["status"] = 2
    said = estimate(folder, "--part-rows", "3", "--resume", **line).err
    assert "maps/frame1.png has changed since; --overwrite starts anew" in said
    lines = f"{place}/rolls.{form}.inputs/part-00001.inputs"
    write_bytes(lines, read_bytes(lines)[:-60])
    assert "part-00001.inputs: is damaged" in estimate(folder, "--part-rows", "3", "--resume", **line).err
    remove(lines)
    assert "part-00001.inputs: " in estimate(folder, "--part-rows", "3", "--resume", **line).err


@pytest.mark.parametrize("result", ["rolls.csv", "rolls.jsonl"])
@pytest.mark.parametrize("jobs", mostly_slow(["1", "2"], "1"))
def test_an_update_does_what_has_changed_and_nothing_else(folder, tmp_path_factory, result, jobs):
    arguments = (*IMAGES, "-j", jobs)
    if result != "rolls.csv":
        estimate(folder, *arguments, "--overwrite", status=3, result=result)
    before, rows = inodes(folder), (folder / result).read_bytes().splitlines()
    touch(folder)
    put(folder, "frame5", "frame0", roll=-0.2)
    done = estimate(folder, *arguments, "--update", status=3, result=result)
    assert "done again, since what they were made from has changed: 2" in done.err
    assert "(6 kept)" in done.err
    fresh = anew(folder, tmp_path_factory, result)
    assert {name: data for name, data in contents(folder).items() if name in fresh} == fresh
    assert {name for name, inode in inodes(folder).items() if before[name] != inode} == {
        "frame0.png",
        "frame5.png",
    }
    after = (folder / result).read_bytes().splitlines()
    assert sum(old != new for old, new in zip(rows, after, strict=True)) == 2


def test_a_frame_without_a_row_of_its_own_stands_as_an_error_until_it_is_done(folder, monkeypatch):
    put(folder, "frame0a")
    put(folder, "frame1", roll=0.3)
    with monkeypatch.context() as patch:
        patch.setattr("rollcli.run.estimate.run_joined", Mock(side_effect=KeyboardInterrupt))
        estimate(folder, *IMAGES, "--update", status=3)
    rows = (folder / "rolls.csv").read_text().splitlines()
    assert rows[2].startswith("maps/frame0a.png,,error")
    assert "not estimated yet" in rows[2]
    said = estimate(folder, *IMAGES, "--resume", status=2).err
    assert "maps/frame1.png has changed since; --update does" in said
    put(folder, "frame1", roll=0.1)
    write_maps(folder / "maps", 2)
    estimate(folder, *IMAGES, "--resume", status=3)
    assert "not estimated yet" not in (folder / "rolls.csv").read_text()


def test_objects_are_compared_by_their_tags(tmp_path, bucket, monkeypatch):
    write_maps(tmp_path / "maps", 4)
    folder = f"{bucket}/update"
    upload(tmp_path / "maps", folder)
    line = {"inputs": (folder + "/",)}
    estimate(tmp_path, **line)
    put(tmp_path, "frame2")
    write_bytes(f"{folder}/frame2.png", (tmp_path / "maps" / "frame2.png").read_bytes())
    read = []
    really = result_file._read
    monkeypatch.setattr(
        result_file, "_read", lambda paths: really(read.append(path) or path for path in paths)
    )
    assert "(3 kept)" in estimate(tmp_path, "--update", **line).err
    assert read == [f"{folder}/frame2.png"]
