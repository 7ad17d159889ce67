"""The images that `estimate` writes: their names, what they never replace, and the later of two runs."""

import os
from importlib import import_module

import cv2
import numpy as np
import pytest

from tests.report.results import row, write_result
from tests.run_cli import contents, road_map, rollcli, write_kitti, write_maps, write_pair

FRAMES = 2


def names(folder):
    return sorted(contents(folder))


def test_images_keep_the_folders_and_the_format_of_their_input(tmp_path):
    write_kitti(tmp_path / "maps" / "day" / "a.png", road_map(0.1))
    np.save(tmp_path / "maps" / "b.npy", road_map(0.1))
    images = ("--derotated", "up", "--vdisparity", "v", "--road-mask", "road")
    assert rollcli("estimate", "maps", "--recursive", *images, cwd=tmp_path).status == 0
    assert names(tmp_path / "up") == ["b.npy", "day/a.png"]
    assert names(tmp_path / "v") == names(tmp_path / "road") == ["b.png", "day/a.png"]
    data = np.frombuffer((tmp_path / "up" / "day" / "a.png").read_bytes(), np.uint8)
    upright = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    assert (upright.dtype, upright.shape) == (np.uint16, (120, 160))
    assert np.load(tmp_path / "up" / "b.npy").dtype == np.float32


@pytest.mark.parametrize(("kind", "ending"), [("png", ".png"), ("tiff", ".tif"), ("npy", ".npy")])
def test_the_maps_of_pairs_are_saved_in_the_chosen_format(tmp_path, kind, ending):
    write_pair(tmp_path, "a.png", road_map(0.05, width=320, height=160) / 2)
    pair = ("--left", "left", "--right", "right", "--num-disparities", "48")
    images = ("--disparity", "maps", "--derotated", "up", "--save-as", kind)
    done = rollcli("estimate", *pair, *images, cwd=tmp_path)
    assert done.status == 0, done.err
    assert names(tmp_path / "maps") == names(tmp_path / "up") == [f"a{ending}"]
    row, again = done.out.splitlines()[1], rollcli("estimate", "maps", cwd=tmp_path).out.splitlines()[1]
    assert row.startswith("left/a.png,right/a.png,ok,")
    assert float(again.split(",")[3]) == pytest.approx(float(row.split(",")[3]), abs=0.01)


