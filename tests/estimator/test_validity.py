"""Which pixels can determine a roll at all."""

import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.moments import CheckedMap, require_pixels
from rollcli.estimator.request import METHODS
from tests.estimator.synthetic_maps import bent_road

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
        estimate_roll(bent_road(5, noise=0.1), mask=kept, method=method, road="all")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("value", [7.0, 7.3, 0.1, 0.001, 300.0])
def test_a_constant_map_is_refused_by_every_method(value, method):
    with pytest.raises(EstimationError, match="same everywhere"):
        estimate_roll(np.full((90, 120), value, np.float32), method=method, road="all")


def test_three_rows_and_columns_are_enough():
    assert require_pixels((U % 60 == 0) & (V < 100)) == 300


def test_what_is_beyond_the_largest_disparity_is_no_data():
    disparity = np.full((20, 20), 9.0)
    disparity[0, :3] = 0.99e15, 1.01e15, math.nan
    found = CheckedMap.of(disparity, None)
    assert found.count == 398
    assert found.valid[0, 0]
