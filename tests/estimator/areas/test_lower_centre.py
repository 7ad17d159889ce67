"""A plane in one area."""

import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.areas.lower_centre import lower_centre, plane_fit
from rollcli.estimator.estimate import estimate_roll
from tests.estimator.synthetic_maps import bent_road, flat_road


@pytest.mark.parametrize("roll_deg", [-45, -12, 0, 3, 44])
def test_the_exact_map_of_a_flat_road_gives_its_roll(roll_deg):
    assert math.degrees(plane_fit(flat_road(roll_deg, pitch_deg=25)).theta) == pytest.approx(
        roll_deg, abs=1e-6
    )


def test_by_default_the_area_is_the_lower_centre():
    disparity = flat_road(6)
    rows, columns = lower_centre(*disparity.shape)
    found = plane_fit(disparity)
    assert found.used[rows, columns].all()
    assert np.count_nonzero(found.used) == found.used[rows, columns].size
    assert rows.start / disparity.shape[0] > 0.5
    assert rows.stop < disparity.shape[0]


def test_what_lies_outside_the_area_has_no_say():
    clean = flat_road(6, pitch_deg=20)
    rows, columns = lower_centre(*clean.shape)
    spoilt = np.random.default_rng(0).uniform(1, 90, clean.shape)
    spoilt[rows, columns] = clean[rows, columns]
    assert plane_fit(spoilt).theta == pytest.approx(plane_fit(clean).theta, abs=1e-9)


def test_a_mask_is_the_chosen_area():
    rolled, level = bent_road(9, bend=0), bent_road(0, bend=0)
    both = np.where(np.arange(160) < 80, rolled, level)
    left = np.zeros(both.shape, bool)
    left[:, :80] = True
    found = estimate_roll(both, mask=left, method="plane", road="all")
    assert math.degrees(found.theta) == pytest.approx(9, abs=1e-6)
    assert found.road_mask(both).sum() == left.sum()
    assert (found.iterations, found.global_minimum) == (0, None)


def test_it_is_the_least_squares_plane_and_says_its_error():
    disparity = bent_road(4, noise=0.3, seed=5)
    found = plane_fit(disparity)
    v, u = np.nonzero(found.used)
    design = np.stack([np.ones(len(u)), u, v], axis=1)
    plane, squares, *_ = np.linalg.lstsq(design, disparity[v, u], rcond=None)
    assert found.theta == pytest.approx(math.atan(-plane[1] / plane[2]), abs=1e-9)
    assert found.energy.rmse(found.theta) == pytest.approx(math.sqrt(squares[0] / len(u)), rel=1e-6)


def test_an_area_without_pixels_is_refused_with_the_reason():
    disparity = flat_road(6)
    rows, columns = lower_centre(*disparity.shape)
    disparity[rows, columns] = 0
    with pytest.raises(EstimationError, match="no valid pixel"):
        plane_fit(disparity)