def refused(folder, *arguments):
    """The one line of a usage error; nothing was written."""
    before = contents(folder)
    done = rollcli("estimate", *arguments, cwd=folder)
    assert (done.status, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert contents(folder) == before
    return done.err


def test_two_frames_with_one_image_are_refused_before_anything_runs(tmp_path):
    write_maps(tmp_path / "maps", 1)
    np.save(tmp_path / "maps" / "frame0.npy", road_map())
    line = refused(tmp_path, "maps", "--vdisparity", "v")
    assert "maps/frame0.npy and maps/frame0.png would both write v/frame0.png" in line
    assert rollcli("estimate", "maps", "--derotated", "up", cwd=tmp_path).status == 0
    write_maps(tmp_path / "more", 1)
    line = refused(tmp_path, "maps/frame0.png", "more/frame0.png", "--derotated", "down")
    assert "name their common folder with --recursive" in line


def test_no_output_replaces_an_input(maps):
    assert "would be replaced" in refused(maps, "maps/*.png", "--derotated", "maps/../maps", "--overwrite")
    assert "would be replaced" in refused(maps, "maps", "-o", "maps/frame0.png", "--overwrite")
    (maps / "mask.png").write_bytes((maps / "maps" / "frame0.png").read_bytes())
    assert "would be replaced" in refused(
        maps, "maps", "--mask", "mask.png", "-o", "./mask.png", "--overwrite"
    )


def test_images_that_are_there_are_replaced_only_when_told_so(maps):
    assert rollcli("estimate", "maps", "--derotated", "up", cwd=maps).status == 0
    assert "up/frame0.png: exists already; give --overwrite" in refused(maps, "maps", "--derotated", "up")
    assert rollcli("estimate", "maps", "--derotated", "up", "--overwrite", cwd=maps).status == 0


def test_image_folders_inside_the_input_are_no_input(maps):
    arguments = ("estimate", "maps", "--recursive", "--derotated", "maps/up", "--overwrite")
    first = rollcli(*arguments, cwd=maps)
    assert rollcli(*arguments, cwd=maps).out == first.out
    assert first.out.count("\n") == 3


def test_a_dry_run_lists_what_is_read_and_written_and_does_nothing(maps):
    before = contents(maps)
    done = rollcli("estimate", "maps", "-o", "rolls.csv", "--vdisparity", "v", "--dry-run", cwd=maps)
    assert done.status == 0
    assert done.out.splitlines() == [
        "read  maps/frame0.png",
        "write v/frame0.png",
        "read  maps/frame1.png",
        "write v/frame1.png",
        "write rolls.csv",
        "write rolls.csv.inputs",
        "write rolls.csv.run.json",
    ]
    assert contents(maps) == before


def test_the_format_follows_the_ending_of_the_result(maps):
    rollcli("estimate", "maps", "-o", "new/rolls.jsonl", cwd=maps)
    assert (maps / "new" / "rolls.jsonl").read_text().startswith('{"file": "maps/frame0.png"')


def test_a_named_pipe_takes_rows_as_they_come(maps):
    done = rollcli("estimate", "maps", "-q", "-o", "/dev/stdout", cwd=maps)
    assert done.out.count("\n") == 3
    assert not list(maps.glob("*.run.json"))


def test_a_frame_that_fails_leaves_no_image_of_an_earlier_run(maps):
    arguments = ("estimate", "maps", "--derotated", "up", "--overwrite")
    rollcli(*arguments, cwd=maps)
    (maps / "maps" / "frame0.png").write_bytes(b"")
    assert rollcli(*arguments, cwd=maps).status == 3
    assert names(maps / "up") == ["frame1.png"]


@pytest.mark.parametrize("command", ["estimate", "derotate"])
def test_links_and_pipes_in_the_output_folder_are_neither_followed_nor_waited_for(maps, command):
    (maps / "victim").write_bytes(b"precious")
    (maps / "up").mkdir()
    (maps / "up" / ".frame0.png.part").symlink_to(maps / "victim")
    os.mkfifo(maps / "up" / ".frame1.png.part")
    (maps / "up" / "frame1.png").symlink_to(maps / "victim")
    (maps / "up" / ".frame0.png.0123456789abcdef.part").write_bytes(b"of a killed run")
    images = {"estimate": ("-o", "rolls.csv", "--derotated", "up"), "derotate": ("--roll", "1", "-o", "up")}

    done = rollcli(command, "maps", *images[command], "--overwrite", cwd=maps)

    assert done.status == 0, done.err
    assert (maps / "victim").read_bytes() == b"precious"
    left = sorted(path.name for path in (maps / "up").iterdir())
    assert left == [".frame0.png.part", ".frame1.png.part", "frame0.png", "frame1.png"]
    assert not (maps / "up" / "frame1.png").is_symlink()


def test_a_pattern_that_steps_upwards_writes_nothing_outside_of_the_output_folder(tmp_path):
    write_maps(tmp_path / "data" / "maps", 1)
    write_maps(tmp_path / "more", 1)
    pattern = "data/*/../../more/*.png"

    done = rollcli("derotate", pattern, "--roll", "1", "-o", "out/up", cwd=tmp_path)

    assert done.status == 0, done.err
    assert names(tmp_path / "out") == ["up/more/frame0.png"]
    assert names(tmp_path) == ["data/maps/frame0.png", "more/frame0.png", "out/up/more/frame0.png"]


@pytest.mark.parametrize("second", ["out", "./out", "out/../out", "link"])
def test_two_kinds_of_images_in_one_folder_are_refused_before_anything_runs(maps, second):
    (maps / "link").symlink_to("out")
    line = refused(maps, "maps", "--derotated", "out", "--vdisparity", second, "--overwrite")
    assert "two images of maps/frame0.png would be written there; give each kind a folder of its own" in line


@pytest.mark.parametrize("result", ["out/frame1.png", "out/../out/frame1.png"])
def test_a_result_and_an_image_of_one_path_are_refused(maps, result):
    line = refused(maps, "maps", "-o", result, "--derotated", "out")
    assert "would be a result of this run and an image of maps/frame1.png" in line


def test_the_record_of_the_run_and_an_image_of_one_path_are_refused(tmp_path):
    np.save(tmp_path / "rolls.csv.run.npy", road_map())
    (tmp_path / "rolls.csv.run.npy").rename(tmp_path / "rolls.csv.run.json")
    line = refused(tmp_path, "rolls.csv.run.json", "-o", "out/rolls.csv", "--derotated", "out", "--overwrite")
    assert "would be a result of this run and an image" in line


def test_names_that_differ_in_case_are_one_where_the_folder_ignores_case(tmp_path):
    write_kitti(tmp_path / "one" / "a.png", road_map())
    write_kitti(tmp_path / "two" / "A.png", road_map())
    arguments = ("one/a.png", "two/A.png", "--derotated", "out", "--overwrite")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "Name").touch()
    assert rollcli("estimate", *arguments, cwd=tmp_path).status == 0
    # two names of one file: that is how a folder that ignores case looks
    (tmp_path / "out" / "nAME").hardlink_to(tmp_path / "out" / "Name")
    for path in (tmp_path / "out").glob("?.png"):
        path.unlink()
    assert "one/a.png and two/A.png would both write" in refused(tmp_path, *arguments)


COMMANDS = {
    "rig": ("rollcli.run.rig", ["rig", "rolls.csv", "-o", "out.txt"], "out.txt"),
    "page": ("rollcli.report.run", ["report", "rolls.csv", "-o", "out.html", "--gallery", "0"], "out.html"),
    "charts": ("rollcli.report.run", ["report", "rolls.csv", "--svg", "s"], "s/roll.svg"),
    "accuracy": (
        "rollcli.evaluate.run_accuracy",
        ["evaluate", "accuracy", "rolls.csv", "--truth", "truth.csv", "-o", "out.txt"],
        "out.txt",
    ),
    "paper": (
        "rollcli.evaluate.paper",
        ["evaluate", "paper", "maps", "-o", "p", "--turns=-2:2:2", "--timed", "1"],
        "p/paper.html",
    ),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_later_of_two_does_not_replace_what_the_first_wrote(tmp_path, monkeypatch, name):
    module, words, output = COMMANDS[name]
    write_maps(tmp_path / "maps", 1)
    write_result(tmp_path / "rolls.csv", [row(f"frame{number}.png") for number in range(40)])
    (tmp_path / "truth.csv").write_text("file,roll_deg\nframe0.png,1\n")
    check = import_module(module).check_writes
    written = tmp_path / output

    def checked_then_written_by_another(*arguments, **settings):
        check(*arguments, **settings)
        written.parent.mkdir(exist_ok=True)
        written.write_bytes(b"another's")

    monkeypatch.setattr(f"{module}.check_writes", checked_then_written_by_another)
    done = rollcli(*words, cwd=tmp_path)
    assert done.status == 2
    assert f"{output}: exists already; give --overwrite to replace it" in done.err
    assert written.read_bytes() == b"another's"
    assert rollcli(*words, "--overwrite", cwd=tmp_path).status in (0, 3)
    assert written.read_bytes() != b"another's"
