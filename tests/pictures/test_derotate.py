"""De-rotation levels the road, and neither invents data nor smears the lack of it."""

import math

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.pictures.derotate import derotate

SHAPE = (97, 141)


def road(theta, shape=SHAPE, slope=0.3):
    """A flat road seen by a rig rolled by theta: disparity grows with y alone, and is positive everywhere."""
    v, u = np.mgrid[: shape[0], : shape[1]]
    y = v * math.cos(theta) - u * math.sin(theta)
    return 5 + slope * (y - y.min())


def with_holes(values, share=0.1, seed=0):
    return np.where(np.random.default_rng(seed).random(values.shape) < share, 0, values)


@pytest.mark.parametrize("roll_deg", [-30, -3, 3, 30])
def test_the_estimate_on_the_result_is_zero(roll_deg):
    theta = math.radians(roll_deg)
    disparity = with_holes(road(theta))

    found = estimate_roll(disparity, road="all").theta

    assert found == pytest.approx(theta, abs=1e-6)
    # an interpolation between valid neighbours alone leans by a fraction of a pixel: evenly, over many holes
    assert estimate_roll(derotate(disparity, found), road="all").theta == pytest.approx(
        0, abs=math.radians(0.02)
    )


@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf, -3.4e38])
def test_no_data_bleeds_into_no_value(hole):
    values = np.full(SHAPE, 50.0, np.float32)
    values[np.random.default_rng(0).random(SHAPE) < 0.3] = hole

    level = derotate(values, math.radians(20))

    with np.errstate(invalid="ignore"):
        valid = np.isfinite(level) & (level > 0)
    np.testing.assert_allclose(level[valid], 50, rtol=1e-6)
    assert 0.4 < valid.mean() < 0.6
