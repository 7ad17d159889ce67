"""The sums of a map."""

import math

import numpy as np
import pytest
from hypothesis import given

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.moments import CheckedMap, map_moments, point_moments, require_pixels
from rollcli.estimator.request import METHODS, Request
from tests.estimator.synthetic_maps import bent_road, random_maps
from tests.slow import repeatable

DEGREES_4 = [(i, j) for i in range(5) for j in range(5 - i)]
DEGREES_2 = [(i, j) for i in range(3) for j in range(3 - i)]


def assert_same(one, other, rtol=1e-9):
    for i, j in DEGREES_4:
        np.testing.assert_allclose(one.s[i, j], other.s[i, j], rtol=rtol, atol=rtol * other.s[0, 0])
    scale = np.sqrt(other.dd * other.s[0, 0])
    for i, j in DEGREES_2:
        np.testing.assert_allclose(one.t[i, j], other.t[i, j], rtol=rtol, atol=rtol * scale)
    np.testing.assert_allclose((one.dd, one.peak), (other.dd, other.peak), rtol=rtol)


def pixel_by_pixel(disparity, like, usable=True):
    """The same sums over the list of valid pixels."""
    v, u = np.nonzero((disparity > 0) & usable)
    p, q = (u - like.grid.centre_u) / like.grid.scale, (v - like.grid.centre_v) / like.grid.scale
    return point_moments(p, q, disparity[v, u].astype(float), np.ones(len(u)), like.grid)


@repeatable
@given(random_maps())
def test_one_pass_sums_what_a_loop_over_the_pixels_sums(disparity):
    moments = map_moments(disparity)
    assert_same(moments, pixel_by_pixel(disparity, moments))


def test_pixels_that_may_not_be_used_weigh_nothing():
    disparity = bent_road(5, noise=0.1)
    usable = np.random.default_rng(1).random(disparity.shape) < 0.5
    moments = map_moments(disparity, usable)
    assert_same(moments, pixel_by_pixel(disparity, moments, usable))
    assert moments.s[0, 0] == np.count_nonzero(usable & (disparity > 0))


@pytest.mark.parametrize("nothing", [0, -1, -16, np.nan, np.inf, -np.inf])
def test_no_data_weighs_nothing_however_it_is_written(nothing):
    disparity = bent_road(5, noise=0.1)
    hole = np.random.default_rng(2).random(disparity.shape) < 0.3
    clean, holed = np.where(hole, 0, disparity), np.where(hole, nothing, disparity)
    assert_same(map_moments(holed), map_moments(clean))
    found, same = (estimate_roll(each, road_mask=True).road_mask for each in (holed, clean))
    np.testing.assert_array_equal(found, same)
    sky = np.maximum(disparity - 78, 0)  # up to the horizon, where the road is as far as what is no data
    found, same = (estimate_roll(np.where(sky > 0, sky, each), road_mask=True) for each in (nothing, 0))
    np.testing.assert_array_equal(found.road_mask, same.road_mask)


@pytest.mark.parametrize("dtype", ["uint8", "int16", ">u2", "float16", ">f4", "float64", "int64"])
def test_any_real_dtype_gives_the_same_sums(dtype):
    whole = np.rint(bent_road(5, width=32, height=32))
    assert_same(map_moments(whole.astype(dtype)), map_moments(whole))


@pytest.mark.parametrize("size", [(9, 14000), (50, 2500), (300, 40)])
def test_wide_and_tall_maps_are_summed_alike(size):
    disparity = np.random.default_rng(4).uniform(-1, 9, size)
    moments = map_moments(disparity)
    assert_same(moments, pixel_by_pixel(disparity, moments))


V, U = np.mgrid[:120, :160]
DEGENERATE = {
    "none": (U < 0, "no valid pixel"),
    "few": ((U < 9) & (V < 9), "only 81 valid pixels: at least 100"),
    "two columns": ((U == 3) | (U == 90), "120 rows and 2 columns"),
    "two rows": ((V == 3) | (V == 90), "2 rows and 160 columns"),
    "one column": (U == 7, "120 rows and 1 columns"),
    "a diagonal": (U == V, "lie on one line"),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", DEGENERATE)
def test_degenerate_pixels_are_refused_with_the_reason_by_every_method(kind, method):
    kept, reason = DEGENERATE[kind]
    if (kind, method) == ("a diagonal", "areas"):
        reason = "no area of 8x8 pixels is at least half valid"
    with pytest.raises(EstimationError, match=reason):
        estimate_roll(bent_road(5, noise=0.1), Request(method=method, road="all"), mask=kept)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("value", [*np.float32([7.0, 7.3, 0.1, 0.001, 300.0]), True])
def test_a_constant_map_is_refused_by_every_method(value, method):
    with pytest.raises(EstimationError, match="same everywhere"):
        estimate_roll(np.full((90, 120), value), Request(method=method, road="all"))


def test_three_rows_and_columns_are_enough():
    assert require_pixels((U % 60 == 0) & (V < 100)) == 300


def test_what_is_beyond_the_largest_disparity_is_no_data():
    disparity = np.full((20, 20), 9.0)
    disparity[0, :3] = 0.99e15, 1.01e15, math.nan
    found = CheckedMap.of(disparity, None)
    assert found.count == 398
    assert found.valid[0, 0]


@pytest.mark.parametrize("beyond", [2 * 10**15, 2**63 - 1])
def test_whole_numbers_beyond_the_largest_disparity_are_no_data_too(beyond):
    v, u = np.mgrid[:240, :320]
    numbers = np.rint(np.maximum(128 * (v - 100) - 12.8 * (u - 160), 0)).astype(np.int64)
    marked = np.where(v <= 100, beyond, numbers)

    found = estimate_roll(marked, Request(road="all"))

    assert found.theta == estimate_roll(np.where(v <= 100, 0, numbers), Request(road="all")).theta
