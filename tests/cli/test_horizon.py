"""With a calibration, v-disparity images mark the horizon; images are turned by the angle of the pixels."""

import math

import cv2
import pytest

from rollcli.rig.calibration import Calibration
from tests.rig.calibration_files import Rig, kitti_raw
from tests.rig.test_pose import cast
from tests.run_cli import rollcli, write_kitti

RIG = Rig(fx=250.0, fy=250.0, cx=150.0, cy=90.0, baseline=0.5, width=320, height=200)
ROLL, PITCH, HEIGHT = math.radians(9), math.radians(6), 1.5
GREEN = (120, 220, 120)


def write_map(path, rig):
    camera = Calibration(rig.fx, rig.fy, rig.cx, rig.cy, rig.baseline)
    write_kitti(path, cast(camera, ROLL, PITCH, HEIGHT))


def horizon_on(column, rig):
    """The row of a column whose ray is level: n K^-1 (u, v, 1) = 0, n the normal of the road."""
    n = (-math.sin(ROLL) * math.cos(PITCH), math.cos(ROLL) * math.cos(PITCH), math.sin(PITCH))
    return rig.cy - rig.fy * (n[0] * (column - rig.cx) / rig.fx + n[2]) / n[1]


def marked_row(path):
    """The row with most pixels of the horizon's colour."""
    picture = cv2.imread(str(path))
    return int((picture == GREEN).all(axis=2).sum(axis=1).argmax())


def test_the_horizon_is_marked_where_the_road_is_infinitely_far_away(tmp_path):
    write_map(tmp_path / "maps" / "a.png", RIG)
    (tmp_path / "calib.txt").write_text(kitti_raw(RIG))
    calib = ("--calib", "calib.txt")
    assert rollcli("estimate", "maps", *calib, "--vdisparity", "upright", cwd=tmp_path).status == 0
    done = rollcli("vdisparity", "maps", *calib, "-o", "as_it_is", cwd=tmp_path)
    assert (done.status, "no effect" in done.err) == (0, False)
    middle = horizon_on(159.5, RIG)
    assert marked_row(tmp_path / "as_it_is" / "a.png") == pytest.approx(middle, abs=0.6)
    # the upright map is turned about its centre, and its horizon is level
    above = (99.5 - middle) * math.cos(ROLL)
    assert marked_row(tmp_path / "upright" / "a.png") == pytest.approx(99.5 - above, abs=0.6)
