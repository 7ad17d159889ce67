"""`rollcli estimate --calib`: pitch and height in the rows, and where the horizon is marked."""

import math

import cv2
import numpy as np
import pytest

from rollcli.rig.calibration import Calibration
from rollcli.simulate.build import render_frame
from rollcli.simulate.dataset import calibration
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from tests.estimator.synthetic_maps import banked_road, cast
from tests.rig import calibration_files as samples
from tests.rig.calibration_files import Rig
from tests.run_cli import rollcli, rows_of, write_kitti, write_views

RIG = Rig(fx=250.0, fy=250.0, cx=150.0, cy=90.0, baseline=0.5, width=320, height=200)
CALIBRATION = Calibration(RIG.fx, RIG.fy, RIG.cx, RIG.cy, RIG.baseline)
ROLL, PITCH, HEIGHT = math.radians(2), math.radians(6), 1.5
POSE = ("pitch_deg", "pitch_ci95_deg", "height_m", "height_ci95_m")


@pytest.fixture
def maps(tmp_path):
    for stem in ("000000_10", "000001_10"):
        write_kitti(tmp_path / "maps" / f"{stem}.png", cast(CALIBRATION, ROLL, PITCH, HEIGHT))
    (tmp_path / "calib.txt").write_text(samples.written("kitti-raw", RIG))
    return tmp_path


@pytest.mark.parametrize("method", ["gd", "gss", "exact", "plane", "areas"])
@pytest.mark.parametrize("road", ["auto", "all"])
def test_every_method_fills_the_columns(maps, method, road):
    done = rollcli("estimate", "maps", "--calib", "calib.txt", "--method", method, "--road", road, cwd=maps)
    rows = rows_of(done.out)
    # what holds for all frames is said once
    assert (done.status, len(rows), done.err.count("px of cy")) == (0, 2, 1)
    for row in rows:
        assert float(row["pitch_deg"]) == pytest.approx(math.degrees(PITCH), abs=0.01)
        assert float(row["height_m"]) == pytest.approx(HEIGHT, rel=1e-3)
        assert 0 < float(row["pitch_ci95_deg"]) < 0.1
        assert 0 < float(row["height_ci95_m"]) < 0.02
        assert row["message"] == ""


def test_of_a_cropped_map_the_lane_is_the_one_below_the_principal_point(tmp_path):
    write_kitti(tmp_path / "map.png", banked_road(2, cropped=200))
    given = ("--focal", "360", "--principal-point", "110,94", "--baseline", "0.5")
    done = rollcli("estimate", "map.png", *given, "-o", "rolls.csv", "--heights", "heights", cwd=tmp_path)
    (row,) = rows_of((tmp_path / "rolls.csv").read_text())
    assert (done.status, row["status"], float(row["roll_deg"])) == (0, "ok", pytest.approx(2, abs=0.02))

    rollcli("heights", "map.png", "--from", "rolls.csv", *given, "-o", "again", cwd=tmp_path, status=0)
    both = [cv2.imread(str(next((tmp_path / each).rglob("*.tif*"))), -1) for each in ("heights", "again")]
    np.testing.assert_allclose(*both, atol=1e-3)
    assert abs(np.nanmedian(both[0][120:, 90:130])) < 0.005  # the lane


@pytest.mark.slow
def test_downscaled_pairs_have_the_pose_of_the_full_size(tmp_path):
    rig = {"pitch_deg": (4.6, 4.6), "height": (1.4, 1.4), "principal_offset": (-30.0, 30.0)}
    asked, agree = SimulateOptions(frames=10, scene="open", curvature=(0, 0), seed=6, grey=True, **rig), []
    for number, spec in enumerate(draw_specs(asked)):
        folder, frame = tmp_path / str(number), render_frame(spec)
        write_views(folder, "a.png", frame.left, frame.right)
        (folder / "calib.txt").write_bytes(calibration(spec))
        poses = []
        for factor in ("1", "2"):
            pair = ("--left", "left", "--right", "right", "--calib", "calib.txt", "--downscale", factor)
            (row,) = rows_of(rollcli("estimate", *pair, cwd=folder).out)
            poses.append([float(row[name]) for name in POSE])
        (pitch, pitch_ci, height, height_ci), (half_pitch, half_pitch_ci, half_height, half_height_ci) = poses
        agree.append(abs(pitch - half_pitch) <= math.hypot(pitch_ci, half_pitch_ci))
        agree.append(abs(height - half_height) <= math.hypot(height_ci, half_height_ci))
        assert (pitch, height) == pytest.approx((4.6, 1.4), rel=0.02)
        assert (half_pitch, half_height) == pytest.approx((4.6, 1.4), rel=0.02)
    assert sum(agree) >= 17  # of twenty, where 95 % agree, 98 % have as many


