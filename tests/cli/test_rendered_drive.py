"""A rendered drive, from its maps and its calibration to what is said of the rig."""

import json

import pytest

from tests.run_cli import rollcli


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Twenty-four frames of one rig, estimated with its calibration."""
    folder = tmp_path_factory.mktemp("drive")
    scene = ("--scene", "bare", "--size", "320x240", "--roll", "2", "--pitch", "3", "-q")
    assert rollcli("simulate", "rig", "--frames", "24", *scene, cwd=folder).status == 0
    maps = ("rig/disparity", "--calib", "rig/calib.txt", "-o", "rolls.csv", "-q")
    assert rollcli("estimate", *maps, cwd=folder).status == 0
    return folder


def test_the_rig_is_as_it_was_rendered(drive):
    values = json.loads(rollcli("rig", "rolls.csv", "--format", "json", "-q", cwd=drive).out)
    assert values["frames"] == 24
    assert values["roll_deg"] == pytest.approx(2, abs=0.05)
    assert values["pitch_deg"] == pytest.approx(3, abs=0.1)
    assert values["height_m"] == pytest.approx(1.65, abs=0.02)
    assert values["jumps"] == []


def test_a_gate_on_roll_pitch_and_height_passes_and_one_on_another_rig_fails(drive):
    asked = ("--within", "0.2", "--expect-roll", "2", "--expect-pitch", "3", "--expect-height", "1.65")
    assert rollcli("rig", "rolls.csv", *asked, cwd=drive).status == 0
    other = rollcli("rig", "rolls.csv", "--within", "0.2", "--expect-roll", "0", cwd=drive)
    assert other.status == 4
    assert "the roll of disparity/frame_0001.png to disparity/frame_0024.png is +2" in other.err
