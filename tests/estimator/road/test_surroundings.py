"""The mean of a pixel and those around it has less of what matching gets wrong, none of what is beside.

And those around it tell whether the map rises there as a plane does.
"""

import dataclasses
import itertools
import math

import cv2
import numpy as np
import pytest

from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import look_around
from rollcli.estimator.tuning import ROAD_TUNING

V, U = np.mgrid[:480, :640]
ROAD = 30 + 0.3 * (V - 240) - 0.03 * (U - 320)  # px; 5.7 degrees of roll
ROAD = np.where(ROAD > 2, ROAD, 0)
AROUND = ((3, 2), (-3, -2), (2, -3), (-2, 3))  # px, where every fifth row and column is sampled


def road_plane(sample):
    """The plane of `ROAD` on a sample's grid."""
    unit = sample.grid.scale
    return np.array([30.0 + 0.3 * (239.5 - 240) - 0.03 * (319.5 - 320), -0.03 * unit, 0.3 * unit])


def mean_of(disparity, mask=None, scale=1):
    """The sample of a map, the means of all its pixels, and what a road `scale` times as near has there."""
    sample = take_sample(disparity, mask)
    every = np.arange(len(sample.d))
    plane = scale * road_plane(sample)
    mean = look_around(sample, plane, every).mean
    return sample, mean, plane[0] + plane[1] * sample.x + plane[2] * sample.y


def spread(values):
    return math.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_plane_stays_as_it_is(dtype):
    _, mean, road = mean_of(ROAD.astype(dtype))

    np.testing.assert_allclose(mean, road, atol=1e-4)


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float16])
def test_a_map_of_another_type_has_the_means_of_its_values(dtype):
    stored = np.rint(ROAD * 4).astype(dtype)

    _, mean, _ = mean_of(stored, scale=4)
    _, same, _ = mean_of(np.asfortranarray(stored.astype(np.float32)), scale=4)

    np.testing.assert_array_equal(mean, same)


@pytest.mark.parametrize("width", [1, 3])
def test_noise_has_the_spread_of_the_mean_of_five(width):
    # smoothed over width by width pixels, what is (dv, du) apart has this correlation
    def correlation(one, other):
        return np.prod([max(0.0, 1 - abs(a - b) / width) for a, b in zip(one, other, strict=True)])

    five = ((0, 0), *AROUND)
    expected = math.sqrt(sum(correlation(*pair) for pair in itertools.product(five, five))) / 5
    white = np.random.default_rng(3).normal(0, 0.05 * width, ROAD.shape)
    noise = cv2.blur(white, (width, width))

    sample, mean, road = mean_of(np.where(ROAD > 0, ROAD + noise, 0))

    assert spread(mean - road) / spread(sample.d - road) == pytest.approx(expected, rel=0.05)


def test_whole_pixels_are_rounded_less():
    sample, mean, road = mean_of(np.rint(ROAD))

    assert spread(sample.d - road) == pytest.approx(1 / math.sqrt(12), rel=0.05)
    assert spread(mean - road) < 0.5 / math.sqrt(12)


@pytest.mark.parametrize("height", [-0.3, -0.06, 0.06, 0.3])
def test_a_kerb_or_a_car_is_not_smeared(height):
    # what lies higher by so many camera heights is nearer by that share
    sample, mean, _ = mean_of(np.where(U > 400, ROAD * (1 + height), ROAD))

    # far away the step is less than the noise that is allowed for
    seen = 0.9 * abs(height) * sample.d > sample.tolerance
    assert np.count_nonzero(seen) > 4000
    # its own slope is a little other than the road's, 0.3 px for each row, over three rows
    np.testing.assert_allclose(mean[seen], sample.d[seen], atol=abs(height) * 0.3 * 3)


@pytest.mark.parametrize("nothing", [0, math.nan, -1, 1e14])
def test_no_data_counts_for_nothing(nothing):
    holes = np.random.default_rng(4).random(ROAD.shape) < 0.4
    holes &= V % 5 != 0  # every fifth row is sampled

    _, mean, road = mean_of(np.where(holes, nothing, ROAD))

    np.testing.assert_allclose(mean, road, atol=1e-4)


