"""`rollcli simulate` as a user runs it, and a rendered drive that `estimate` and `rig` read."""

import json
import signal
import sys

import pytest

from tests.run_cli import command, rollcli, started, wait_until


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "signals"), [("1", 1), ("2", 1), ("1", 2), ("2", 2)])
def test_ctrl_c_ends_it_with_status_130_and_without_truth(tmp_path, jobs, signals):
    run = started("simulate", "rig", "--frames", "700", "--size", "64x48", "-j", jobs, cwd=tmp_path)
    wait_until((tmp_path / "rig/disparity/frame_0003.png").exists, run)
    for each in (signal.SIGINT, signal.SIGTERM)[:signals]:
        run.send_signal(each)
    _, err = run.communicate(timeout=30)
    assert run.returncode == 130
    assert err.count("\n") == 1
    said = err.replace(command()[0], "rollcli")
    assert "of 700 frames; continue with: rollcli simulate rig --frames 700" in said
    assert err.rstrip().endswith("--resume")
    assert not (tmp_path / "rig/truth.csv").exists()


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Twenty-four frames of one rig, estimated with its calibration."""
    folder = tmp_path_factory.mktemp("drive")
    scene = ("--scene", "bare", "--size", "320x240", "--roll", "2", "--pitch", "3", "-q")
    assert rollcli("simulate", "rig", "--frames", "24", *scene, cwd=folder).status == 0
    maps = ("rig/disparity", "--calib", "rig/calib.txt", "-o", "rolls.csv", "-q")
    assert rollcli("estimate", *maps, cwd=folder).status == 0
    return folder


@pytest.mark.slow
def test_the_rig_is_as_it_was_rendered(drive):
    values = json.loads(rollcli("rig", "rolls.csv", "--format", "json", "-q", cwd=drive).out)
    assert values["frames"] == 24
    assert values["roll_deg"] == pytest.approx(2, abs=0.05)
    assert values["pitch_deg"] == pytest.approx(3, abs=0.1)
    assert values["height_m"] == pytest.approx(1.65, abs=0.02)
    assert values["jumps"] == []
