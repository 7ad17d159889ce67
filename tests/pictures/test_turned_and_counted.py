"""De-rotation and v-disparity, pixel by pixel against loops that are slow and plain, and on roads."""

import math

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.pictures import vdisparity as vdisparity_module
from rollcli.pictures.derotate import derotate
from rollcli.pictures.vdisparity import MiddleColumn, v_disparity
from tests.run_cli import road_map


def nearest(value):
    return math.floor(value + 0.5)


def turned(values, roll, size):
    """Each pixel from the valid ones of the four around where it comes from, as the docstring says."""
    (height, width), (rows, columns) = values.shape, size
    cosine, sine = math.cos(roll), math.sin(roll)
    result = np.zeros(size)

    def at(v, u):
        return values[v, u] if 0 <= v < height and 0 <= u < width else 0.0

    for row in range(rows):
        for column in range(columns):
            x, y = column - (columns - 1) / 2, row - (rows - 1) / 2
            u = cosine * x - sine * y + (width - 1) / 2
            v = sine * x + cosine * y + (height - 1) / 2
            if at(nearest(v), nearest(u)) <= 0:
                continue
            top, left = math.floor(v), math.floor(u)
            near = [
                (top + a, left + b, 1 - abs(v - top - a), 1 - abs(u - left - b))
                for a in (0, 1)
                for b in (0, 1)
            ]
            known = [(at(j, i), down * right) for j, i, down, right in near if at(j, i) > 0]
            result[row, column] = sum(value * share for value, share in known) / sum(
                share for _, share in known
            )
    for v in range(height):
        for u in range(width):
            if values[v, u] <= 0:
                x, y = u - (width - 1) / 2, v - (height - 1) / 2
                row = nearest(cosine * y - sine * x + (rows - 1) / 2)
                column = nearest(cosine * x + sine * y + (columns - 1) / 2)
                if 0 <= row < rows and 0 <= column < columns:
                    result[row, column] = 0
    return result


@pytest.mark.parametrize("expand", [False, True])
@pytest.mark.parametrize(
    ("shape", "roll_deg"), [((17, 24), 11.0), ((24, 17), -38.0), ((9, 30), 90.0), ((6, 7), 171.0)]
)
def test_each_pixel_of_a_turned_map_is_that_of_its_definition(shape, roll_deg, expand):
    rng = np.random.default_rng(4)
    values = np.where(rng.random(shape) < 0.2, 0, rng.uniform(1, 60, shape))
    roll = math.radians(roll_deg)

    level = derotate(values, roll, expand=expand)

    for side, other in ((0, 1), (1, 0)):  # enlarged by as many more on either side as hold the corners
        needed = shape[side] * abs(math.cos(roll)) + shape[other] * abs(math.sin(roll))
        more = expand * math.ceil((needed - shape[side]) / 2 - 1e-9)
        assert level.shape[side] == shape[side] + 2 * more
    np.testing.assert_allclose(level, turned(values, roll, level.shape), atol=1e-9)


@pytest.mark.parametrize("block", [1, 30, 1 << 22])
def test_disparities_are_counted_in_the_bins_that_hold_them(monkeypatch, block):
    monkeypatch.setattr(vdisparity_module, "_BLOCK", block)
    values = np.random.default_rng(2).uniform(-5, 60, (23, 12))
    values[3, 3], values[4] = np.nan, 0
    values[5, :3] = 8.0, 59.999, 70.0
    for top, bins in ((64.0, 32), (50.0, 7), (70.0, 1)):
        counts = v_disparity(values, bins=bins, max_disparity=top).counts
        expected = np.zeros((23, bins), int)
        for row, column in np.argwhere(np.isfinite(values) & (values > 0)):
            expected[row, min(int(values[row, column] / top * bins), bins - 1)] += 1
        np.testing.assert_array_equal(counts, expected)
    assert v_disparity(values).max_disparity == 71
    assert v_disparity(values, max_disparity=1e308).counts.shape == (23, 1024)
    assert [v_disparity(each).counts.shape for each in (values, np.rint(values))] == [(23, 4 * 71), (23, 71)]
    assert (v_disparity([range(22)]).counts == [[0] + 21 * [1]]).all()  # where 15 / 22 * 22 is less than 15


@pytest.mark.parametrize("outlier", [5_000, 65_535.5, 1e9])
def test_one_pixel_far_beyond_leaves_all_others_a_bin_each_quarter_pixel(outlier):
    values = np.random.default_rng(2).uniform(1, 60, (40, 50))
    values[3, 3] = outlier

    found = v_disparity(values)

    assert found.counts.shape[1] >= 4 * found.max_disparity
    assert (found.counts[:, -1] == [each == 3 for each in range(40)]).all()
    assert (found.counts.sum(axis=1) == 50).all()
    assert v_disparity(np.where(values > 60, 500, values)).max_disparity == 128
    near = np.where(np.arange(40)[:, None] < 2, 300, values)  # a twentieth of the map is no outlier
    assert v_disparity(np.where(values > 60, 0, near)).max_disparity == 301


SHAPE = (97, 141)


@pytest.mark.parametrize("roll_deg", [-30, -3, 3, 30])
def test_the_estimate_on_the_result_is_zero(roll_deg):
    theta = math.radians(roll_deg)
    holes = np.random.default_rng(0).random(SHAPE) < 0.1
    disparity = np.where(holes, 0, road_map(theta, width=141, height=97, noise=0))

    found = estimate_roll(disparity, Request(road="all")).theta

    assert found == pytest.approx(theta, abs=1e-6)
    # an interpolation between valid neighbours alone leans by a fraction of a pixel: evenly, over many holes
    level = estimate_roll(derotate(disparity, found), Request(road="all"))
    assert level.theta == pytest.approx(0, abs=math.radians(0.02))


HOLES = [("f4", hole) for hole in (0.0, -1.0, np.nan, np.inf, -3.4e38)]
LARGEST = [(kind, np.iinfo(kind).max) for kind in ("<u2", ">u2", "<i2", ">i2")]


@pytest.mark.parametrize(("kind", "hole"), HOLES + LARGEST)
def test_no_data_bleeds_into_no_value(kind, hole):
    values = np.full(SHAPE, 50, kind)
    values[np.random.default_rng(0).random(SHAPE) < 0.3] = hole

    level = derotate(values, math.radians(20))

    with np.errstate(invalid="ignore"):
        valid = np.isfinite(level) & (level > 0)
    np.testing.assert_allclose(level[valid], 50, rtol=1e-6)
    assert 0.4 < valid.mean() < 0.6


@pytest.mark.parametrize("roll_deg", [-20, 0, 3, 15])
def test_the_parabola_lies_on_the_road_of_the_derotated_map(roll_deg):
    theta = math.radians(roll_deg)
    v, u = np.mgrid[:200, :300]
    y = v * math.cos(theta) - u * math.sin(theta)
    disparity = 30 + 0.2 * y + 2e-4 * y**2
    estimate = estimate_roll(disparity, Request(road="all"))

    level = derotate(disparity, estimate.theta)
    y = np.arange(200) + MiddleColumn.of_level(estimate.theta, 300, 200).start

    np.testing.assert_allclose(level[:, 150], np.polyval(estimate.alpha[::-1], y), atol=0.01)
