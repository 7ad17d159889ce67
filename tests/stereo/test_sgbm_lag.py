"""What SGBM's paths lag behind on roads, against the true disparity of rendered pairs."""

import numpy as np
import pytest

from rollcli.simulate.draw import draw_specs
from rollcli.simulate.render import render_frame
from rollcli.stereo.match import StereoOptions, compute_disparity
from rollcli.stereo.options import MODES
from rollcli.stereo.sgbm import LAGS, without_lag


@pytest.mark.parametrize("mode", MODES)
def test_matched_roads_lie_where_they_are(mode):
    off = []
    for spec in draw_specs(3, scene="bare", roll=(-0.1, 0.1), pitch=(0.05, 0.1), seed=31, colour=False):
        frame = render_frame(spec)
        found = compute_disparity(frame.left, frame.right, mode=mode)
        road = frame.road & (found > 0) & (abs(found - frame.disparity) < 1)
        off.append(float(np.median((found - frame.disparity)[road])))
    assert abs(np.mean(off)) < 0.06


@pytest.mark.parametrize("mode", LAGS)
def test_a_plane_is_raised_by_one_amount_and_keeps_its_shape(mode):
    v, u = np.mgrid[:120, :160].astype(np.float32)
    plane = 10 + 0.3 * v + 0.02 * u
    added = without_lag(plane, mode) - plane
    assert added.min() == pytest.approx(LAGS[mode].most * 0.3 / (0.3 + LAGS[mode].half_at), abs=1e-4)
    assert np.ptp(added) < 1e-4


@pytest.mark.parametrize("mode", MODES)
def test_walls_and_what_has_no_data_stay_as_they_are(mode):
    wall = np.full((80, 100), 12.5, np.float32)
    wall[:, 60:] = 30
    wall[20:40, 20:40] = 0
    assert np.array_equal(without_lag(wall, mode), wall)


@pytest.mark.parametrize("farthest", [1, 10])  # px; a hole below 1 px is no step too steep for a road
def test_pixels_beside_holes_are_raised_like_those_around(farthest):
    v = np.mgrid[:120, :160][0].astype(np.float32)
    road = farthest + 0.3 * v
    road[::7, :] = 0
    added = (without_lag(road, "3way") - road)[road > 0]
    assert added == pytest.approx(LAGS["3way"].most * 0.3 / 0.52, abs=1e-3)


def test_a_small_map_stays_as_it_is():
    small = np.full((8, 8), 3, np.float32)
    assert without_lag(small, StereoOptions().mode) is small
