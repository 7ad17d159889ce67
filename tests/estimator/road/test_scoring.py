"""Scores, costs and fits of planes are what their documentation says, pixel by pixel in double precision."""

import dataclasses
import math

import numpy as np
import pytest

from rollcli.estimator.road.find import PlaneScorer, find_road, slope_weights
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.sample import NO_SLOPE, rising, take_sample
from rollcli.estimator.tuning import ROAD_TUNING, SampleTuning, ScoreTuning
from tests.estimator.synthetic_maps import flat_road

TUNING = ScoreTuning(  # other numbers than the defaults, each of them felt
    corridor=0.8,
    fits=1,
    first_fit_width=3.0,
    below_penalty=0.6,
    off_slope_weight=0.3,
    slope_share=0.5,
    beside_weight=0.1,
    nearness=1.2,
    horizon=0.7,
    least_corridor=0.1,
    least_core=0.05,
)
FEWER = SampleTuning(coarse_pixels=700)


@pytest.fixture(scope="module")
def sample():
    """A road with noise, a wall beside it and holes."""
    rng = np.random.default_rng(3)
    road = flat_road(4, width=320, height=240, focal=280.0)
    disparity = np.where(road > 0, np.maximum(road + rng.normal(0, 0.2, road.shape), 0.01), 0)
    disparity[100:200, 230:300] = 25.0
    disparity[rng.random(road.shape) < 0.1] *= 0.4
    return take_sample(disparity, tuning=dataclasses.replace(ROAD_TUNING, sample=FEWER, score=TUNING))


@pytest.fixture(scope="module")
def planes(sample):
    """The road, others near it, and one that rises upward."""
    road = flat_road(4, width=320, height=240, focal=280.0)
    v, u = np.mgrid[:240, :320]
    x, y = (u - sample.grid.centre_u) / sample.grid.scale, (v - sample.grid.centre_v) / sample.grid.scale
    design = np.stack([np.ones(x.shape), x, y], axis=-1)[road > 0]
    c0, c1, c2 = np.linalg.lstsq(design, road[road > 0], rcond=None)[0]
    others = [(c0, c1, c2), (c0 + 0.5, c1, c2), (c0 - 2, c1 + 3, c2), (c0, c1 - 4, 0.8 * c2), (30, 1, -9)]
    return np.array(others, np.float32)


def laid_out(sample):
    coarse = sample.coarse
    return (np.asarray(each, float) for each in (coarse.x, coarse.y, coarse.d, coarse.tolerance))


def places(plane, x, y, d, sample):
    """The weights of a plane's corridor and its core, more for what is near, without the slopes."""
    model = RoadModel.of_plane(*plane.astype(float))
    side = model.side(model.across(x, y), d)
    near = np.minimum(d, 1.2 * sample.typical)
    near /= near.mean()
    corridor = np.exp(-((side / 0.8) ** 2))
    core = np.exp(-8 * (side / 0.8) ** 2)
    return near * (0.1 + 0.9 * (corridor + core) / 2), near * core


def costs(plane, x, y, d, tolerance, coherence):
    """The squared distance in tolerances: at most 1 above the plane, below it more for coherent pixels."""
    off = (plane[0] + plane[1] * x + plane[2] * y - d) / tolerance
    return np.where(off > 0, np.minimum(off**2, 1 + 0.6 * coherence), np.minimum(off**2, 1))


def test_slopes_agree_by_the_better_of_each_pair():
    rng = np.random.default_rng(1)
    slopes = rng.normal(0, 9, (4, 30)).astype(np.float32)
    slopes[0, ::3] = slopes[3, ::4] = NO_SLOPE
    c1, c2, noise = 2.0, 12.0, 1.5
    weights = slope_weights(slopes, noise, np.array([[7, c1, c2]], np.float32), TUNING)
    left, right, up, down = slopes.astype(float)
    off = np.minimum(abs(left - c1), abs(right - c1)) ** 2 + np.minimum(abs(up - c2), abs(down - c2)) ** 2
    expected = 0.3 + 0.7 * np.exp(-off / (2 * (0.5**2 * (c1**2 + c2**2) + noise**2)))
    np.testing.assert_allclose(weights[0], expected, rtol=1e-5)


