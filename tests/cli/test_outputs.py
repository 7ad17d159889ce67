"""The images that `estimate` writes: their names, what they never replace, and the later of two runs."""

import os
import re
from importlib import import_module

import numpy as np
import pytest

from tests.report.results import row, write_result
from tests.run_cli import contents, road_map, rollcli, write_kitti, write_maps, write_pair

FRAMES = 2


def names(folder):
    return sorted(contents(folder))


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


def refused(folder, *words):
    """The one line of a usage error; nothing was written."""
    before = contents(folder)
    refusal = rollcli(*words, cwd=folder).refused()
    assert contents(folder) == before
    return refusal


def test_a_named_pipe_takes_rows_as_they_come(maps):
    done = rollcli("estimate", "maps", "-q", "-o", "/dev/stdout", cwd=maps)
    assert done.out.count("\n") == 3
    assert not list(maps.glob("*.run.json"))


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
    line = refused(maps, "estimate", "maps", "--derotated", "out", "--vdisparity", second, "--overwrite")
    assert "two images of maps/frame0.png would be written there; give each kind a folder of its own" in line


@pytest.mark.parametrize("result", ["out/frame1.png", "out/../out/frame1.png"])
def test_a_result_and_an_image_of_one_path_are_refused(maps, result):
    line = refused(maps, "estimate", "maps", "-o", result, "--derotated", "out")
    assert "would be a result of this run and an image of maps/frame1.png" in line


def test_the_record_of_the_run_and_an_image_of_one_path_are_refused(tmp_path):
    np.save(tmp_path / "rolls.csv.run.npy", road_map())
    (tmp_path / "rolls.csv.run.npy").rename(tmp_path / "rolls.csv.run.json")
    line = ("estimate", "rolls.csv.run.json", "-o", "out/rolls.csv", "--derotated", "out", "--overwrite")
    assert "would be a result of this run and an image" in refused(tmp_path, *line)


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
    assert "one/a.png and two/A.png would both write" in refused(tmp_path, "estimate", *arguments)


MAPS = ("read  maps/frame0.png", "read  maps/frame1.png")
TABLES = ("maps", "table1_iterations", "table2_runtime", "fig3_lambda0", "fig6_accuracy", "methods_accuracy")
VIEWS = ("left", "right", "disparity")
# what a dry run lists; beside it where a command looks whether the last of that is there, if not as it begins
COMMANDS = {
    "estimate maps -o out/rolls.csv --vdisparity v": (
        *(MAPS[0], "write v/frame0.png", MAPS[1], "write v/frame1.png"),
        *("write out/rolls.csv", "write out/rolls.csv.inputs", "write out/rolls.csv.run.json"),
    ),
    "derotate maps --roll 1 -o up": (MAPS[0], "write up/frame0.png", MAPS[1], "write up/frame1.png"),
    "heights maps --from rolls.csv -o h": (MAPS[0], "write h/frame0.tif", MAPS[1], "write h/frame1.tif"),
    "rig rolls.csv --against before.csv -o out.txt": ("read  rolls.csv", "read  before.csv", "write out.txt"),
    "report rolls.csv -o out.html --gallery 0": ("read  rolls.csv", "write out.html"),
    "report rolls.csv --svg s": ("read  rolls.csv", "write s/roll.svg", "write s/histogram.svg"),
    "evaluate accuracy rolls.csv --truth truth.csv -o out.txt": (
        *("read  rolls.csv", "read  truth.csv", "write out.txt"),
    ),
    "evaluate paper maps -o p --turns=-2:2:2 --timed 1 -j1": (
        *(*MAPS, *(f"write p/{name}.csv" for name in TABLES), "write p/paper.html"),
    ),
    "simulate rig --frames 1 --size 64x48": (
        *("write rig/truth.csv.run.json", *(f"write rig/{side}/frame_0001.png" for side in VIEWS)),
        *("write rig/calib.txt", "write rig/truth.csv"),
    ),
}
LATE = {
    "rig": "rollcli.run.rig",
    "report": "rollcli.report.run",
    "evaluate accuracy": "rollcli.evaluate.run_accuracy",
    "evaluate paper": "rollcli.evaluate.paper",
}


@pytest.fixture
def inputs(maps):
    """Maps, two results and known angles."""
    for name in ("rolls.csv", "before.csv"):
        write_result(maps / name, [row(f"maps/frame{number}.png") for number in range(FRAMES)])
    (maps / "truth.csv").write_text("file,roll_deg\nframe0.png,1\nframe1.png,1\n")
    return maps


@pytest.mark.parametrize("line", COMMANDS)
def test_a_dry_run_lists_what_a_run_writes_and_what_is_there_is_kept_unless_told_otherwise(inputs, line):
    before, words = contents(inputs), line.split()
    listed = rollcli(*words, "--dry-run", cwd=inputs)
    assert (listed.status, tuple(listed.out.splitlines())) == (0, COMMANDS[line])
    assert contents(inputs) == before
    done = rollcli(*words, cwd=inputs)
    assert done.status == 0, done.err
    written = contents(inputs)
    assert written.keys() - before.keys() == {
        each.removeprefix("write ") for each in COMMANDS[line] if each.startswith("write ")
    }
    assert re.search("exists already; give --overwrite|there are files in it", refused(inputs, *words))
    assert contents(inputs) == written


@pytest.mark.parametrize("line", [line for line in COMMANDS if line.startswith(tuple(LATE))])
def test_the_later_of_two_does_not_replace_what_the_first_wrote(inputs, monkeypatch, line):
    (module,) = (LATE[name] for name in LATE if line.startswith(name))
    output = COMMANDS[line][-1].removeprefix("write ")
    check, written = import_module(module).check_writes, inputs / output

    def checked_then_written_by_another(*arguments, **settings):
        check(*arguments, **settings)
        written.parent.mkdir(exist_ok=True)
        written.write_bytes(b"another's")

    monkeypatch.setattr(f"{module}.check_writes", checked_then_written_by_another)
    done = rollcli(*line.split(), cwd=inputs)
    assert done.status == 2
    assert f"{output}: exists already; give --overwrite to replace it" in done.err
    assert written.read_bytes() == b"another's"
    assert rollcli(*line.split(), "--overwrite", cwd=inputs).status == 0
    assert written.read_bytes() != b"another's"
