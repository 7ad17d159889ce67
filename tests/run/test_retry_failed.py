"""What failed is done again, on Windows too, and the result is that of a run without failures."""

import os
import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from rollcli.errors import OutputError, UsageError
from rollcli.files.results import format_header, read_result
from rollcli.files.storage import read_bytes, remove, write_bytes
from rollcli.run import batch, result_file
from rollcli.run import result as places
from rollcli.run.result_file import open_result
from tests.object_store import objects_below
from tests.run_cli import (
    contents,
    interrupt_in,
    road_map,
    rollcli,
    started,
    wait_for_files,
    write_kitti,
    write_maps,
)
from tests.slow import mostly_slow

FRAMES = 12


BROKEN = (2, 3, 9)


COUNT = 30


RETRY = ("--resume", "--retry-failed")


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    """Whole maps that nobody changes."""
    folder = tmp_path_factory.mktemp("whole")
    write_maps(folder, FRAMES)
    return folder


@pytest.fixture
def folder(maps, tmp_path):
    """The same maps, some of them broken."""
    shutil.copytree(maps, tmp_path / "maps")
    for index in BROKEN:
        (tmp_path / "maps" / f"frame{index}.png").write_bytes(b"no map")
    return tmp_path


def mend(folder, maps, *indices):
    """Put whole maps in the place of broken ones, newer than any record."""
    for index in indices:
        name = f"frame{index}.png"
        shutil.copyfile(maps / name, folder / "maps" / name)


def assert_is_as_anew(folder, line):
    """What there is must be all that a run makes of these maps, written to the same names."""
    kept = folder / "kept"
    kept.mkdir()
    for path in [each for each in folder.iterdir() if each.name not in ("maps", "kept")]:
        path.rename(kept / path.name)
    assert rollcli(*line, cwd=folder).status == 0
    assert contents(kept) == contents(folder, without=("maps/", "kept/"))


@pytest.mark.parametrize("result", mostly_slow(["rolls.csv", "rolls.jsonl", "rolls.parquet"], "rolls.csv"))
def test_frames_whose_files_were_mended_end_in_the_bytes_of_a_run_without_failures(folder, maps, result):
    line = ("estimate", "maps", "-o", result, "--derotated", "up", "--part-rows", "5")
    assert rollcli(*line, cwd=folder).status == 3
    mend(folder, maps, 2, 9)
    said = rollcli(*line, "--resume", cwd=folder, status=2).err
    assert "frame2.png has changed since; --retry-failed does again what has failed" in said
    once = rollcli(*line, *RETRY, cwd=folder)
    assert (once.status, "(9 kept): 11 ok, 0 suspect, 1 failed" in once.err) == (3, True), once.err
    before = {path: path.stat().st_ino for path in folder.glob("rolls.parquet/*")}
    mend(folder, maps, 3)
    rollcli(*line, *RETRY, cwd=folder, status=0)
    changed = {path.name for path, inode in before.items() if path.stat().st_ino != inode}
    assert changed <= {"part-00000.parquet"}
    assert_is_as_anew(folder, line)


def test_a_retry_that_is_interrupted_keeps_what_it_has_done_and_is_taken_up_again(folder, maps, monkeypatch):
    line = ("estimate", "maps", "-o", "rolls.csv", "--derotated", "up")
    assert rollcli(*line, cwd=folder).status == 3
    mend(folder, maps, *BROKEN)
    with monkeypatch.context() as patch:
        interrupt_in(patch, batch, "do_frame")
        done = rollcli(*line, *RETRY, cwd=folder, status=130)
    assert "interrupted; continue with: rollcli estimate maps" in done.err
    statuses = [row.status for row in read_result(folder / "rolls.csv").rows]
    assert [statuses[index] for index in BROKEN] == ["ok", "error", "error"]
    assert rollcli(*line, *RETRY, cwd=folder).status == 0
    assert_is_as_anew(folder, line)


@pytest.mark.slow
def test_a_retry_killed_at_any_time_loses_no_row_and_is_taken_up_again(tmp_path):
    for index in range(COUNT):
        (tmp_path / "maps").mkdir(exist_ok=True)
        (tmp_path / "maps" / f"frame{index:02}.png").write_bytes(b"no map")
    line = ("estimate", "maps", "-o", "rolls.csv", "--derotated", "up")
    assert rollcli(*line, cwd=tmp_path).status == 3
    for seed, count in ((0, 5), (1, COUNT - 5)):
        for index in range(COUNT):
            disparity = road_map(0.01 * index, width=300, height=200, seed=seed)
            write_kitti(tmp_path / "maps" / f"frame{index:02}.png", disparity)
        run = started(*line, *RETRY, "-j", "2", cwd=tmp_path, stderr=None)
        wait_for_files(tmp_path, "up/[!.]*.png", count, run)
        run.kill()
        run.wait()
        rows = (tmp_path / "rolls.csv").read_text().splitlines()[1:]
        assert [row.split(",")[0] for row in rows] == [f"maps/frame{index:02}.png" for index in range(COUNT)]
    assert rollcli(*line, *RETRY, cwd=tmp_path).status == 0
    assert_is_as_anew(tmp_path, line)