@pytest.mark.parametrize("doffs", ["0", "20"])  # of 20 px, what is farther than 6 m would be no data
def test_depth_maps_become_the_disparities_of_their_calibration(maps, doffs):
    disparity = cast(CALIBRATION, ROLL, PITCH, HEIGHT)
    depth = np.where(disparity > 0, RIG.fx * RIG.baseline / np.where(disparity > 0, disparity, 1), np.nan)
    (maps / "depth").mkdir()
    np.save(maps / "depth" / "metres.npy", depth.astype(np.float32))
    millimetres = np.rint(1000 * np.clip(np.nan_to_num(depth), 0, 65)).astype(np.uint16)
    cv2.imwrite(str(maps / "depth" / "millimetres.png"), millimetres)

    depths = ("depth", "--encoding", "depth", "--calib", "calib.txt", "--doffs", doffs)
    done = rollcli("estimate", *depths, "--derotated", "level", cwd=maps, status=0)
    for row in rows_of(done.out):
        found = [float(row[name]) for name in ("roll_deg", "pitch_deg", "height_m")]
        assert found == pytest.approx([2.0, 6.0, HEIGHT], abs=0.002)
        assert float(row["valid_fraction"]) == pytest.approx(np.mean(disparity > 0), abs=0.01)
    level = rollcli("estimate", "level", *depths[1:], cwd=maps)
    assert [float(row["roll_deg"]) for row in rows_of(level.out)] == pytest.approx([0.0, 0.0], abs=0.05)
    assert rollcli("vdisparity", *depths, "-o", "v", cwd=maps).status == 0
    assert rollcli("derotate", *depths[:3], "--roll", "2", "-o", "turned", cwd=maps).status == 0


GREEN = (120, 220, 120)


def horizon_on(column, roll):
    """The row of a column whose ray is level: n K^-1 (u, v, 1) = 0, n the normal of the road."""
    n = (-math.sin(roll) * math.cos(PITCH), math.cos(roll) * math.cos(PITCH), math.sin(PITCH))
    return RIG.cy - RIG.fy * (n[0] * (column - RIG.cx) / RIG.fx + n[2]) / n[1]


def marked_row(path):
    """The row with most pixels of the horizon's colour."""
    picture = cv2.imread(str(path))
    return int((picture == GREEN).all(axis=2).sum(axis=1).argmax())


def test_the_horizon_is_marked_where_the_road_is_infinitely_far_away(tmp_path):
    roll = math.radians(9)
    write_kitti(tmp_path / "maps" / "a.png", cast(CALIBRATION, roll, PITCH, HEIGHT))
    (tmp_path / "calib.txt").write_text(samples.written("kitti-raw", RIG))
    maps = ("maps", "--calib", "calib.txt")
    assert rollcli("estimate", *maps, "--vdisparity", "upright", cwd=tmp_path).status == 0
    done = rollcli("vdisparity", *maps, "-o", "as_it_is", cwd=tmp_path)
    assert (done.status, "no effect" in done.err) == (0, False)
    middle = horizon_on(159.5, roll)
    assert marked_row(tmp_path / "as_it_is" / "a.png") == pytest.approx(middle, abs=0.6)
    # the upright map is turned about its centre, and its horizon is level
    level = 99.5 - (99.5 - middle) * math.cos(roll)
    assert marked_row(tmp_path / "upright" / "a.png") == pytest.approx(level, abs=0.6)
