"""v-disparity: each row's disparities are counted, and the picture shows the road."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from rollcli.estimator.estimate import estimate_roll
from rollcli.pictures.derotate import derotate
from rollcli.pictures.vdisparity import row_offset, v_disparity

MAPS = arrays.arrays(
    st.sampled_from([np.uint8, np.uint16, np.int16, np.float32, np.float64]),
    arrays.array_shapes(min_dims=2, max_dims=2, max_side=12),
)


@given(MAPS, st.integers(1, 50), st.floats(0.01, 1000))
def test_counts_sum_to_the_valid_pixels_of_each_row(values, bins, top):
    with np.errstate(invalid="ignore"):
        valid = np.isfinite(values) & (values > 0)

    histogram = v_disparity(values, bins=bins, max_disparity=top)

    assert histogram.counts.shape == (len(values), bins)
    np.testing.assert_array_equal(histogram.counts.sum(axis=1), valid.sum(axis=1))


@pytest.mark.parametrize("roll_deg", [-20, 0, 3, 15])
def test_the_parabola_lies_on_the_road_of_the_derotated_map(roll_deg):
    theta = math.radians(roll_deg)
    v, u = np.mgrid[:200, :300]
    y = v * math.cos(theta) - u * math.sin(theta)
    disparity = 30 + 0.2 * y + 2e-4 * y**2
    estimate = estimate_roll(disparity, road="all")

    level = derotate(disparity, estimate.theta)
    y = np.arange(200) + row_offset(estimate.theta, 300, 200)
    road = estimate.alpha[0] + estimate.alpha[1] * y + estimate.alpha[2] * y**2

    np.testing.assert_allclose(level[:, 150], road, atol=0.01)
