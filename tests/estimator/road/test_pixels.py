"""Which pixels an angle rests on where no road is looked for."""

import math

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from tests.estimator.synthetic_maps import bent_road, flat_road


def test_without_road_finding_every_valid_pixel_is_road():
    disparity = bent_road(4, noise=0.1)
    disparity[:30] = 0

    found = estimate_roll(disparity, road="all", road_mask=True)

    assert np.array_equal(found.road_mask, disparity > 0)


def test_nan_is_no_data_as_0_is_without_road_finding_too():
    with_zeros = bent_road(4, noise=0.1)
    with_zeros[:30] = 0
    with_nan = np.where(with_zeros > 0, with_zeros, np.nan)

    one, other = (estimate_roll(disparity, road="all") for disparity in (with_zeros, with_nan))

    assert (one.theta, one.ci95, one.alpha) == (other.theta, other.ci95, other.alpha)


def test_a_map_with_pixels_at_its_border_alone_has_an_angle_and_no_interval():
    disparity = flat_road(5, width=40, height=40)
    disparity[2:-2, 2:-2] = 0

    found = estimate_roll(disparity, road="all")

    assert math.isclose(math.degrees(found.theta), 5, abs_tol=1e-6)
    assert found.ci95 is None


@pytest.mark.parametrize("model", ["parabola", "line"])
def test_a_road_without_road_finding_is_beyond_doubt(model):
    found = estimate_roll(bent_road(4, bend=0, noise=0.1), road="all", model=model)

    assert (found.status, found.message) == ("ok", "")
    assert found.road_fraction == 1
