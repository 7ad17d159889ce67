"""`rollcli vdisparity`: pictures to look at, counts that add up."""

import math
import re
import xml.etree.ElementTree as ET

import cv2
import numpy as np
import pytest
import tifffile

from tests.run_cli import road_map, rollcli, rollcli_process, write_kitti


@pytest.fixture
def maps(tmp_path):
    for index in range(3):
        disparity = road_map(0.02 * index, seed=index)
        disparity[:30, 10 * index :] = 0
        write_kitti(tmp_path / "maps" / f"frame{index}.png", disparity)
    return tmp_path


SVG = "{http://www.w3.org/2000/svg}"


def numbers_beside_axes(root, anchor):
    """The numbers that axes have, each with its place in the figure, shape (N, 3)."""
    texts = [each for each in root.iter(f"{SVG}text") if f"text-anchor: {anchor}" in each.get("style")]
    numbered = [each for each in texts if re.fullmatch(r"[\d.]+", each.text)]
    return np.array([[float(each.text), float(each.get("x")), float(each.get("y"))] for each in numbered])


def test_a_figure_has_map_and_counts_before_and_after_with_the_roads_curve_where_it_is(maps):
    roll = math.radians(8)
    write_kitti(maps / "maps" / "rolled.png", road_map(roll, noise=0.0))
    # with unequal focal lengths the rig's roll is another angle
    (maps / "calib.txt").write_text("cam0=[200 0 79.5; 0 300 59.5; 0 0 1]\nbaseline=500\n")
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "--calib", "calib.txt", cwd=maps).status == 0
    line = ["vdisparity", "maps/rolled.png", "--figure", "svg", "--from", "rolls.csv", "-o", "v"]
    assert rollcli(*line, cwd=maps).status == 0
    root = ET.parse(maps / "v" / "rolled.svg").getroot()
    assert root.get("width") == "252pt"  # a journal's column: 3.5 inches
    words = [each.text for each in root.iter(f"{SVG}text")]
    expected = ["row v, px", "column u, px", "disparity, px", "as it is", "de-rotated by 8.00°"]
    assert [each for each in expected if each not in words] == []
    assert len(list(root.iter(f"{SVG}image"))) == 5  # two maps, two v-disparities, the bar of colours

    curves = [each for each in root.iter(f"{SVG}path") if "#00e5ff" in each.get("style", "")]
    below = numbers_beside_axes(root, "middle")
    below = below[below[:, 1] > 170]  # of the v-disparities
    disparity = np.polynomial.Polynomial.fit(below[:, 1], below[:, 0], 1)
    beside = numbers_beside_axes(root, "end")
    # the truth at the middle of the map's columns: y of its rows, where the de-rotated ones are y's own
    v, u = np.mgrid[:120, :160]
    y = v * np.cos(roll) - u * np.sin(roll)
    for curve, down in zip(curves, (np.cos(roll), 1.0), strict=True):
        places = np.array([float(each) for each in re.findall(r"[-\d.]+", curve.get("d"))]).reshape(-1, 2)
        mine = beside[np.abs(beside[:, 2] - places[:, 1].mean()) < np.ptp(places[:, 1]) / 2]
        row = np.polynomial.Polynomial.fit(mine[:, 2] - 0.38 * 7, mine[:, 0], 1)  # from a number's foot
        centre = 59.5 * np.cos(roll) - 79.5 * np.sin(roll)
        truth = 20 + 0.3 * (centre + down * (row(places[:, 1]) - 59.5) - y.min())
        np.testing.assert_allclose(disparity(places[:, 0]), truth, atol=0.3)


@pytest.mark.slow
def test_nothing_of_matplotlibs_own_files_is_told(maps):
    nowhere = dict.fromkeys(("HOME", "MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"), "/dev/null/no")
    line = ("vdisparity", "maps/frame0.png", "--figure", "svg", "-o", "v", "-q")
    assert rollcli_process(*line, cwd=maps, **nowhere)[::2] == (0, "")


def test_the_counts_are_a_histogram_up_to_the_end_that_their_file_names(maps):
    assert rollcli("vdisparity", "maps", "--counts", "-o", "v", cwd=maps).status == 0
    for path in sorted((maps / "v").glob("*.tif*")):
        with tifffile.TiffFile(path) as file:
            counts, says = file.asarray(), file.pages[0].description
        end = float(re.fullmatch(r"columns divide 0 to ([\d.]+) px evenly", says)[1])
        stored = cv2.imread(str(maps / "maps" / path.name.split(".")[0]) + ".png", cv2.IMREAD_UNCHANGED)
        expected = [np.histogram(row[row > 0] / 256, counts.shape[1], (0, end))[0] for row in stored]
        np.testing.assert_array_equal(counts, expected)


def test_pictures_and_figures_end_where_it_is_asked(maps):
    """As those of a drive do that are shown one after the other; the maps have up to 56 px."""
    line = ("vdisparity", "maps/frame0.png", "--max-disparity", "160")
    assert rollcli(*line, "-o", "wide", cwd=maps).status == 0
    picture = cv2.imread(str(maps / "wide" / "frame0.png"))
    _, columns = np.nonzero(picture[:120, 40:].max(axis=2) > 40)
    assert columns.max() / (picture.shape[1] - 40) == pytest.approx(56 / 160, abs=0.02)
    assert rollcli(*line, "--figure", "svg", "-o", "figure", cwd=maps).status == 0
    below = numbers_beside_axes(ET.parse(maps / "figure" / "frame0.svg").getroot(), "middle")
    assert below[below[:, 1] > 170, 0].max() == 160 - 160 % 50
