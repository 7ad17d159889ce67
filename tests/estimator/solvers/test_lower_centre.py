"""A plane in one area."""

import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.solvers.areas import fit_plane, lower_centre, lower_centre_slices
from tests.estimator.synthetic_maps import bent_road, flat_road


def plane_of(disparity):
    """The solution of the default area."""
    return fit_plane(disparity, lower_centre(disparity, disparity > 0)).solution


@pytest.mark.parametrize("roll_deg", [-45, -12, 0, 3, 44])
def test_the_exact_map_of_a_flat_road_gives_its_roll(roll_deg):
    assert math.degrees(plane_of(flat_road(roll_deg, pitch_deg=25)).theta) == pytest.approx(
        roll_deg, abs=1e-6
    )


def test_by_default_the_area_is_the_lower_centre():
    disparity = flat_road(6)
    rows, columns = lower_centre_slices(*disparity.shape)
    used = lower_centre(disparity, disparity > 0).used
    assert used[rows, columns].all()
    assert np.count_nonzero(used) == used[rows, columns].size
    assert rows.start / disparity.shape[0] > 0.5
    assert rows.stop < disparity.shape[0]


def test_what_lies_outside_the_area_has_no_say():
    clean = flat_road(6, pitch_deg=20)
    rows, columns = lower_centre_slices(*clean.shape)
    spoilt = np.random.default_rng(0).uniform(1, 90, clean.shape)
    spoilt[rows, columns] = clean[rows, columns]
    assert plane_of(spoilt).theta == pytest.approx(plane_of(clean).theta, abs=1e-9)


def test_a_mask_is_the_chosen_area():
    rolled, level = bent_road(9, bend=0), bent_road(0, bend=0)
    both = np.where(np.arange(160) < 80, rolled, level)
    left = np.zeros(both.shape, bool)
    left[:, :80] = True
    found = estimate_roll(both, mask=left, method="plane", road="all", road_mask=True)
    assert math.degrees(found.theta) == pytest.approx(9, abs=1e-6)
    assert found.road_mask.sum() == left.sum()
    assert (found.iterations, found.global_minimum) == (0, None)


def test_it_is_the_least_squares_plane_and_says_its_error():
    disparity = bent_road(4, noise=0.3, seed=5)
    pixels = lower_centre(disparity, disparity > 0)
    energy, found = fit_plane(disparity, pixels)
    v, u = np.nonzero(pixels.used)
    design = np.stack([np.ones(len(u)), u, v], axis=1)
    plane, squares, *_ = np.linalg.lstsq(design, disparity[v, u], rcond=None)
    assert found.theta == pytest.approx(math.atan(-plane[1] / plane[2]), abs=1e-9)
    assert energy.rmse(energy.at(found.theta).value) == pytest.approx(
        math.sqrt(squares[0] / len(u)), rel=1e-6
    )


def test_an_area_without_pixels_is_refused_with_the_reason():
    disparity = flat_road(6)
    rows, columns = lower_centre_slices(*disparity.shape)
    disparity[rows, columns] = 0
    with pytest.raises(EstimationError, match="no valid pixel"):
        plane_of(disparity)
