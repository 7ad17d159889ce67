"""The mean of a pixel and those around it has less of what matching gets wrong, none of what is beside."""

import itertools
import math

import cv2
import numpy as np
import pytest

from rollcli.estimator.road.average import averaged
from rollcli.estimator.road.subsample import take_sample

V, U = np.mgrid[:480, :640]
ROAD = 30 + 0.3 * (V - 240) - 0.03 * (U - 320)  # px; 5.7 degrees of roll
ROAD = np.where(ROAD > 2, ROAD, 0)
AROUND = ((0, 0), (2, 1), (-2, -1), (1, -2), (-1, 2))  # px, where every fifth row and column is sampled


def mean_of(disparity, mask=None, scale=1):
    """The sample of a map, the means of all its pixels, and what a road `scale` times as near has there."""
    sample = take_sample(disparity, mask)
    every = np.arange(len(sample.d))
    unit = sample.grid.scale
    plane = scale * np.array([30.0 + 0.3 * (239.5 - 240) - 0.03 * (319.5 - 320), -0.03 * unit, 0.3 * unit])
    return sample, averaged(sample, plane, every), plane[0] + plane[1] * sample.x + plane[2] * sample.y


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

    expected = math.sqrt(sum(correlation(*pair) for pair in itertools.product(AROUND, AROUND))) / 5
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
    # its own slope is a little other than the road's, 0.3 px for each row, over two rows
    np.testing.assert_allclose(mean[seen], sample.d[seen], atol=abs(height) * 0.3 * 2)


@pytest.mark.parametrize("nothing", [0, math.nan, -1, 1e14])
def test_no_data_counts_for_nothing(nothing):
    holes = np.random.default_rng(4).random(ROAD.shape) < 0.4
    holes &= V % 5 != 0  # every fifth row is sampled

    _, mean, road = mean_of(np.where(holes, nothing, ROAD))

    np.testing.assert_allclose(mean, road, atol=1e-4)


@pytest.mark.parametrize("end", [321, 322, 323])  # beside, and two beside, a column that is sampled
def test_pixels_outside_a_mask_do_not_count(end):
    mask = end > U
    other = np.where(mask, ROAD, ROAD * 1.01)  # nearly the same

    np.testing.assert_array_equal(mean_of(ROAD, mask)[1], mean_of(other, mask)[1])


def test_where_every_pixel_is_sampled_there_is_nothing_to_average():
    small = ROAD[::6, ::6]
    noisy = small + np.random.default_rng(5).normal(0, 0.1, small.shape)
    sample = take_sample(np.where(small > 0, noisy, 0))

    every = np.arange(len(sample.d))

    assert sample.spacing == (1, 1)
    np.testing.assert_array_equal(averaged(sample, np.array([30.0, -1.0, 10.0]), every), sample.d)
