"""The interval holds the truth as often as it says; jackknife and tangent are those of least squares."""

import csv
import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy import ndimage, stats

from rollcli import read_disparity
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.interval import Interval, Jackknife, interval_of, jackknife, touch
from rollcli.estimator.moments import Floats, Grid
from rollcli.estimator.request import Request
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.sample import take_sample
from rollcli.estimator.road.surface import Surface, whole_surface
from rollcli.estimator.tuning import TUNING, IntervalTuning
from rollcli.simulate.dataset import lane_rolls_of
from rollcli.simulate.spec import FrameSpec
from tests.estimator.synthetic_maps import banked_road, bent_road, energy_of, flat_road
from tests.real_pairs import LIDAR, needs_lidar
from tests.true_disparity import true_disparity

SIZE = {"width": 320, "height": 240, "focal": 280.0}


MAPS = 100


def smooth_noise(rng, shape, cell):
    """Noise of deviation 1 at nodes `cell` pixels apart, interpolated between them."""
    v, u = np.indices(shape) / cell
    nodes = rng.normal(0, 1, (int(v.max()) + 2, int(u.max()) + 2))
    return ndimage.map_coordinates(nodes, (v, u), order=1)


def noisy_road(rng, roll_deg, own_share=0.0):
    """A flat road with noise like a matcher's, that neighbours share, or with a share of each pixel's own."""
    road = flat_road(roll_deg, **SIZE)
    noise = rng.normal(0, 0.1, road.shape) + 0.3 * smooth_noise(rng, road.shape, 7)
    if own_share:
        noise = rng.normal(0, own_share, road.shape) * road
    return np.where(road > 0, np.maximum(road + noise, 0.01), 0)


@pytest.mark.parametrize("own_share", [0, 0.05])  # 0.02 are a road's tolerance
def test_95_percent_of_the_intervals_hold_the_true_roll(own_share):
    rng = np.random.default_rng(2)
    rolls, request = rng.uniform(-60, 60, MAPS), Request(max_roll=math.radians(70))
    found = [estimate_roll(noisy_road(rng, roll, own_share), request) for roll in rolls]
    error = np.abs(np.degrees([each.theta for each in found]) - rolls)
    half_width = np.degrees([each.ci95 for each in found])

    # three standard deviations of a binomial of 100 draws at 0.95
    assert np.mean(error <= half_width) >= 0.95 - 3 * math.sqrt(0.95 * 0.05 / MAPS)
    assert np.median(half_width) < 6 * np.median(error)


@pytest.mark.slow
def test_on_rough_roads_they_hold_the_roll_of_the_lane_that_a_lidar_would_say():
    """Roads of ISO 8608's classes A to D, at half the size of the cameras of KITTI."""
    rig = {"size": (620, 188), "focal": 360.0, "height": 1.65, "cross_section": "flat"}
    rng, held = np.random.default_rng(6), []
    for seed in range(28):
        spec = FrameSpec("bare", rng.uniform(-0.1, 0.1), 0.01, roughness="ABCD"[seed % 4], seed=seed, **rig)
        disparity, _ = true_disparity(spec)
        noisy = np.where(disparity > 0, disparity + rng.normal(0, 0.1, disparity.shape), 0)
        found = estimate_roll(noisy)
        low, high = lane_rolls_of(spec)
        held.append(low - found.ci95 <= found.theta <= high + found.ci95)
    # three standard deviations of a binomial of 28 draws at 0.95
    assert np.mean(held) >= 0.95 - 3 * math.sqrt(0.95 * 0.05 / 28)


