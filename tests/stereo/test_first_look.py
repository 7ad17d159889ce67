"""What is concluded from small views, with measurements that are known."""

import numpy as np
import pytest

from rollcli.stereo.alignment import SmallViews
from rollcli.stereo.first_look import FirstLook, first_look, look_for_range
from rollcli.stereo.misalignment import LEVEL
from tests.stereo.test_vertical_disparity import texture_of


def pair_of(disparity, lower=0, shape=(240, 640)):
    texture = texture_of((shape[0] + 40, shape[1] + 400), seed=9)
    rows = slice(20, 20 + shape[0])
    left = texture[rows, 200 : 200 + shape[1]]
    right = texture[20 - lower : 20 - lower + shape[0], 200 + disparity : 200 + disparity + shape[1]]
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


@pytest.mark.parametrize("disparity", [8, 30, 60, 120, 200])
def test_the_range_holds_what_is_there_and_a_tenth_more(disparity):
    assert 1.1 * disparity + 5 <= look_for_range(pair_of(disparity)).range <= 1.1 * disparity + 12


def test_where_nothing_is_matched_no_range_is_found():
    flat = np.full((240, 640), 90, np.uint8)
    assert look_for_range((flat, flat)) == FirstLook(None, None)
    look = first_look(SmallViews((flat, flat)))
    assert look.range is None
    assert look.measured is None


@pytest.mark.parametrize("lower", [-6, -3, 0, 3, 6])
def test_a_look_finds_how_far_the_right_view_lies_off(lower):
    look = first_look(SmallViews(pair_of(40, lower)))

    assert look.measured.misalignment.offset == pytest.approx(lower, abs=0.12)
    assert look.measured.misalignment.rotation == pytest.approx(0, abs=0.0006)
    assert look.measured.misalignment.scale == pytest.approx(0, abs=0.002)
    assert (look.measured.misalignment == LEVEL) == (lower == 0)
    assert 49 <= look.range <= 56
