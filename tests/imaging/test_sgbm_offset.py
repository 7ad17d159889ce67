"""SGBM's offset on roads, against maps that OpenCV matches from rendered pairs."""

import math

import numpy as np
import pytest

from rollcli.imaging.sgbm_offset import LAGS, sgbm_offset
from rollcli.imaging.stereo import StereoOptions, match_pair
from rollcli.imaging.stereo_options import MODES
from rollcli.simulate.draw import draw_specs
from rollcli.simulate.render import render_frame


def test_every_mode_has_an_offset():
    assert set(LAGS) == set(MODES)


@pytest.mark.parametrize("mode", ["3way", "sgbm", "hh"])
def test_matched_roads_lie_off_by_what_is_said(mode):
    off = []
    for spec in draw_specs(4, scene="bare", roll=(-0.1, 0.1), pitch=(0.05, 0.1), seed=31, colour=False):
        frame = render_frame(spec)
        found = match_pair(frame.left, frame.right, StereoOptions(mode=mode)).disparity
        road = frame.road & (found > 0) & (abs(found - frame.disparity) < 1)
        rise = spec.baseline / spec.height * math.cos(spec.pitch) * math.cos(spec.roll)
        off.append(float(np.median((found - frame.disparity)[road])) - sgbm_offset(mode, rise))
    assert abs(np.mean(off)) < 0.06