@pytest.mark.parametrize(
    "end", [321, 322, 323, 324]
)  # beside, and up to three beside, a column that is sampled
def test_pixels_outside_a_mask_do_not_count(end):
    mask = end > U
    other = np.where(mask, ROAD, ROAD * 1.01)  # nearly the same

    np.testing.assert_array_equal(mean_of(ROAD, mask)[1], mean_of(other, mask)[1])


@pytest.mark.parametrize(
    ("size", "far"), [((480, 640), (3, 2)), ((80, 100), (3, 2)), ((16, 500), (2, 1)), ((2160, 3840), (12, 6))]
)
def test_those_around_are_as_far_away_as_neighbours_are(size, far):
    road = np.repeat(40 + 0.1 * np.arange(size[0], dtype=np.float32)[:, None], size[1], 1)
    sample = take_sample(road)
    plane = np.array([40 + 0.1 * sample.grid.centre_v, 0, 0.1 * sample.grid.scale])
    one = np.array([len(sample.d) // 2])
    row, column = divmod(int(sample.places[one[0]]), size[1])

    def felt(down, right):
        other = road.copy()
        other[row + down, column + right] += 0.5 * sample.tolerance[one[0]]
        changed = dataclasses.replace(sample, disparity=other)
        return look_around(changed, plane, one).mean[0] > sample.d[one[0]] + 1e-3

    long, short = far
    around = {(long, short), (-long, -short), (short, -long), (-short, long)}
    window = range(-long, long + 1)
    assert {each for each in itertools.product(window, window) if each != (0, 0) and felt(*each)} == around


def test_slopes_agree_by_the_better_one_of_each_pair_of_opposite_sides():
    rng = np.random.default_rng(6)
    disparity = (60 + 0.2 * V + 0.05 * U + rng.normal(0, 0.4, V.shape)).astype(np.float32)
    disparity[rng.random(V.shape) < 0.3] = 0
    sample = take_sample(disparity)
    slope = np.array([0.2, 0.05])  # down, right, px per px
    unit = sample.grid.scale
    plane = np.array([60 + slope @ (sample.grid.centre_v, sample.grid.centre_u), 0.05 * unit, 0.2 * unit])
    every = np.arange(len(sample.d))

    found = look_around(sample, plane, every).agreement

    row, column = sample.places // 640, sample.places % 640
    off = []
    for down, right in AROUND:
        there = disparity[row + down, column + right].astype(float)
        apart = abs(there - sample.d - slope @ (down, right)) / math.hypot(down, right)
        off.append(np.where(there > 0, apart, np.inf))
    squares = np.minimum(off[0], off[1]) ** 2 + np.minimum(off[2], off[3]) ** 2
    tuning = ROAD_TUNING.score
    variance = tuning.slope_share**2 * slope @ slope + sample.noise**2 / (3**2 + 2**2)
    least = tuning.off_slope_weight
    np.testing.assert_allclose(
        found, least + (1 - least) * np.exp(-squares / (2 * variance)), rtol=1e-3, atol=1e-5
    )
    assert found.min() == np.float32(least) < 0.9 < found.max()


def test_where_a_wall_crosses_the_plane_pixels_weigh_less():
    wall = np.where(U > 400, 40.0, ROAD)
    sample = take_sample(wall.astype(np.float32))
    unit = sample.grid.scale
    plane = road_plane(sample)
    on_it = np.abs(plane @ [np.ones_like(sample.x), sample.x, sample.y] - sample.d) < 0.2
    on_wall = sample.x * unit > 410 - 319.5

    agreement = look_around(sample, plane, np.arange(len(sample.d))).agreement

    assert np.count_nonzero(on_it & on_wall) > 5
    assert (
        agreement[on_it & on_wall].max()
        < 0.5
        < 0.99
        < agreement[on_it & (sample.x * unit < 390 - 319.5)].min()
    )