@needs_lidar
def test_where_the_nearest_road_is_hidden_they_hold_the_roll_of_the_lane_from_the_rig_on():
    reference, held = LIDAR / "reference.csv", []
    for row in csv.DictReader(reference.read_text().splitlines()):
        sweep = read_disparity(LIDAR / "sweep" / f"{row['frame']}.png")
        for hidden in (45, 75):
            sweep[-hidden:] = 0
            found = estimate_roll(sweep)
            low, high = float(row["lo_deg"]), float(row["hi_deg"])
            held.append(low - found.roll_ci95_deg <= found.roll_deg <= high + found.roll_ci95_deg)
    assert np.mean(held) >= 0.95 - 3 * math.sqrt(0.95 * 0.05 / 41)


def test_as_much_is_hidden_of_a_crop_as_of_its_mirror_image():
    crop = banked_road(12, cropped=250)
    found = estimate_roll(crop, Request(middle=(60.0, 94.0))).tangent.jackknife
    mirrored = estimate_roll(crop[:, ::-1], Request(middle=(crop.shape[1] - 61.0, 94.0))).tangent.jackknife
    assert found.hidden == pytest.approx(mirrored.hidden, rel=0.1)


@pytest.mark.parametrize("roll_deg", [-50, 0, 30])
def test_a_slope_that_all_disparities_may_have_widens_it_by_what_it_would_turn(roll_deg):
    """Maps that have such a slope show what it turns: that is the standard deviation that is added."""
    slope, columns = 1e-3, np.arange(SIZE["width"])
    road = noisy_road(np.random.default_rng(4), roll_deg)
    request = Request(road="all", method="exact", max_roll=math.radians(70))
    turned = [
        estimate_roll(np.where(road > 0, road + sign * slope * columns, 0), request).theta for sign in (1, -1)
    ]

    without = estimate_roll(road, request)
    found = estimate_roll(road, dataclasses.replace(request, slope_error=slope))

    added = math.sqrt(found.ci95**2 - without.ci95**2)
    assert found.theta == without.theta
    assert added == pytest.approx(1.96 * abs(turned[0] - turned[1]) / 2, rel=0.05)


def knife(bands=(0.0,), columns=(0.0,), white=0.0, freedom=(5.0, 5.0), **parts):
    """A jackknife whose groups change theta alone."""
    changes = [np.array([[0, 0, 0, change] for change in group]) for group in (bands, columns)]
    others = {"uneven": 0.0, "hidden": 0.0, "bend": 0.0, "camber": None} | parts
    return Jackknife(*changes, np.diag([0, 0, 0, white]), freedom, **others)


@pytest.mark.parametrize("freedom", range(1, 13))
def test_groups_widen_it_as_students_t_does(freedom):
    known = (freedom, freedom)
    bands = knife(bands=(0.003, -0.004), freedom=known).noise(0.0, TUNING.interval)
    columns = knife(columns=(2,), freedom=known).noise(0.0, TUNING.interval)
    # of t 2.5 % lie beyond the quantile
    assert stats.t.cdf(bands / 0.005, freedom) == pytest.approx(0.975, abs=2e-5)
    assert columns / 2 == pytest.approx(bands / 0.005)


def test_its_parts_add_as_independent_errors_do():
    tuning = IntervalTuning(white=0.5, factor=2.0, uneven=5.0, twist=0.05, bend=7.0, slant=0.4)
    one = knife((0.03,), (0.04,), 0.0009, (12.0, 12.0), uneven=0.02, hidden=2.0, bend=0.03)
    found = interval_of(one, math.radians(-30), 0.2, tuning)
    noise = 2 * (1 + 0.4 * 0.5) * math.hypot(2.179 * 0.03, 2.179 * 0.04, 0.5 * 1.96 * 0.03)
    assert found.noise == pytest.approx(noise)
    assert found.half_width == pytest.approx(math.hypot(noise, 0.1, 0.05 * 2, 0.21, 1.96 * 0.2))


def test_no_interval_is_wider_than_all_rolls():
    vague = knife((9.0,), (8.0,), 7.0, uneven=1.0)
    assert interval_of(vague, 0.0, 0.0, TUNING.interval) == Interval(math.pi / 2, math.pi / 2)


