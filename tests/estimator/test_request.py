"""The outermost values that may be asked for."""

import dataclasses
import math

import pytest

from rollcli.errors import UsageError
from rollcli.estimator.request import DEFAULT_SOLVER, Request
from rollcli.estimator.tuning import TUNING

USUAL = Request("gd", "parabola", "auto", DEFAULT_SOLVER, 0.7, 0.01, 0.0, 0, TUNING)


@pytest.mark.parametrize(
    "asked",
    [
        {"max_roll": math.radians(89)},
        {"max_roll": 1e-9},
        {"max_interval": 1e-9},
        {"slope_error": 1e9},
        {"solver": DEFAULT_SOLVER._replace(lambda0=1e-9)},
        {"solver": DEFAULT_SOLVER._replace(tolerance=1e-300)},
    ],
)
def test_what_is_hardly_within_its_range_is_taken(asked):
    assert dataclasses.replace(USUAL, **asked).parabolic


@pytest.mark.parametrize(
    "asked",
    [{"max_roll": math.radians(89.001)}, {"max_roll": 0.0}, {"max_interval": 0.0}, {"slope_error": -1e-9}],
)
def test_what_is_hardly_beyond_it_is_refused(asked):
    with pytest.raises(UsageError):
        dataclasses.replace(USUAL, **asked)
