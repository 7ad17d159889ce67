"""De-rotation levels the road, and neither invents data nor smears the lack of it."""

import math

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.estimator.estimate import estimate_roll
from rollcli.pictures.derotate import derotate

ROLLS = [0.3, 5, -12.5, 40, -89, 90]
SHAPE = (97, 141)


def road(theta, shape=SHAPE, slope=0.3):
    """A flat road seen by a rig rolled by theta: disparity grows with y alone, and is positive everywhere."""
    v, u = np.mgrid[: shape[0], : shape[1]]
    y = v * math.cos(theta) - u * math.sin(theta)
    return 5 + slope * (y - y.min())


def with_holes(values, share=0.1, seed=0):
    return np.where(np.random.default_rng(seed).random(values.shape) < share, 0, values)


@pytest.mark.parametrize("roll_deg", ROLLS)
def test_rows_of_the_road_become_constant(roll_deg):
    theta = math.radians(roll_deg)

    rows = [row[row > 0][2:-2] for row in derotate(road(theta), theta) if (row > 0).sum() > 40]

    assert len(rows) > 60
    # only along the edge neighbours are missing, and the value leans towards those that are there
    assert np.median([np.ptp(row) for row in rows]) < 1e-9
    assert (np.diff([np.median(row) for row in rows]) > 0).all()


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


@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "i4", "f2", "f4", "f8"])
@pytest.mark.parametrize("expand", [False, True])
def test_every_type_keeps_its_type_and_its_numbers(dtype, expand):
    theta = math.radians(10)
    values = (road(theta) * (256 if dtype in ("u2", "i4") else 1)).astype(dtype)

    level = derotate(values, theta, expand=expand)

    exact = derotate(values.astype(float), theta, expand=expand)
    assert level.dtype == values.dtype
    np.testing.assert_array_equal(level > 0, exact > 0)
    np.testing.assert_allclose(level.astype(float), exact, atol=0.5 if "f" not in dtype else 0.05)


@pytest.mark.parametrize("share", [0.05, 0.75])
@pytest.mark.parametrize("roll_deg", [1, 7, -20, 45, 90])
def test_there_and_back_makes_no_invalid_pixel_valid(roll_deg, share):
    theta = math.radians(roll_deg)
    values = with_holes(road(theta), share)

    back = derotate(derotate(values, theta), -theta)

    assert not (back > 0)[values == 0].any()
    assert (back > 0).sum() > 0.3 * (values > 0).sum()


@pytest.mark.parametrize("roll_deg", [1, 7, -20, 44])
def test_there_and_back_stays_within_the_error_of_interpolation(roll_deg):
    theta, slope = math.radians(roll_deg), 0.3
    values = with_holes(road(theta, slope=slope))

    back = derotate(derotate(values, theta), -theta)

    errors = np.abs(back - values)[back > 0]
    assert np.median(errors) < 0.02 * slope
    assert errors.max() < 2 * slope  # each way at most the distance to a valid neighbour


def test_there_and_back_gives_a_map_without_holes_exactly():
    theta = math.radians(8)
    values = road(theta)

    back = derotate(derotate(values, theta), -theta)

    inner = back > 0
    inner[:2] = inner[-2:] = inner[:, :2] = inner[:, -2:] = False
    edge = np.zeros_like(inner)
    edge[3:-3, 3:-3] = True
    np.testing.assert_allclose(back[inner & edge], values[inner & edge], atol=1.0)
    assert np.median(np.abs(back - values)[inner]) < 1e-9


@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf, -3.4e38])
def test_no_data_bleeds_into_no_value(hole):
    values = np.full(SHAPE, 50.0, np.float32)
    values[np.random.default_rng(0).random(SHAPE) < 0.3] = hole

    level = derotate(values, math.radians(20))

    with np.errstate(invalid="ignore"):
        valid = np.isfinite(level) & (level > 0)
    np.testing.assert_allclose(level[valid], 50, rtol=1e-6)
    assert 0.4 < valid.mean() < 0.6


@pytest.mark.parametrize(
    ("dtype", "hole", "written"),
    [
        ("f4", np.nan, np.nan),
        ("f4", -1, -1),
        ("f4", np.inf, np.inf),
        ("i2", -16, -16),
        ("u2", 0, 0),
        ("u2", 65535, 0),
    ],
)
def test_no_data_is_written_as_the_map_writes_it(dtype, hole, written):
    values = np.full(SHAPE, 50, dtype)
    values[40:60, 40:60] = hole

    level = derotate(values, math.radians(30))

    np.testing.assert_array_equal(level[0, 0], np.array(written, dtype))
    np.testing.assert_array_equal(np.unique(level[~np.isclose(level, 50)]), np.array([written], dtype))


def test_further_values_are_no_data():
    values = np.full(SHAPE, 50, np.uint16)
    values[:, 60:80] = 200

    level = derotate(values, math.radians(5), invalid=[200.0])

    assert set(np.unique(level)) == {0, 50}


def test_a_value_beyond_the_type_is_no_trouble():
    values = np.full(SHAPE, 50, np.float16)

    assert (derotate(values, 0.1, invalid=[1e30, -3.4e38]) > 0).any()


@pytest.mark.parametrize("roll_deg", [3, 30, -60, 90])
def test_an_enlarged_result_keeps_the_corners_and_the_centre(roll_deg):
    theta = math.radians(roll_deg)
    values = np.full(SHAPE, 7.0)

    level = derotate(values, theta, expand=True)

    assert (level > 0).sum() == pytest.approx(values.size, rel=0.05)
    for side, edge in ((level[0], level[1]), (level[-1], level[-2]), (level[:, 0], level[:, 1])):
        assert (side > 0).sum() <= (edge > 0).sum()
    small = derotate(values, theta)
    top, left = ((a - b) // 2 for a, b in zip(level.shape, small.shape, strict=True))
    if top >= 0 and left >= 0:
        np.testing.assert_array_equal(level[top : top + SHAPE[0], left : left + SHAPE[1]], small)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 40_000)])
def test_maps_of_any_size_are_turned(shape):
    assert derotate(np.full(shape, 9, np.uint16), 0.001).shape == shape


def test_what_is_no_map_is_refused():
    for values, roll in (
        (np.ones((2, 2, 2)), 0.1),
        (np.ones((2, 2), complex), 0.1),
        (np.ones((2, 2)), np.nan),
    ):
        with pytest.raises(UsageError, match="cannot rotate"):
            derotate(values, roll)


def test_a_map_whose_only_invalid_numbers_are_too_large_gets_a_border_of_zeros():
    stored = np.full((20, 30), 320, np.int16)
    stored[4, 5] = np.iinfo(np.int16).max
    assert derotate(stored, math.radians(30))[0, 0] == 0


@pytest.mark.parametrize("shape", [(20, 20), (8, 31), (31, 8)])
@pytest.mark.parametrize("quarters", [-1, 0, 1, 2])
def test_a_result_that_fits_exactly_is_not_enlarged(shape, quarters):
    turned = shape[::-1] if quarters % 2 else shape
    level = derotate(np.full(shape, 7.0), quarters * math.pi / 2, expand=True)
    # as many more pixels on either side: one more where the sides differ by an odd number
    assert level.shape == tuple(a + (b - a) + (b - a) % 2 for a, b in zip(shape, turned, strict=True))