class Fitted(NamedTuple):
    """A surface of scattered pixels, and its linear problem by central differences of the road."""

    surface: Surface
    design: Floats  # shape (N, 5)
    wanted: Floats  # shape (N,)
    prior: float

    def solve(self, weights, columns=slice(None)):
        """The least-squares parameters at some weights, prior included, and the sum that they minimise."""
        rows = np.vstack([self.design * np.sqrt(weights)[:, None], [0, 0, 0, 0, math.sqrt(self.prior)]])
        wanted = np.append(self.wanted * np.sqrt(weights), 0)
        found = np.linalg.lstsq(rows[:, columns], wanted, rcond=None)[0]
        return found, np.sum((wanted - rows[:, columns] @ found) ** 2)

    def grown(self, change):
        """What a change has come to after three more rounds, as the weights follow the road."""
        total = change
        for _ in range(3):
            following = self._replace(wanted=self.surface.yields * self.design @ total)
            total = change + following.solve(self.surface.weights)[0]
        return total


def fitted(*, prior=4e3, parabolic=True, heavy=1.0, count=241, noise=0.3, yields=0.0):
    """Such a surface with a bulge, and the theta about which it is laid out."""
    rng = np.random.default_rng(11)
    x, y = rng.uniform(-0.9, 0.9, count), rng.uniform(0.05, 0.6, count)
    weights = heavy * rng.uniform(0.2, 1, count)
    alpha = np.array([30.0, 60.0, 9.0 if parabolic else 0.0])
    theta, camber, step = 0.2, 0.01, 1e-5

    def disparity(change):
        a0, a1, a2, turned, bulge = change
        return RoadModel(theta + turned, (30 + a0, 60 + a1, alpha[2] + a2), bulge).disparity(x, y)

    steps = step * np.eye(5)
    design = np.stack([(disparity(each) - disparity(-each)) / (2 * step) for each in steps], axis=1)
    design[:, 2] *= parabolic
    design[:, 4] *= math.isfinite(prior)
    wanted = design @ [0.2, -0.3, 0.1, 0.01, 0.0] + rng.normal(0, noise, count)
    surface = Surface(
        x=x,
        y=y,
        d=disparity(np.zeros(5)) + wanted,
        weights=weights,
        model=RoadModel(0.0, tuple(alpha), camber),
        grid=Grid.of_shape(480, 640),
        noise=0.1,
        parabolic=parabolic,
        camber_precision=prior,
        yields=yields,
    )
    return Fitted(surface, design, wanted, prior if math.isfinite(prior) else 0.0), theta


