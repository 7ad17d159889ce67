"""The robust fit is one of weighted least squares, round by round; its weights end where they should."""

import dataclasses
import math

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.road.find import Road
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import AHEAD, ALONE, PLACE, TOLERANCE, D, NearPixels, X, Y, look_around
from rollcli.estimator.tuning import ROAD_TUNING, FitTuning
from tests.estimator.synthetic_maps import flat_road

TUNING = FitTuning(independent_pixels=50, camber=0.02, biweight_spread=1.3, beside=0.05)
ROAD = RoadModel(0.12, (30.0, 60.0, 5.0))


def near_pixels(spread=0.1, count=900, tuning=TUNING, road=ROAD, least_width=0.2):
    """Pixels scattered around a road by so many tolerances, each weighted by its place."""
    rng = np.random.default_rng(9)
    x, y = rng.uniform(-0.9, 0.9, count), rng.uniform(0.05, 0.6, count)
    tolerance, place, ahead = rng.uniform(0.4, 0.9, count), rng.uniform(0.3, 1, count), rng.random(count)
    d = road.disparity(x, y) + spread * tolerance * rng.normal(size=count)
    rows = np.empty((7, count), np.float32)
    rows[X], rows[Y], rows[D], rows[ALONE], rows[TOLERANCE] = x, y, d, d, tolerance
    rows[PLACE], rows[AHEAD] = place, ahead
    return NearPixels(rows, stride=1, least_width=least_width, tuning=tuning)


def with_row(near, row, values):
    """The same pixels with other values of one kind."""
    rows = near.rows.copy()
    rows[row] = values
    return dataclasses.replace(near, rows=rows)


def in_rounds(near, rounds):
    """The same pixels, which are to be fitted in so many rounds."""
    return dataclasses.replace(near, tuning=dataclasses.replace(near.tuning, rounds=rounds))


def biweights(near, road, limit, bulge=None):
    """Tukey's weights around a road, and how many tolerances it is off; its bulge may be another road's."""
    x, y = near.rows[X].astype(float), near.rows[Y].astype(float)
    if bulge is None:
        there = road.disparity(x, y)
    else:
        there = road._replace(camber=0.0).disparity(x, y) + road.camber * bulge
    off = (there - near.rows[D]) / near.rows[TOLERANCE]
    return near.rows[PLACE] * np.where(abs(off) < limit, (1 - (off / limit) ** 2) ** 2, 0), off


def usual_width(near, off, weights):
    """The standard deviation ahead, times 3 on an even road, up to 3.5 on an uneven one."""
    ahead = weights * (near.rows[AHEAD] + 0.05)
    spread = 1.3 * math.sqrt(np.average(off**2, weights=ahead))
    return spread * np.interp(spread, [0.35, 0.55], [3, 3.5])


def derivatives(road, near):
    """Those of the disparity by a0, a1, a2 and theta, and the bulge of a camber of 1."""
    x, y, step = near.rows[X].astype(float), near.rows[Y].astype(float), 1e-5

    def disparity(a0, a1, a2, turned, camber):
        alpha = (road.alpha[0] + a0, road.alpha[1] + a1, road.alpha[2] + a2)
        return RoadModel(road.theta + turned, alpha, camber).disparity(x, y)

    steps = step * np.eye(5)
    return np.stack([(disparity(*each) - disparity(*-each)) / (2 * step) for each in steps], axis=1)


