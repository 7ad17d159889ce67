"""De-rotation levels the road, and neither invents data nor smears the lack of it."""

import math

import numpy as np
import pytest

from rollcli.errors import UsageError
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


@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "i4", "f2", "f4", "f8"])
def test_by_nothing_gives_the_same_pixels(dtype):
    values = with_holes(road(0.1)).astype(dtype)

    level = derotate(values, 0.0)

    assert level.dtype == values.dtype
    np.testing.assert_array_equal(level, values)
    assert not np.shares_memory(level, values)


@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf, -3.4e38])
def test_no_data_bleeds_into_no_value(hole):
    values = np.full(SHAPE, 50.0, np.float32)
    values[np.random.default_rng(0).random(SHAPE) < 0.3] = hole

    level = derotate(values, math.radians(20))

    with np.errstate(invalid="ignore"):
        valid = np.isfinite(level) & (level > 0)
    np.testing.assert_allclose(level[valid], 50, rtol=1e-6)
    assert 0.4 < valid.mean() < 0.6


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 40_000)])
def test_maps_of_any_size_are_turned(shape):
    assert derotate(np.full(shape, 9, np.uint16), 0.001).shape == shape


@pytest.mark.parametrize("roll_deg", [0.0, 7.0, -180.0, 500.0])
def test_an_angle_may_be_in_degrees(roll_deg):
    values = with_holes(road(0.1))
    turn = math.remainder(math.radians(roll_deg), 2 * math.pi)
    np.testing.assert_allclose(derotate(values, roll_deg=roll_deg), derotate(values, turn), atol=1e-9)


def test_an_angle_is_given_once_and_in_radians_up_to_half_a_turn():
    for angles in ({}, {"roll": 0.0, "roll_deg": 0.0}, {"roll": 3.15}, {"roll": -3.15}, {"roll_deg": np.inf}):
        with pytest.raises(UsageError):
            derotate(road(0), **angles)
    for half in (math.pi, -math.pi):
        np.testing.assert_allclose(derotate(road(0), half), road(0)[::-1, ::-1], atol=1e-9)


@pytest.mark.parametrize("shape", [(20, 20), (8, 31), (31, 8)])
@pytest.mark.parametrize("quarters", [-1, 0, 1, 2])
def test_a_result_that_fits_exactly_is_not_enlarged(shape, quarters):
    turned = shape[::-1] if quarters % 2 else shape
    level = derotate(np.full(shape, 7.0), quarters * math.pi / 2, expand=True)
    # as many more pixels on either side: one more where the sides differ by an odd number
    assert level.shape == tuple(a + (b - a) + (b - a) % 2 for a, b in zip(shape, turned, strict=True))


def test_small_disparities_are_data():
    np.testing.assert_array_equal(derotate(np.full((8, 9), 0.25), 0.0), np.full((8, 9), 0.25))
