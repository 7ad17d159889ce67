"""De-rotation, v-disparity and SGBM's lag, pixel by pixel against loops that are slow and plain."""

import math

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.pictures import vdisparity as vdisparity_module
from rollcli.pictures.derotate import derotate
from rollcli.pictures.vdisparity import middle_row, row_offset, v_disparity
from rollcli.stereo.sgbm import LAGS, without_lag


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

    if expand:  # as many more on either side as hold the corners
        for side, other, mine in ((0, 1, 0), (1, 0, 1)):
            needed = shape[side] * abs(math.cos(roll)) + shape[other] * abs(math.sin(roll))
            more = math.ceil((needed - shape[side]) / 2 - 1e-9)
            assert level.shape[mine] == shape[side] + 2 * more
    else:
        assert level.shape == shape
    np.testing.assert_allclose(level, turned(values, roll, level.shape), atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "largest", "valid"),
    [
        ("u2", 65535, False),
        ("i2", 32767, False),
        ("u2", 65534, True),
        ("u1", 255, True),
        ("i4", 65535, True),
        ("f4", 65535, True),
    ],
)
def test_only_the_largest_number_of_16_bits_is_no_data(kind, largest, valid):
    values = np.full((21, 21), largest, kind)
    assert bool(derotate(values, 0.1)[10, 10]) == valid


@pytest.mark.parametrize(
    ("kind", "holes", "written"),
    [
        ("f8", [-5, -2], -5),
        ("f8", [-5, np.inf], np.inf),
        ("f8", [-np.inf, np.inf], np.inf),
        ("f8", [-5, np.nan, np.inf], np.nan),
        ("i2", [-16, -3], -16),
        ("i2", [32767, -3], -3),
        ("u1", [0], 0),
        ("f4", [], 0),
    ],
)
def test_no_data_beside_the_map_is_the_least_that_it_has(kind, holes, written):
    values = np.full((21, 21), 9, kind)
    values[10, 5 : 5 + len(holes)] = holes
    np.testing.assert_array_equal(derotate(values, 0.7)[0, 0], np.array(written, kind))


def test_numbers_of_32_bits_keep_all_of_their_digits():
    large = np.full((9, 9), 2**30 + 1, np.int32)
    assert derotate(large, 0.1)[4, 4] == 2**30 + 1
    assert derotate(large.astype(np.float64) + 0.125, 0.1)[4, 4] == 2**30 + 1.125


@pytest.mark.parametrize("block", [1, 30, 1 << 22])
def test_disparities_are_counted_in_the_bins_that_hold_them(monkeypatch, block):
    monkeypatch.setattr(vdisparity_module, "_BLOCK", block)
    values = np.random.default_rng(2).uniform(-5, 60, (23, 12))
    values[3, 3], values[4] = np.nan, 0
    values[5, :3] = 8.0, 59.999, 70.0
    for top, bins in ((64.0, 32), (50.0, 7)):
        counts = v_disparity(values, bins=bins, max_disparity=top).counts
        expected = np.zeros((23, bins), int)
        for row, column in np.argwhere(np.isfinite(values) & (values > 0)):
            expected[row, min(int(values[row, column] / top * bins), bins - 1)] += 1
        np.testing.assert_array_equal(counts, expected)
    assert v_disparity(values).max_disparity == 71
    assert v_disparity(values).counts.shape == (23, 4 * 71)
    assert v_disparity(np.rint(values)).counts.shape == (23, 71)


@pytest.mark.parametrize("largest", [0.25, 1.0, 1.5, 255.5])
def test_the_last_bin_ends_above_the_largest_disparity(largest):
    histogram = v_disparity(np.array([[largest, 0.1]]))
    assert histogram.max_disparity == math.floor(largest) + 1
    assert histogram.counts.shape[1] == max(256, 4 * histogram.max_disparity)
    with pytest.raises(UsageError):
        v_disparity(np.ones((2, 2)), max_disparity=-1.0)
    assert v_disparity(np.ones((2, 2)), bins=1).counts.tolist() == [[2], [2]]


@pytest.mark.parametrize("theta", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("size", [(1, 1), (31, 20), (30, 21)])
def test_rows_of_the_method_and_of_the_map_are_those_of_its_middle(theta, size):
    width, height = size
    u, v = (width - 1) / 2, (height - 1) / 2
    for row in (0.0, 7.5):
        y = row * math.cos(theta) - u * math.sin(theta)
        assert middle_row(y, theta, width) == pytest.approx(row)
    # the centre stays where it is: its row and y of the method name one place
    assert v + row_offset(theta, width, height) == pytest.approx(v * math.cos(theta) - u * math.sin(theta))


@pytest.mark.parametrize(
    ("rise", "raised"), [(0.05, True), (0.99, True), (1.01, False), (0.0, False), (-0.5, False)]
)
def test_what_rises_like_a_road_is_raised_and_an_edge_is_not(rise, raised):
    v = np.mgrid[:60, :40][0].astype(np.float32)
    surface = 40 + rise * v
    added = without_lag(surface, "sgbm") - surface
    expected = LAGS["sgbm"].most * rise / (rise + LAGS["sgbm"].half_at) if raised else 0
    assert added == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(("height", "raised"), [(12, False), (13, True)])
def test_six_rows_above_and_below_tell_the_rise(height, raised):
    v = np.mgrid[:height, :40][0].astype(np.float32)
    assert ((without_lag(5 + 0.4 * v, "3way") > 5 + 0.4 * v).all()) == raised


def test_beside_a_hole_as_much_is_added_as_elsewhere_and_the_hole_stays():
    surface = 40 + 0.4 * np.mgrid[:80, :90][0].astype(np.float32)
    surface[30:37, 40:52] = 0
    added = without_lag(surface, "sgbm") - surface
    lag = LAGS["sgbm"]
    np.testing.assert_allclose(added[surface > 0], lag.most * 0.4 / (0.4 + lag.half_at), atol=1e-4)
    assert (added[surface == 0] == 0).all()
