"""Heights over the road against a search for the nearest point in space, and their colours."""

import math

import numpy as np
import pytest

import rollcli
from rollcli.errors import UsageError
from rollcli.estimator.road.model import RoadModel
from rollcli.files.results import Row
from rollcli.pictures.heights import FittedRoad, heights_over, steadied
from rollcli.pictures.heights_preview import draw_heights
from rollcli.rig.calibration import Calibration

WIDTH, HEIGHT = 640, 240
CENTRE = (WIDTH - 1) / 2, (HEIGHT - 1) / 2


def road_of(theta, level, rise, bend, camber):
    """A road whose parabola is given about the map's centre, and the same as the estimator's model of it."""
    centre = CENTRE[1] * math.cos(theta) - CENTRE[0] * math.sin(theta)
    alpha = (level - rise * centre + bend * centre**2, rise - 2 * bend * centre, bend)
    road = FittedRoad(theta, alpha, camber, WIDTH, HEIGHT)
    return road, RoadModel(theta, (level, rise, bend), camber)


class Space:
    """Points of pixels in space, metres."""

    def __init__(self, model, rig):
        self.model, self.rig = model, rig

    def road(self, u, v):
        return self.model.disparity(u - CENTRE[0], v - CENTRE[1])

    def points(self, u, v, d):
        rig = self.rig
        depth = rig.fx * rig.baseline / (d + rig.doffs)
        return np.array([(u - rig.cx) * depth / rig.fx, (v - rig.cy) * depth / rig.fy, depth])

    def distance(self, u, v, d):
        """How far a pixel's point is from the surface: the best of finer and finer grids around it."""
        point = self.points(u, v, d)[:, None, None]
        reach = 120.0
        for _ in range(45):
            near = np.linspace(-reach, reach, 21)
            x, y = np.meshgrid(u + near, v + near)
            g = self.road(x, y)
            g[g + self.rig.doffs <= 1] = np.nan
            away = ((self.points(x, y, g) - point) ** 2).sum(axis=0)
            best = np.unravel_index(np.nanargmin(away), away.shape)
            u, v, reach = x[best], y[best], reach * 0.7
        return math.sqrt(away[best])


@pytest.mark.parametrize("seed", range(12))
def test_heights_are_the_distances_from_the_nearest_points_of_the_surface(seed):
    rng = np.random.default_rng(seed)
    fx = rng.uniform(300, 450)
    rig = Calibration(
        fx=fx,
        fy=fx * rng.uniform(0.9, 1.1),
        cx=CENTRE[0] + rng.uniform(-30, 30),
        cy=CENTRE[1] + rng.uniform(-30, 10),
        baseline=0.54,
        doffs=rng.choice([0, rng.uniform(-4, 8)]),
    )
    theta, rise = rng.uniform(-0.4, 0.4), 0.54 / rng.uniform(1.2, 2)
    level = rise * fx * math.tan(rng.uniform(-0.02, 0.2)) - rig.doffs
    bend, camber = rise * rng.uniform(-3e-4, 3e-4), rng.choice([0, rng.uniform(-0.03, 0.03)])
    road, model = road_of(theta, level, rise, bend, camber)
    space, map_ = Space(model, rig), np.zeros((HEIGHT, WIDTH), np.float32)
    u, v = rng.integers(150, 490, 15), rng.integers(150, HEIGHT, 15)
    ground = space.road(u.astype(float), v.astype(float))
    map_[v, u] = ground * (1 + rng.uniform(-0.05, 0.08, 15))
    found = heights_over(map_, road, rig)
    compared = 0
    for x, y in zip(u, v, strict=True):
        g = float(space.road(np.array([float(x)]), np.array([float(y)]))[0])
        if min(g, g + rig.doffs) > 10:
            expected = math.copysign(space.distance(x, y, float(map_[y, x])), map_[y, x] - g)
            assert found[y, x] == pytest.approx(expected, abs=1e-4)
            compared += 1
    assert compared > 4


