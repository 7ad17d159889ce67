"""The first row that a road can reach, of planes with a known horizon."""

import math

import numpy as np
import pytest

from rollcli.estimator.road.find import first_row_of_road

MAX_ROLL = math.radians(45)


def plane(roll_deg, horizon, shape=(110, 146), slope=0.2):
    """A road of this roll, whose horizon crosses the middle column in this row; nothing is above it."""
    v, u = np.indices(shape)
    roll = math.radians(roll_deg)
    across = u - (shape[1] - 1) / 2
    return np.maximum(0, slope * ((v - horizon) * math.cos(roll) - across * math.sin(roll))).astype(
        np.float32
    )


@pytest.mark.parametrize("roll_deg", [-30, -8, 0, 3, 20])
@pytest.mark.parametrize("horizon", [30, 40, 52.5])
def test_it_is_two_rows_above_the_horizon_where_that_is_highest(roll_deg, horizon):
    expected = horizon - math.tan(math.radians(abs(roll_deg))) * 145 / 2 - 2
    found = first_row_of_road(plane(roll_deg, horizon), None, MAX_ROLL, 0)
    assert found == pytest.approx(max(0, expected), abs=0.3)


def test_where_the_horizon_is_above_the_map_it_is_the_first_row():
    assert first_row_of_road(plane(0, -20), None, MAX_ROLL, 0) == 0


@pytest.mark.parametrize("disparity", [np.zeros((110, 146)), np.full((110, 146), 9.0), plane(0, 40)[::-1]])
def test_where_no_road_is_found_it_is_the_first_row(disparity):
    assert first_row_of_road(disparity.astype(np.float32), None, MAX_ROLL, 0) == 0


def test_only_usable_pixels_tell():
    low, high = plane(0, 60), plane(0, 30)
    half = np.arange(146) < 73
    both = np.where(half, low, high)
    left = np.broadcast_to(half, both.shape)
    assert first_row_of_road(both, left, MAX_ROLL, 0) == pytest.approx(58, abs=0.3)
    assert first_row_of_road(both, ~left, MAX_ROLL, 0) == pytest.approx(28, abs=0.3)