@pytest.mark.parametrize(
    ("result", "flags"), [("rolls.csv", RETRY), ("rolls.csv", ("--update",)), ("rolls.parquet", RETRY)]
)
def test_a_run_that_ends_between_rows_and_what_says_of_their_files_is_taken_up_again(
    folder, maps, monkeypatch, result, flags
):
    line = ("estimate", "maps", "-o", result, "--derotated", "up")
    assert rollcli(*line, cwd=folder).status == 3
    mend(folder, maps, *BROKEN)
    for module, name in ((result_file.ResultFile, "replace"), (places, "write_bytes")):
        done, really = [], getattr(module, name)

        def once(*arguments, done=done, really=really, **words):
            if done:
                raise OutputError("the power is cut")
            done.append(arguments)
            return really(*arguments, **words)

        monkeypatch.setattr(module, name, once)
    assert "the power is cut" in rollcli(*line, *flags, cwd=folder).err
    monkeypatch.undo()
    done = rollcli(*line, *flags, cwd=folder, status=0)
    assert_is_as_anew(folder, line)


def test_a_link_to_a_result_stays_one_and_its_file_keeps_its_rights(folder, maps):
    (folder / "elsewhere").mkdir()
    (folder / "rolls.csv").symlink_to("elsewhere/rows.csv")
    line = ("estimate", "maps", "-o", "rolls.csv")
    assert rollcli(*line, cwd=folder).status == 3
    (folder / "elsewhere" / "rows.csv").chmod(0o640)
    mend(folder, maps, *BROKEN)
    assert rollcli(*line, *RETRY, cwd=folder).status == 0
    assert (folder / "rolls.csv").is_symlink()
    assert (folder / "elsewhere" / "rows.csv").stat().st_mode & 0o777 == 0o640
    assert b"error" not in (folder / "rolls.csv").read_bytes()


@pytest.fixture(params=mostly_slow(["rolls.csv", "rolls.parquet", "bucket"], "rolls.csv"))
def stopped(request, folder, maps, monkeypatch):
    """A folder, and the line of a run whose retry made images and could not write their rows."""
    place = f"{request.getfixturevalue('bucket')}/" if request.param == "bucket" else ""
    result = "rolls.csv" if place else request.param
    line = ("estimate", "maps", "-o", place + result, "--derotated", f"{place}up", "--part-rows", "5")
    assert rollcli(*line, cwd=folder).status == 3
    mend(folder, maps, *BROKEN)
    full = Mock(side_effect=OutputError("the disk is full"))
    with monkeypatch.context() as patch:
        patch.setattr("rollcli.run.result_file.ResultFile.replace", full)
        patch.setattr("rollcli.run.result.write_bytes", full)
        done = rollcli(*line, *RETRY, cwd=folder)
    assert (done.status, "the disk is full" in done.err) == (1, True)
    return folder, place or f"{folder}/", line


def test_frames_that_are_mended_again_after_a_stopped_retry_get_the_images_of_their_last_files(stopped):
    folder, place, line = stopped
    for index in BROKEN[:2]:
        write_kitti(folder / "maps" / f"frame{index}.png", road_map(0.2, seed=50 + index))
    (folder / "maps" / f"frame{BROKEN[2]}.png").write_bytes(b"broken again")
    spelled_whole = [f"{folder}/{each}" if each.startswith("rolls.") else each for each in line]
    assert rollcli(*spelled_whole, *RETRY, cwd=folder).status == 3
    retried = everything(place)
    assert f"up/frame{BROKEN[2]}.png" not in retried
    assert rollcli(*line, "--overwrite", cwd=folder).status == 3
    assert everything(place) == retried


def test_an_image_that_took_the_place_of_one_of_a_stopped_retry_is_kept(stopped):
    folder, place, line = stopped
    write_bytes(f"{place}up/frame2.png", b"precious")
    done = rollcli(*line, *RETRY, cwd=folder)
    assert (done.status, "up/frame2.png: exists already and is not of this run" in done.err) == (1, True)
    assert read_bytes(f"{place}up/frame2.png") == b"precious"
    remove(f"{place}up/frame2.png")
    assert rollcli(*line, *RETRY, cwd=folder).status == 0
    retried = everything(place)
    assert rollcli(*line, "--overwrite", cwd=folder).status == 0
    assert everything(place) == retried


def everything(place):
    """What lies in a folder or below a prefix, apart from maps, by its name."""
    if place.startswith("s3://"):
        return objects_below(place.rstrip("/"))
    return contents(Path(place), without="maps/")


HEADER = format_header("csv")


@pytest.fixture
def path(tmp_path, monkeypatch):
    """A result of three rows, on a system that behaves like Windows."""
    path = tmp_path / "rolls.csv"
    path.write_bytes(HEADER + b"a\nb\nc\n")
    replace = Path.replace

    def only_closed(self, target):
        if Path(target) == path and any(same(link, path) for link in Path("/proc/self/fd").iterdir()):
            raise PermissionError(13, "The process cannot access the file")
        return replace(self, target)

    monkeypatch.setattr(result_file, "_ON_WINDOWS", True)
    monkeypatch.setattr(Path, "replace", only_closed)
    return path


def same(link, path):
    try:
        return os.path.samestat(link.stat(), path.stat())
    except OSError:
        return False


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs /proc, which lists open files")
def test_rows_are_replaced_and_the_result_stays_locked_and_grows(path):
    with open_result(str(path)) as file:
        file.replace({1: b"B\n"}, "csv")
        assert path.read_bytes() == HEADER + b"a\nB\nc\n"
        with pytest.raises(UsageError, match="another run is writing"), open_result(str(path)):
            pass
        file.replace({0: b"A\n"}, "csv")
        file.append(b"d\n")
    assert path.read_bytes() == HEADER + b"A\nB\nc\nd\n"
    assert [each.name for each in path.parent.iterdir()] == ["rolls.csv"]