def test_far_above_a_plane_heights_are_exact_and_need_no_calibration():
    rig = Calibration(fx=400, fy=400, cx=CENTRE[0], cy=CENTRE[1], baseline=0.5)
    road, model = road_of(0.2, 30, 0.4, 0, 0)
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    g = model.disparity(u - CENTRE[0], v - CENTRE[1])
    d = np.where(g > 5, g * 2.5, 0)
    in_heights = heights_over(d, road, None)
    assert np.allclose(in_heights[d > 0], 1 - 1 / 2.5, atol=1e-5)
    camera = 1 / np.linalg.norm([0.4 / 0.5, 30 / (400 * 0.5)])
    assert np.allclose(heights_over(d, road, rig)[d > 0], camera * (1 - 1 / 2.5), atol=1e-5)
    assert np.isnan(in_heights[d == 0]).all()


def test_without_a_disparity_there_is_no_height():
    road, _ = road_of(0, 30, 0.4, 0, 0.01)
    d = np.full((HEIGHT, WIDTH), 60.0)
    d[0, :6] = 0, -3, np.nan, np.inf, 2e15, 7
    heights = heights_over(d, road, Calibration(400, 400, *CENTRE, 0.5))
    assert np.isnan(heights[0, :6]).tolist() == [True] * 5 + [False]
    assert np.isfinite(heights[1:]).all()
    behind = heights_over(d, road, Calibration(400, 400, *CENTRE, 0.5, doffs=-30))
    assert np.isnan(behind[0, 5])


def test_a_flattening_road_goes_on_straight():
    """Beyond the vertex of its parabola there is no row of such a disparity."""
    road, _ = road_of(0, 20, 0.4, -8e-4, 0)
    d = np.full((HEIGHT, WIDTH), 300.0)
    heights = heights_over(d, road, Calibration(400, 400, *CENTRE, 0.5))
    assert np.isfinite(heights).all()
    assert (np.diff(heights, axis=0) < 0).all()


def road_over_a_hill(theta):
    """Disparities and distances of a road that falls by 0.0015 z^2 m, and the rig: no parabola fits it."""
    rig = Calibration(fx=400, fy=400, cx=CENTRE[0], cy=CENTRE[1], baseline=0.5)
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    along = (v - CENTRE[1]) * math.cos(theta) - (u - CENTRE[0]) * math.sin(theta)
    sight = along / rig.fy + 0.1  # a pitch of 0.1, as a shift
    root = np.sqrt(np.maximum(sight**2 - 0.009, 0))
    depth = np.where(sight > 0.11, 3 / (sight + root), np.inf)  # the road is 1.5 m below the camera
    return rig.fx * rig.baseline / depth, depth, rig


@pytest.mark.parametrize("theta", [0, 0.1, -0.3])
def test_a_hill_that_no_parabola_fits_is_level_and_a_dip_in_it_as_deep_as_it_is(theta):
    d, depth, rig = road_over_a_hill(theta)
    rng = np.random.default_rng(1)
    seen = np.where(d > 0, d + rng.normal(0, 0.05, d.shape), 0)
    estimate = rollcli.estimate_roll(seen, calibration=rig)
    flat = rollcli.height_map(seen, estimate, rig)
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    across = (u - CENTRE[0]) * math.cos(theta) + (v - CENTRE[1]) * math.sin(theta)
    with np.errstate(invalid="ignore"):
        across *= depth / rig.fx
    for near, far in ((5, 8), (8, 12), (12, 18)):  # the parabola alone leaves 0.5, 2 and 45 mm
        lane = (depth > near) & (depth < far) & (np.abs(across) < 1.5)
        assert abs(np.median(flat[lane])) < 0.001
    dip = (depth > 7) & (depth < 8) & (np.abs(across - 0.5) < 0.3)
    seen[dip] /= 1.03  # on the same rays, below the road at its distance
    z = 1.03 * depth[dip]
    below = 1.03 * (1.5 + 0.0015 * depth[dip] ** 2) - (1.5 + 0.0015 * z**2)
    below *= np.cos(np.arctan(0.003 * z - 0.1))
    lower = rollcli.height_map(seen, rollcli.estimate_roll(seen, calibration=rig), rig)
    assert np.median(lower[dip] + below) == pytest.approx(0, abs=0.002)


