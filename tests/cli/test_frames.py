"""Which frames and which pixels `estimate` takes."""

import json
import math
import re

import cv2
import numpy as np
import pytest

from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from tests.run_cli import command, ended, road_map, rollcli, rows_of, write_kitti, write_pair


def column(text, name):
    return [row[name] for row in rows_of(text)]


FRAMES = 7


def test_a_file_name_that_is_no_text_comes_back_as_it_is(tmp_path):
    name = b"fr\xe4me,\xff.png"
    write_kitti(tmp_path / "a.png", road_map())
    (tmp_path / "a.png").rename(tmp_path / name.decode("utf-8", "surrogateescape"))
    done = ended(command("estimate", "."), tmp_path, text=False)
    assert done.stdout.splitlines()[1].startswith(b'"' + name + b'",,ok,')


@pytest.fixture
def two_roads(tmp_path):
    """A map whose left half is rolled one way and whose right half the other."""
    one, other = road_map(0.1), road_map(-0.05)
    write_kitti(tmp_path / "map.png", np.hstack([one[:, :80], other[:, 80:]]))
    left = np.zeros(one.shape)
    left[:, :80] = 1
    write_kitti(tmp_path / "mask.png", left)
    write_kitti(tmp_path / "masks" / "map.png", left)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "roll"),
    [
        (["--mask", "mask.png"], 0.1),
        (["--mask", "masks"], 0.1),
        (["--roi", "0,0,80,120"], 0.1),
        (["--roi", "80,0,160,120"], -0.05),
        (["--polygon", "80,0 159,0 159,119 80,119"], -0.05),
    ],
)
def test_a_region_decides_which_pixels_are_used(two_roads, arguments, roll):
    done = rollcli("estimate", "map.png", "--road", "all", *arguments, cwd=two_roads)
    assert float(column(done.out, "roll_deg")[0]) == pytest.approx(np.degrees(roll), abs=0.1)


def test_pairs_say_which_disparities_were_searched(tmp_path):
    write_pair(tmp_path, "a.png", road_map(0.05, width=320, height=160) / 2)
    done = rollcli("estimate", "--left", "left", "--right", "right", cwd=tmp_path)
    assert column(done.out, "right_file") == ["right/a.png"]
    assert float(column(done.out, "roll_deg")[0]) == pytest.approx(np.degrees(0.05), abs=0.3)
    assert "left/a.png: searched disparities from 0 to" in done.err


def test_a_pair_whose_views_are_not_level_is_corrected_and_says_so(tmp_path):
    write_pair(tmp_path, "a.png", road_map(0.05, width=320, height=160) / 2)
    right = cv2.imread(str(tmp_path / "right" / "a.png"), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(tmp_path / "right" / "a.png"), np.roll(right, 1, axis=0))
    pair = ("--left", "left", "--right", "right")

    done = rollcli("estimate", *pair, cwd=tmp_path)
    assert float(column(done.out, "right_lower_px")[0]) == pytest.approx(1, abs=0.1)
    assert float(column(done.out, "right_clockwise_deg")[0]) == pytest.approx(0, abs=0.05)
    assert column(done.out, "message") == [""]
    assert float(column(done.out, "roll_deg")[0]) == pytest.approx(np.degrees(0.05), abs=0.3)
    assert re.search(r"median over the pairs: the right image lies \d\.\d\d px lower: recalibrate", done.err)
    for untouched in (("--vertical-offset", "1"), ("--align", "off")):
        assert column(rollcli("estimate", *pair, *untouched, cwd=tmp_path).out, "right_lower_px") == [""]
    given = rollcli("estimate", *pair, "--vertical-offset", "1", cwd=tmp_path)
    half_width, half_width_given = (float(column(each.out, "roll_ci95_deg")[0]) for each in (done, given))
    assert half_width > half_width_given  # what was measured has an error of its own


def test_the_record_of_a_run_says_how_the_cameras_lie(tmp_path):
    for name, clockwise_deg in (("a.png", 0.30), ("b.png", 0.31), ("c.png", 0.32)):
        write_pair(tmp_path, name, road_map(0.05, width=480, height=240) / 2)
        right = cv2.imread(str(tmp_path / "right" / name), cv2.IMREAD_UNCHANGED)
        turn = cv2.getRotationMatrix2D((239.5, 119.5), -clockwise_deg, 1.0)
        turned = cv2.warpAffine(right, turn, (480, 240), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        cv2.imwrite(str(tmp_path / "right" / name), turned)

    done = rollcli("estimate", "--left", "left", "--right", "right", "-o", "r.csv", cwd=tmp_path)

    alignment = json.loads((tmp_path / "r.csv.run.json").read_text())["alignment"]
    assert alignment["frames"] == 3
    assert alignment["right_clockwise_deg"] == pytest.approx(0.31, abs=0.03)
    assert re.match(r"the right camera is rolled by 0\.3\d degrees against the left", alignment["advice"])
    assert alignment["advice"] in done.err


def test_swapped_views_and_images_of_two_places_get_a_row_that_says_so(tmp_path):
    write_pair(tmp_path, "a.png", road_map(0.05, width=320, height=160) / 2)
    swapped = rollcli("estimate", "--left", "right", "--right", "left", cwd=tmp_path)
    assert (swapped.status, column(swapped.out, "status")) == (3, ["error"])
    assert "the views seem swapped" in swapped.out

    grain = np.random.default_rng(5).integers(0, 256, (160, 320), dtype=np.uint8)
    cv2.imwrite(str(tmp_path / "right" / "a.png"), grain)
    two_places = rollcli("estimate", "--left", "left", "--right", "right", cwd=tmp_path)
    assert "the two images do not show the same scene" in two_places.out


@pytest.mark.parametrize("options", [(), ("--roi", "0,120,320,200"), ("--road", "all")])
def test_a_pair_gives_the_same_row_whether_its_whole_map_is_written_or_not(tmp_path, options):
    spec = FrameSpec(scene="street", roll=math.radians(4), size=(320, 240), seed=3)
    frame = render_frame(spec)
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        cv2.imwrite(str(tmp_path / side / "a.png"), getattr(frame, side))
    pairs = ("--left", "left", "--right", "right")

    alone = rollcli("estimate", *pairs, *options, cwd=tmp_path).out
    beside_a_map = rollcli("estimate", *pairs, *options, "--disparity", "maps", cwd=tmp_path).out
    rollcli("disparity", *pairs, "-o", "whole", cwd=tmp_path)

    if "all" not in options:
        assert float(column(alone, "roll_deg")[0]) == pytest.approx(4, abs=0.2)
    assert alone == beside_a_map
    written, whole = (
        cv2.imread(str(tmp_path / folder / "a.png"), cv2.IMREAD_UNCHANGED) / 256
        for folder in ("maps", "whole")
    )
    both = (written > 0) & (whole > 0)
    assert both.sum() > 0.97 * (whole > 0).sum()
    assert (np.abs(written - whole)[both] < 0.1).mean() > 0.97