@pytest.mark.parametrize("spread", [0.1, 0.33, 0.5])
@pytest.mark.parametrize("parabolic", [True, False])
def test_each_round_is_a_weighted_least_squares_fit_about_the_one_before(spread, parabolic):
    near = near_pixels(spread)
    start = RoadModel(0.1, (30.1, 61.0, 5.0 if parabolic else 0.0))
    bulge = derivatives(start, near)[:, 4]  # stays that of the start
    model, limit = start, 2.0
    for rounds in (1, 2):
        found = in_rounds(near, rounds).fit(start, parabolic=parabolic)
        weights, off = biweights(near, model, limit, bulge)
        design = derivatives(model._replace(camber=0.0), near)
        design[:, 2] *= parabolic
        design[:, 4] = bulge
        root = np.sqrt(weights)
        # the pixels' variance over the prior's, as often as neighbours repeat each other
        variance = np.average((off * near.rows[TOLERANCE]) ** 2, weights=weights)
        prior = variance * max(1, weights.sum() / 50) / 0.02**2
        assert found.camber_precision == pytest.approx(prior, rel=2e-3)
        # all but theta enter as they are: they are solved for anew, and theta's change with them
        rows = np.vstack([design * root[:, None], [0, 0, 0, 0, math.sqrt(prior)]])
        a0, a1, a2, turned, camber = np.linalg.lstsq(rows, np.append(near.rows[D] * root, 0), rcond=None)[0]
        model = RoadModel(model.theta + turned, (a0, a1, a2), camber)
        np.testing.assert_allclose(found.model.alpha, model.alpha, rtol=2e-3, atol=5e-3)
        assert found.model.theta == pytest.approx(model.theta, abs=2e-5)
        assert found.model.camber == pytest.approx(camber, abs=2e-5)
        _, off = biweights(near, model, limit, bulge)
        limit = max(0.2, min(limit, usual_width(near, off, weights)))
        assert found.limit == pytest.approx(limit, rel=2e-3)
        np.testing.assert_allclose(np.sqrt(found.squares), abs(off), atol=5e-3)
        np.testing.assert_allclose(found.bulge, bulge, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("parabolic", [True, False])
def test_the_lane_is_a_fit_of_its_middle_without_camber(parabolic):
    near = near_pixels(0.33)
    start = RoadModel(0.1, (30.1, 61.0, 0.0))
    weights, _ = biweights(near, start, 2.0)
    design = derivatives(start, near)[:, :4]
    design[:, 2] *= parabolic
    root = np.sqrt(weights * near.rows[AHEAD] ** 4)
    *alpha, turned = np.linalg.lstsq(design * root[:, None], near.rows[D] * root, rcond=None)[0]
    lane = near.lane(start, parabolic=parabolic)
    np.testing.assert_allclose(lane.alpha, alpha, rtol=2e-3, atol=5e-3)
    assert lane.theta == pytest.approx(0.1 + turned, abs=2e-5)
    assert lane.camber == 0


def test_a_round_turns_the_road_by_no_more_than_it_may():
    for sign in (-1, 1):
        far = RoadModel(0.12 + 0.5 * sign, ROAD.alpha)
        wide = near_pixels(tuning=dataclasses.replace(TUNING, start_width=200.0))
        assert in_rounds(wide, 1).fit(far, parabolic=True).model.theta == pytest.approx(0.12 + 0.3 * sign)


@pytest.mark.parametrize("least", [0.2, 1.0])
def test_no_width_is_less_than_the_least(least):
    near = near_pixels(spread=1e-4, least_width=least)
    assert near.fit(ROAD, parabolic=True).limit == least


@pytest.mark.parametrize(("count", "enough"), [(29, False), (30, True)])
def test_a_surface_needs_30_pixels(count, enough):
    near = near_pixels(spread=0.01, count=count)
    fit = near.fit(ROAD, parabolic=True)
    if enough:
        assert np.count_nonzero(near.weights(fit)) == 30
    else:
        with pytest.raises(EstimationError, match="hardly a pixel lies"):
            near.weights(fit)


def test_a_road_without_any_pixel_on_it_is_none():
    far = ROAD._replace(alpha=(90.0, 60.0, 5.0))
    for fitted in (near_pixels().lane, near_pixels().fit):
        with pytest.raises(EstimationError, match="hardly a pixel lies"):
            fitted(far, parabolic=True)


def test_where_no_single_pixel_is_on_the_road_they_end_at_the_least_width():
    near = near_pixels()
    assert with_row(near, ALONE, near.rows[ALONE] + 90).limit_alone(ROAD) == 0.2


@pytest.mark.parametrize("camber", [0.0, 0.02])
def test_single_pixels_end_where_their_own_spread_says(camber):
    road = ROAD._replace(camber=camber)
    averaged = near_pixels(spread=0.05, road=road)
    noise = 0.3 * averaged.rows[TOLERANCE] * np.random.default_rng(2).normal(size=len(averaged.rows[D]))
    near = with_row(averaged, ALONE, averaged.rows[D] + noise)
    limit = 2.0
    for _ in range(TUNING.rounds):
        weights, off = biweights(with_row(near, D, near.rows[ALONE]), road, limit)
        limit = usual_width(near, off, weights)
    assert near.limit_alone(road) == pytest.approx(limit, rel=1e-4)
    assert limit > near.fit(road, parabolic=True).limit


def found_road(roll_deg=4.0):
    """A sample of a noisy road, and its plane."""
    road = flat_road(roll_deg, width=640, height=480, focal=560.0)
    noise = np.random.default_rng(3).normal(0, 0.4, road.shape)
    sample = take_sample(np.where(road > 0, np.maximum(road + noise, 0.01), 0))
    design = np.stack([np.ones_like(sample.x), sample.x, sample.y], axis=1).astype(float)
    sure = sample.d > 2
    plane = np.linalg.lstsq(design[sure], sample.d[sure].astype(float), rcond=None)[0]
    return sample, Road(plane, 0.9, 0.1)


@pytest.mark.parametrize("roll_deg", [-25.0, 4.0])
def test_the_pixels_near_a_plane_are_weighted_by_place(roll_deg):
    sample, road = found_road(roll_deg)
    tuning = dataclasses.replace(FitTuning(), pixels=2500, reach=1.5, lane=0.7)
    sample = dataclasses.replace(sample, tuning=dataclasses.replace(ROAD_TUNING, fit=tuning))
    near = NearPixels.of(sample, road)

    off = (road.plane @ [np.ones_like(sample.x), sample.x, sample.y] - sample.d) / sample.tolerance
    close = abs(off) < 1.5
    stride = math.ceil(close.sum() / 2500)
    taken = [place for place in range(0, len(close), stride) if close[place]]
    assert (near.stride, stride > 1) == (stride, True)
    np.testing.assert_array_equal(near.rows[ALONE], sample.d[taken])
    around = look_around(sample, road.plane, np.array(taken))
    np.testing.assert_array_equal(near.rows[D], around.mean)

    model = road.model
    across, along = model.across(near.rows[X], near.rows[Y]), model.along(near.rows[X], near.rows[Y])
    side = across * model.alpha[1] / near.rows[D]
    np.testing.assert_allclose(near.rows[AHEAD], np.exp(-((side / 0.7) ** 4)), rtol=1e-3, atol=1e-6)
    # what a rig rolled by 0.1 more or less would not see lies below the picture's lower edge, turned
    bottom = 239.5 / 320 / math.cos(model.theta) + max(0, abs(math.tan(model.theta)) - 0.2)
    seen = 1 / (1 + np.exp((along + 0.1 * abs(across) - bottom) / 0.01))
    expected = around.agreement**2 * seen
    np.testing.assert_allclose(near.rows[PLACE], expected, rtol=1e-3, atol=1e-6)
    assert near.rows[PLACE].min() < 0.05 < 0.9 < near.rows[PLACE].max()


def test_a_step_of_whole_pixels_counts_in_any_case():
    sample, road = found_road()
    whole = take_sample(np.rint(sample.disparity))
    usual = math.hypot(whole.noise, 0.02 * whole.typical)
    assert NearPixels.of(whole, road).least_width == pytest.approx(1 / usual)
    assert NearPixels.of(sample, road).least_width == pytest.approx(0.2, rel=0.5)