def equal_shares(position, share, count=6):
    """The group of each pixel, when so many of equal share are cut along a position."""
    order = np.argsort(position)
    groups = np.empty(len(order), int)
    groups[order] = np.minimum(count * np.cumsum(share[order]) // share.sum(), count - 1)
    return groups


# of a parameter's largest change, or of its textbook error: the sums are in single precision (6e-8), and the
# normal equations have condition numbers of up to 260, more where a group is left out
SINGLE = 1e-4


CASES = [{}, {"prior": math.inf}, {"parabolic": False}, {"heavy": 0.3}, {"prior": 5e4}, {"yields": 0.4}]


def left_out(problem, theta):
    """What leaving out each band and each column changes, by refits, and the groups' shares of leverage."""
    surface, weights = problem.surface, problem.surface.weights
    road = RoadModel(theta, surface.model.alpha)
    across, along = road.across(surface.x, surface.y), road.along(surface.x, surface.y)
    turning = weights * problem.design[:, 3] ** 2
    whole, _ = problem.solve(weights)
    for position, share in ((along, np.ones_like(along)), (across, turning)):
        groups = equal_shares(position, share)
        without = [problem.solve(weights * (groups != k))[0] for k in range(6)]
        yield whole - without, np.bincount(groups, turning) / turning.sum()


@pytest.mark.parametrize("case", CASES)
def test_without_each_group_all_parameters_are_those_of_a_least_squares_fit(case):
    problem, theta = fitted(**case)
    found = jackknife(problem.surface, theta, TUNING.interval)

    both = zip((found.bands, found.columns), found.freedom, left_out(problem, theta), strict=True)
    for changes, freedom, (expected, leverage) in both:
        expected = np.array([problem.grown(each) for each in expected])
        off = np.abs(changes - expected[:, :4])
        assert (off < SINGLE * np.abs(expected[:, :4]).max(axis=0) + 1e-9).all()
        assert freedom == pytest.approx(1 / np.sum(leverage**2) - 1, rel=1e-6)


def test_of_a_road_that_is_seen_nowhere_the_interval_is_that_of_all_rolls():
    surface = dataclasses.replace(fitted()[0].surface, model=RoadModel(0.0, (-90.0, 60.0, 9.0)))
    found = interval_of(jackknife(surface, 0.0, TUNING.interval), 0.0, 0.0, TUNING.interval)
    assert found.half_width == math.pi / 2


def test_the_unevenness_of_waves_is_theirs_and_that_of_noise_is_none():
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:300, :400].astype(float)
    plane = 5 + 0.2 * rows
    side = (columns - 199.5) * 0.2 / plane  # camera heights
    waves = 0.004 * np.sin(2 * math.pi * side / 1.7) * np.sin(40 / plane)
    noise = rng.normal(0, 0.2, plane.shape)
    rough, smooth = (
        estimate_roll(plane * (1 + height) + noise).tangent.jackknife.uneven for height in (waves, 0)
    )
    view = 400 * 0.2 / plane.max()
    assert 0.4 < rough * math.sqrt(view / np.mean(waves**2)) < 1.2
    assert smooth < 0.15 * rough


def test_a_round_bonnet_hides_as_much_as_a_border_though_road_is_seen_beside_it_and_pixels_on_it():
    rng = np.random.default_rng(4)
    rows, columns = np.mgrid[:160, :640].astype(float)
    plane = 1 + 0.2 * rows
    for hidden, below in ((40, 120), (40, 120 + 40 * ((columns - 319.5) / 319.5) ** 2), (0, 160)):
        seen = (rows < below) | (rng.uniform(size=rows.shape) < 0.02)
        found = estimate_roll(np.where(seen, plane + rng.normal(0, 0.1, plane.shape), 0)).tangent.jackknife
        wider = 640 * 0.2 * (1 / (plane.max() - 0.2 * hidden) - 1 / plane.max())
        assert found.hidden == pytest.approx(wider, rel=0.15, abs=0.02)


@pytest.mark.parametrize(("errors", "left"), [(1.9, 0), (4, 0.75), (-20, 0.99)])
def test_the_camber_is_that_of_the_pixels_without_the_prior_less_what_noise_may_make_of_it(errors, left):
    problem, theta = fitted()
    with_prior = problem.solve(problem.surface.weights)[0][4]
    alone = problem._replace(prior=0.0).solve(problem.surface.weights)[0][4]
    assert abs(with_prior) < 0.99 * abs(alone)
    changes = np.concatenate([changes[:, 4] for changes, _ in left_out(problem, theta)])
    camber = errors * float(np.sqrt(np.sum(changes**2)))
    surface = dataclasses.replace(problem.surface, model=problem.surface.model._replace(camber=camber))

    found = jackknife(surface, theta, TUNING.interval).camber
    assert found == pytest.approx(left * camber * alone / with_prior, rel=1e-3)
    assert found or math.copysign(1, found) > 0