def test_a_pixel_without_neighbours_has_the_weight_of_one_off_the_slope():
    slopes = np.full((4, 1), NO_SLOPE)
    assert slope_weights(slopes, 1.0, np.array([[7, 2, 12]], np.float32), TUNING) == np.float32(0.3)


def test_the_score_is_the_mean_of_what_lies_on_the_plane_in_corridor_and_core(sample, planes):
    x, y, d, tolerance = laid_out(sample)
    found = PlaneScorer.of(sample).scores(planes)
    for score, plane in zip(found, planes, strict=True):
        agreeing = slope_weights(sample.coarse.slopes, sample.slope_noise, plane[None], TUNING)[0]
        more = costs(plane, x, y, d, tolerance, sample.coarse.coherence) - 1
        gained = -np.where(more < 0, agreeing * more, more)
        corridor, core = places(plane, x, y, d, sample)
        shares = [
            (place @ gained) / (place @ agreeing + least * len(x))
            for place, least in ((corridor, 0.1), (core, 0.05))
        ]
        horizon = plane[0] / math.hypot(plane[1], plane[2])
        expected = np.mean(shares)
        expected /= 1 + (horizon / 0.7) ** 2 if expected > 0 else 1
        assert score == pytest.approx(expected, rel=1e-3, abs=1e-5)
    assert found[0] > 0 > found[-1]


@pytest.mark.parametrize("fits", [1, 2])
def test_a_plane_is_fitted_to_the_pixels_on_it_by_weighted_least_squares(sample, planes, fits):
    x, y, d, tolerance = laid_out(sample)
    scorer = dataclasses.replace(PlaneScorer.of(sample), tuning=dataclasses.replace(TUNING, fits=fits))
    found = scorer.fitted(planes[:4])
    for fitted, plane in zip(found, planes[:4], strict=True):
        agreeing = slope_weights(sample.coarse.slopes, sample.slope_noise, plane[None], TUNING)[0]
        corridor, _ = places(plane, x, y, d, sample)
        expected = plane
        for width in (3.0, 1.0)[:fits]:
            off = (expected[0] + expected[1] * x + expected[2] * y - d) / tolerance
            weights = agreeing * corridor * np.maximum(0, 1 - (off / width) ** 2)
            root = np.sqrt(weights) / tolerance
            design = np.stack([np.ones_like(x), x, y], axis=1) * root[:, None]
            expected = np.linalg.lstsq(design, d * root, rcond=None)[0]
        np.testing.assert_allclose(fitted, expected, rtol=1e-3, atol=0.01)


def test_the_first_costs_are_those_of_pixels_ahead_of_a_usual_plane(sample, planes):
    x, y, d, tolerance = laid_out(sample)
    ahead = 0.1 + 0.9 * np.exp(-((x * np.sort(planes[:, 2])[len(planes) // 2] / d / 0.8) ** 2))
    weights = ahead * np.where(rising(sample.coarse.slopes), 1, 0.3)
    expected = [weights @ costs(plane, x, y, d, tolerance, sample.coarse.coherence) for plane in planes]
    np.testing.assert_allclose(PlaneScorer.of(sample).first_costs(planes, len(x)), expected, rtol=1e-4)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_near_the_bound_those_fits_that_stay_within_it_compete(seed):
    road = flat_road(5, width=640, height=480, focal=560.0)
    noise = np.random.default_rng(seed).normal(0, 0.5, road.shape)
    noisy = take_sample(np.where(road > 1, np.maximum(road + noise, 0.01), 0))
    bounded, free = (find_road(noisy, math.radians(bound), 0) for bound in (5, 45))
    assert abs(bounded.model.theta) <= math.radians(5)
    assert bounded.score > 0.98 * free.score


def test_no_weight_is_denormal_since_these_take_ten_times_as_long(sample, planes):
    scorer = PlaneScorer.of(sample)
    far = dataclasses.replace(scorer, bearings=scorer.bearings * 40)
    for weights in far._weights(planes):
        assert weights.min() > np.finfo(np.float32).tiny
