"""Which frames and which pixels `estimate` takes."""

import math
import re

import cv2
import numpy as np
import pytest

from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from tests.run_cli import command, ended, road_map, rollcli, rows_of, write_kitti, write_pair, write_views


def column(text, name):
    return [row[name] for row in rows_of(text)]


def test_a_file_name_that_is_no_text_comes_back_as_it_is(tmp_path):
    name = b"fr\xe4me,\xff.png"
    write_kitti(tmp_path / "a.png", road_map())
    (tmp_path / "a.png").rename(tmp_path / name.decode("utf-8", "surrogateescape"))
    done = ended(command("estimate", "."), tmp_path, text=False)
    assert done.stdout.splitlines()[1].startswith(b'"' + name + b'",,ok,')


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
    assert "recalibrate" in rollcli("disparity", *pair, "-o", "maps", cwd=tmp_path).err
    assert "recalibrate" not in rollcli("estimate", "maps", cwd=tmp_path).err
    for untouched in (("--vertical-offset", "1"), ("--align", "off")):
        assert column(rollcli("estimate", *pair, *untouched, cwd=tmp_path).out, "right_lower_px") == [""]
    given = rollcli("estimate", *pair, "--vertical-offset", "1", cwd=tmp_path)
    half_width, half_width_given = (float(column(each.out, "roll_ci95_deg")[0]) for each in (done, given))
    assert half_width > half_width_given  # what was measured has an error of its own


@pytest.mark.parametrize("options", [(), ("--roi", "0,120,320,200"), ("--road", "all")])
def test_a_pair_gives_the_same_row_whether_its_whole_map_is_written_or_not(tmp_path, options):
    spec = FrameSpec(scene="street", roll=math.radians(4), size=(320, 240), seed=3)
    frame = render_frame(spec)
    write_views(tmp_path, "a.png", frame.left, frame.right)
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
