"""`rollcli disparity`: one map a pair, as stereo matching has it."""

from pathlib import Path

import numpy as np
import pytest

from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_stored
from tests.run_cli import ROOT, contents, road_map, rollcli, write_pair

ROADS = ROOT.parent / "shared" / "roads"


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs")
    line = ["simulate", "rig", "--frames", "3", "--size", "256x192", "--seed", "5", "-q"]
    assert rollcli(*line, cwd=folder).status == 0
    return folder


def match(folder, *arguments, left="rig/left", right="rig/right"):
    return rollcli("disparity", "--left", left, "--right", right, *arguments, cwd=folder)


def test_each_pair_gives_a_kitti_map_named_after_its_left_image(pairs):
    done = match(pairs, "-o", "png", "-j2")
    assert (done.status, done.out) == (0, "")
    names = sorted(contents(pairs / "png"))
    assert names == [path.name for path in sorted((pairs / "rig" / "left").iterdir())]
    for name in names:
        stored = read_stored(pairs / "png" / name)
        assert (stored.format, stored.values.dtype) == ("png", np.uint16)
        found, truth = (read_disparity(pairs / each / name) for each in ("png", "rig/disparity"))
        both = (found > 0) & (truth > 0)
        assert both.sum() > 0.6 * (truth > 0).sum()  # the left margin has no partner in the right image
        assert np.median(np.abs(found - truth)[both]) < 0.5


@pytest.mark.parametrize("program", [["disparity", "-o"], ["estimate", "-o", "rolls.csv", "--disparity"]])
def test_a_map_that_a_16_bit_png_cannot_hold_is_written_as_tiff_and_that_is_said(tmp_path, program):
    for name, near in (("a.png", 0), ("b.png", 280), ("c.png", 0)):
        write_pair(tmp_path, name, road_map(0.02, width=900) / 2 + near)
    line = [*program, "maps", "--left", "left", "--right", "right", "--num-disparities", "352"]
    done = rollcli(*line, cwd=tmp_path)
    assert done.status == 0
    said = done.err + (tmp_path / "rolls.csv").read_text() if program[0] == "estimate" else done.err
    words = "written as TIFF: a disparity is above the 256 px of a KITTI PNG"
    lines = [line for line in said.splitlines() if words in line]
    assert lines
    assert all("left/b.png" in line for line in lines)
    assert sorted(contents(tmp_path / "maps")) == ["a.png", "b.tif", "c.png"]
    assert read_disparity(tmp_path / "maps" / "b.tif").max() > 300
    (tmp_path / "maps" / "b.png").write_bytes(b"of an earlier run")
    assert rollcli(*line, "--overwrite", cwd=tmp_path).status == 0
    assert sorted(contents(tmp_path / "maps")) == ["a.png", "b.tif", "c.png"]


def test_a_resume_finds_the_tiff_that_stands_for_a_png(tmp_path):
    for name, near in (("a.png", 0), ("b.png", 280)):
        write_pair(tmp_path, name, road_map(0.02, width=900) / 2 + near)
    line = ["estimate", "--left", "left", "--right", "right", "--num-disparities", "352", "-o", "rolls.csv"]
    line += ["--disparity", "maps"]
    assert rollcli(*line, cwd=tmp_path).status == 0
    assert "made again" not in rollcli(*line, "--resume", cwd=tmp_path).err
    (tmp_path / "maps" / "b.tif").unlink()
    assert "made again" in rollcli(*line, "--resume", cwd=tmp_path).err
    assert sorted(contents(tmp_path / "maps")) == ["a.png", "b.tif"]


@pytest.mark.slow
@pytest.mark.skipif(not ROADS.is_dir(), reason="the real road pairs (../shared/roads) are not here")
def test_on_real_roads_most_pixels_of_the_matched_region_are_valid(tmp_path):
    done = match(
        tmp_path, "-o", "maps", "--downscale", "2", left=str(ROADS / "left"), right=str(ROADS / "right")
    )
    assert done.status == 0
    maps = sorted((tmp_path / "maps").iterdir())
    assert len(maps) == len(list((ROADS / "left").iterdir()))
    shares = {path.name: matched_share(path) for path in maps}
    assert min(shares.values()) > 0.7, shares


def matched_share(path: Path) -> float:
    """The valid share of the columns whose partner lies inside the right image."""
    disparity = read_disparity(path)
    seen_by_both = disparity[:, int(disparity.max()) + 1 :]
    return float((seen_by_both > 0).mean())
