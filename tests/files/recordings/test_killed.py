"""Runs over recordings that are killed and resumed end in the bytes of an undisturbed one."""

import os
import signal

import numpy as np
import pytest

from tests.files.recordings.bag_files import image, write_bag
from tests.files.recordings.test_bags import START, STEP, maps
from tests.files.recordings.test_video import write_video
from tests.run.test_resume import wait_for_rows
from tests.run_cli import road_map, rollcli, started, write_pair

COUNT = 240
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "killpg"), reason="kills a group of processes"),
]


def write_maps(folder):
    """A bag of many maps, and what to type for it."""
    some = [np.rint(256 * each).astype(np.uint16) for each in maps(5)]

    def make(store):
        for number in range(COUNT):
            stamp = START + number * STEP
            yield "/maps", stamp, image(store, some[number % 5], "16UC1", stamp)

    return [write_bag(folder, "drive", "mcap", make).name]


def write_views(folder):
    """A video of many pairs, and what to type for it."""
    pairs = [
        np.hstack(write_pair(folder / "pairs", "0.png", road_map(0.01 * number), seed=number))
        for number in range(4)
    ]
    write_video(folder / "drive.avi", [pairs[number % 4] for number in range(COUNT // 4)], "MJPG")
    return ["drive.avi", "--side-by-side"]


@pytest.mark.parametrize(("write", "rows"), [(write_maps, COUNT), (write_views, COUNT // 4)])
def test_a_run_over_a_recording_killed_again_and_again_ends_in_the_same_bytes(tmp_path, write, rows):
    given = [*write(tmp_path), "-j", "2"]
    assert rollcli("estimate", *given, "-o", "whole.csv", cwd=tmp_path).status == 0
    result = tmp_path / "rolls.csv"
    for least in (1, rows // 3, rows * 2 // 3):
        line = ("estimate", *given, "-q", "-o", "rolls.csv", *(["--resume"] if least > 1 else []))
        run = started(*line, cwd=tmp_path, stderr=None, start_new_session=True)
        wait_for_rows(tmp_path, least, run)
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
    rollcli("estimate", *given, "-o", "rolls.csv", "--resume", cwd=tmp_path, status=0)
    assert result.read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert result.read_bytes().count(b"\n") == rows + 1
