"""What OpenCV is asked to match, against OpenCV itself, and what its paths lag behind."""

import cv2
import numpy as np
import pytest

from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo.match import compute_disparity
from rollcli.stereo.options import MODES, StereoOptions
from rollcli.stereo.sgbm import LAGS, match_below, match_views, without_lag
from tests.slow import mostly_slow


@pytest.fixture(scope="module")
def views():
    """A slope of noise, a few outliers, and a part that cannot be matched."""
    rng = np.random.default_rng(5)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (140, 300), dtype=np.uint8), (0, 0), 1)
    left = texture[:, 60:260]
    rows = [texture[v, 60 + 8 + v // 10 : 260 + 8 + v // 10] for v in range(140)]
    right = np.stack(rows)
    right = np.clip(right + rng.normal(0, 6, right.shape), 0, 255).astype(np.uint8)
    right[30:50, 100:160] = 128
    return np.ascontiguousarray(left), right


@pytest.mark.parametrize("mode", ["3way", "sgbm", "hh"])
@pytest.mark.parametrize(
    "given", [{}, {"block_size": 9, "uniqueness": 40}, {"speckle_size": 400, "speckle_range": 1}]
)
def test_a_match_is_opencvs_own_in_pixels(views, mode, given):
    modes = {"3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY, "sgbm": cv2.STEREO_SGBM_MODE_SGBM}
    options = StereoOptions(mode=mode, **given)
    matcher = cv2.StereoSGBM.create(-16, 48, options.block_size)
    matcher.setMode(modes.get(mode, cv2.STEREO_SGBM_MODE_HH))
    matcher.setP1(8 * options.block_size**2 // 2)  # half of what OpenCV's samples take
    matcher.setP2(32 * options.block_size**2 // 2)
    matcher.setDisp12MaxDiff(1)
    matcher.setUniquenessRatio(options.uniqueness)
    matcher.setSpeckleWindowSize(options.speckle_size)
    matcher.setSpeckleRange(options.speckle_range)
    sixteenths = matcher.compute(*views)

    disparity = match_views(views, -16, 48, options)

    assert disparity.dtype == np.float32
    assert (disparity > 0).mean() > 0.3
    np.testing.assert_array_equal(disparity, np.where(sixteenths > 0, sixteenths / 16, 0))


@pytest.mark.parametrize(("top", "above"), [(60, 44), (17, 1), (10, 0), (0, 0)])
def test_rows_from_one_on_are_matched_with_16_above_them(views, top, above):
    found = match_below(views, 0, 48, StereoOptions(), top)
    left, right = views
    alone = match_views((left[above:], right[above:]), 0, 48, StereoOptions())
    np.testing.assert_array_equal(found, alone[top - above :])


@pytest.mark.parametrize("mode", ["3way", "sgbm", "hh"])
@pytest.mark.parametrize("first", [4, 12])
def test_below_the_first_disparity_searched_there_is_no_data(views, mode, first):
    options = StereoOptions(mode=mode)
    disparity = match_views(views, first, 32, options)

    wide = match_views(views, 0, 48, options)
    unmatched = (disparity == 0) & (wide == 0)
    assert unmatched.mean() > 0.05
    assert not disparity[:, : first + 2].any()
    assert disparity[disparity > 0].min() > first  # at the very edge the best cost may lie beyond
    both = (disparity > 0) & (wide > 0)
    assert both.mean() > 0.5
    assert np.median(np.abs(disparity - wide)[both]) == 0


@pytest.fixture(scope="module")
def roads():
    asked = SimulateOptions(
        frames=3, scene="bare", roll_deg=(-5.7, 5.7), pitch_deg=(2.9, 5.7), seed=31, grey=True
    )
    return [render_frame(spec) for spec in draw_specs(asked)]


@pytest.mark.parametrize("mode", mostly_slow(MODES, "3way"))
def test_matched_roads_lie_where_they_are(roads, mode):
    off = []
    for frame in roads:
        found = compute_disparity(frame.left, frame.right, mode=mode)
        road = frame.road & (found > 0) & (abs(found - frame.disparity) < 1)
        off.append(float(np.median((found - frame.disparity)[road])))
    assert abs(np.mean(off)) < 0.06


@pytest.mark.parametrize("mode", LAGS)
def test_a_plane_is_raised_by_one_amount_and_keeps_its_shape(mode):
    v, u = np.mgrid[:120, :160].astype(np.float32)
    plane = 10 + 0.3 * v + 0.02 * u
    added = without_lag(plane, mode) - plane
    assert added.min() == pytest.approx(LAGS[mode][0] * 0.3 / (0.3 + LAGS[mode][1]), abs=1e-4)
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
    assert added == pytest.approx(LAGS["3way"][0] * 0.3 / 0.52, abs=1e-3)


def test_a_small_map_stays_as_it_is():
    small = np.full((8, 8), 3, np.float32)
    assert without_lag(small, StereoOptions().mode) is small


def test_a_smaller_view_has_speckles_of_as_much_less_area():
    assert StereoOptions(speckle_size=180).for_smaller(3).speckle_size == 20