@pytest.mark.parametrize(("times", "known"), [(0.99, True), (1.01, False)])
def test_a_camber_of_which_the_prior_knows_more_than_the_pixels_is_left_open(times, known):
    problem, _ = fitted()
    weights = problem.surface.weights
    root = np.sqrt(weights)
    others = problem.design[:, :4] * root[:, None]
    bulge = problem.design[:, 4] * root
    rest = bulge - others @ np.linalg.lstsq(others, bulge, rcond=None)[0]  # what tells of the camber alone
    problem, theta = fitted(prior=times * float(rest @ rest))
    assert (jackknife(problem.surface, theta, TUNING.interval).camber is not None) == known


GRID = Grid.of_shape(375, 1242)


THETA = 0.2


@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_errors_have_the_covariance_that_those_of_the_parabola_imply(size):
    rng = np.random.default_rng(5)
    bands, columns, roots = (size * rng.normal(size=shape) for shape in ((6, 4), (6, 4), (4, 4)))
    white = roots @ roots.T
    errors = Jackknife(bands, columns, white, (3.0, 5.0), 0.0, 0.0, 0.0, None)
    tangent = touch((30.0, 0.3, 1e-5), THETA, GRID, None, errors)
    # by hand: (a0, a1, a2, theta) are independent sums of all groups, and of the textbook's 95 % half-widths
    covariance = bands.T @ bands + columns.T @ columns + 1.96**2 * white
    across = GRID.centre_u * math.cos(THETA) + GRID.centre_v * math.sin(THETA)
    to_pixels = np.array([[1, 0, 0, tangent.slope * across], [0, 1 / GRID.scale, 0, 0], [0, 0, 0, 1]])
    expected = to_pixels @ covariance @ to_pixels.T
    np.testing.assert_allclose(tangent.changes.T @ tangent.changes, expected, rtol=1e-9)


def touched(disparity, alpha=None):
    """The tangent of a map's parabola, or of another, amid all of its pixels, and the mean of their rows."""
    sample, energy = take_sample(disparity, None, TUNING.sample), energy_of(disparity)
    surface = whole_surface(sample, energy, Request())
    u, v = (each * surface.grid.scale for each in (surface.x, surface.y))
    y = (v + 119.5) * math.cos(THETA) - (u + 159.5) * math.sin(THETA)
    return touch(alpha or energy.parabola(THETA), THETA, GRID, surface, None), y.mean()


@pytest.mark.parametrize("bend", [-300.0, 300.0])
def test_on_a_road_of_constant_curvature_it_is_the_roads_own_tangent(bend):
    v, u = np.mgrid[:240, :320]
    y = v * math.cos(THETA) - u * math.sin(THETA) + 120

    # y = 3 d + bend / d, solved for the disparity
    def road(y):
        return (y + np.sqrt(y**2 - 12 * bend)) / 6

    tangent, row = touched(np.where(y > 100, road(np.maximum(y, 100)), 0))
    there = road(tangent.row + 120)
    assert tangent.row == pytest.approx(row, abs=1e-3)
    assert tangent.disparity == pytest.approx(there, rel=1e-3)
    assert tangent.slope == pytest.approx(1 / (3 - bend / there**2), rel=2e-3)


def test_what_bends_more_than_a_road_moves_it_by_a_twentieth_at_most():
    for bend in (-0.01, 0.01):
        alpha = (30.0 + 100 * abs(bend) * 100, 0.3 - 2 * bend * 85, bend)  # a slope of 0.3 about the middle
        tangent, _ = touched(bent_road(0, width=320, height=240, bend=0), alpha)
        own = alpha[1] + 2 * bend * tangent.row
        assert own > 0
        assert abs(tangent.slope / own - 1) == pytest.approx(0.05)


def test_of_a_surface_that_falls_it_is_the_parabolas():
    alpha = (90.0, -0.3, 1e-4)
    tangent, _ = touched(bent_road(0, width=320, height=240, bend=0), alpha)
    parabola = np.polynomial.Polynomial(alpha)
    assert tangent.disparity == pytest.approx(parabola(tangent.row), rel=1e-12)
    assert tangent.slope == pytest.approx(parabola.deriv()(tangent.row), rel=1e-12)
