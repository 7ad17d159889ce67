"""`rollcli disparity`: one map a pair, as stereo matching has it."""

import numpy as np
import pytest

from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_stored
from tests.real_pairs import ROADS, needs_roads
from tests.run_cli import contents, rollcli


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


@pytest.mark.slow
@needs_roads
def test_on_real_roads_most_pixels_of_the_matched_region_are_valid(tmp_path):
    views = {side: str(ROADS / side) for side in ("left", "right")}
    assert match(tmp_path, "-o", "maps", "--downscale", "2", **views).status == 0
    maps = {path.name: read_disparity(path) for path in (tmp_path / "maps").iterdir()}
    assert len(maps) == len(list((ROADS / "left").iterdir()))
    for name, disparity in maps.items():
        # the partners of these columns lie inside the right image
        assert (disparity[:, int(disparity.max()) + 1 :] > 0).mean() > 0.7, name