def test_a_row_of_a_result_has_the_road_of_its_estimate():
    v, u = np.mgrid[:120, :160]
    rig = Calibration(fx=200, fy=190, cx=79.5, cy=29.5, baseline=0.5)
    disparity = np.maximum(0.3 * (v - 20) - 0.03 * u + 5, 0).astype(np.float32)
    estimate = rollcli.estimate_roll(disparity, calibration=rig)
    a0, a1, a2 = estimate.alpha
    row = Row(
        file="a.png",
        status="ok",
        roll_deg=math.degrees(estimate.theta),
        pitch_deg=1.0,
        camber=estimate.camber,
        alpha0=a0,
        alpha1=a1,
        alpha2=a2,
        width=160,
        height=120,
    )
    road = FittedRoad.of_row(row, rig)
    assert road is not None
    assert road.theta == pytest.approx(FittedRoad.of_estimate(estimate).theta, abs=1e-9)
    expected = rollcli.height_map(disparity, estimate, rig)
    assert np.allclose(heights_over(disparity, road, rig), expected, atol=1e-6, equal_nan=True)
    assert FittedRoad.of_row(Row(file="a.png"), rig) is None


def test_a_map_of_another_size_is_refused():
    v = np.mgrid[:120, :160][0]
    estimate = rollcli.estimate_roll(20 + 0.3 * v)
    with pytest.raises(UsageError, match=r"80x60 px is not one of the 160x120 px"):
        rollcli.height_map(np.ones((60, 80)), estimate)


def test_a_steadied_height_is_the_median_around_it_where_all_have_one():
    heights = np.random.default_rng(0).normal(0, 0.1, (16, 19)).astype(np.float32)
    heights[7, 9] = np.nan
    found = steadied(heights)
    for v, u in np.ndindex(*heights.shape):
        around = np.pad(heights, 2, "edge")[v : v + 5, u : u + 5]
        expected = heights[v, u] if np.isnan(around).any() else np.median(around)
        np.testing.assert_equal(found[v, u], expected)


SPAN = (-0.1, 0.1)


def colour(height, **options):
    heights = np.full((60, 40), height, np.float32)
    return draw_heights(heights, options.pop("span", SPAN), "metres", **options)[30, 20].astype(int)


def test_a_height_has_the_same_colour_in_every_picture():
    heights = np.linspace(-0.3, 0.3, 60 * 40, dtype=np.float32).reshape(60, 40)
    heights[30, 20] = 0.03
    assert (draw_heights(heights, SPAN, "metres")[30, 20] == colour(0.03)).all()
    assert (colour(0.1) == colour(5)).all()
    assert (colour(0.05, span=(-0.1, 0.1)) != colour(0.05, span=(-0.1, 0.4))).any()
    assert (colour(0, span=(-0.1, 0.4)) == colour(0)).all()


def test_the_colours_are_those_of_colorbrewer():
    red_to_blue = ("b2182b", "d6604d", "f4a582", "f7f7f7", "92c5de", "4393c3", "2166ac")  # its RdBu
    for height, digits in zip(np.linspace(0.3, -0.3, 7), red_to_blue, strict=True):
        found = colour(height, span=(-0.3, 0.3))[::-1]
        assert np.abs(found - [*bytes.fromhex(digits)]).max() <= 1


def test_no_data_is_dark_and_shows_the_photo_where_there_is_one():
    assert colour(np.nan).max() < 80
    photo = np.full((120, 80, 3), 200, np.uint8)
    assert colour(np.nan, photo=photo).tolist() == [200, 200, 200]
    light = colour(0.05, photo=photo)
    dark = np.full((120, 80), 200 << 8, np.uint16)
    dark[:80] = 20 << 8
    assert (colour(0.05, photo=dark) < light).all()
