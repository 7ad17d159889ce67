"""Heights over the road against a search for the nearest point in space, and their colours."""

import math

import numpy as np
import pytest

import rollcli
from rollcli.estimator.road.model import RoadModel
from rollcli.files.results import Row
from rollcli.pictures.heights import FittedRoad, heights_over
from rollcli.rig.calibration import Calibration
from tests.estimator.synthetic_maps import banked_road

WIDTH, HEIGHT = 640, 240
CENTRE = (WIDTH - 1) / 2, (HEIGHT - 1) / 2
V, U = np.mgrid[:HEIGHT, :WIDTH].astype(float)


def road_of(theta, level, rise, bend, camber):
    """A road whose parabola is given about the map's centre, and the same as the estimator's model of it."""
    centre = CENTRE[1] * math.cos(theta) - CENTRE[0] * math.sin(theta)
    alpha = (level - rise * centre + bend * centre**2, rise - 2 * bend * centre, bend)
    road = FittedRoad(RoadModel(theta, alpha, camber), WIDTH, HEIGHT)
    return road, RoadModel(theta, (level, rise, bend), camber)


class Space:
    """Points of pixels in space, metres."""

    def __init__(self, model, rig):
        a0, a1, a2 = model.alpha  # camber is of the disparity that is 0 infinitely far away
        self.model, self.rig = model._replace(alpha=(a0 + rig.doffs, a1, a2)), rig

    def road(self, u, v):
        return self.model.disparity(u - CENTRE[0], v - CENTRE[1]) - self.rig.doffs

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
    map_[0, 0] = -rig.doffs  # infinitely far
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
    g = model.disparity(U - CENTRE[0], V - CENTRE[1])
    d = np.where(g > 5, g * 2.5, np.where(CENTRE[0] < U, 0, 1e300))
    in_heights = heights_over(d, road, None)
    assert np.allclose(in_heights[g > 5], 1 - 1 / 2.5, atol=1e-5)
    camera = 1 / np.linalg.norm([0.4 / 0.5, 30 / (400 * 0.5)])
    assert np.allclose(heights_over(d, road, rig)[g > 5], camera * (1 - 1 / 2.5), atol=1e-5)
    assert np.isnan(in_heights[g <= 5]).all()
    faint, _ = road_of(0.2, 0.3, 0.004, 0, 0)
    assert np.allclose(heights_over(d / 100, faint, None)[g > 5], in_heights[g > 5], atol=1e-6)


def test_a_flattening_road_goes_on_straight():
    """Beyond the vertex of its parabola there is no row of such a disparity."""
    road, _ = road_of(0, 20, 0.4, -8e-4, 0)
    heights = heights_over(np.full(V.shape, 300.0), road, Calibration(400, 400, *CENTRE, 0.5))
    assert np.isfinite(heights).all()
    assert (np.diff(heights, axis=0) < 0).all()


def test_a_kerb_that_alone_lies_nearer_than_the_bottom_is_no_hill():
    road, model = road_of(0, 5, 0.4, 0, 0)
    g = model.disparity(U - CENTRE[0], V - CENTRE[1])
    d = np.where(U > 400, g / 0.9, g) + np.random.default_rng(1).normal(0, 0.05, g.shape)
    assert np.median(np.abs(heights_over(d, road, None)[(g > 25) & (U < 400)])) < 0.002


def road_over_a_hill(theta):
    """Disparities and distances of a road that falls by 0.0015 z^2 m, and the rig: no parabola fits it."""
    rig = Calibration(fx=400, fy=400, cx=CENTRE[0], cy=CENTRE[1], baseline=0.5)
    along = (V - CENTRE[1]) * math.cos(theta) - (U - CENTRE[0]) * math.sin(theta)
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
    across = (U - CENTRE[0]) * math.cos(theta) + (V - CENTRE[1]) * math.sin(theta)
    across *= np.minimum(depth, 1e9) / rig.fx
    for near, far in ((5, 8), (8, 12), (12, 18)):  # the parabola alone leaves 0.5, 2 and 45 mm
        lane = (depth > near) & (depth < far) & (np.abs(across) < 1.5)
        assert abs(np.median(flat[lane])) < 0.001
    # disparities that do not begin at 0 are the same road
    beyond, more = Calibration(400, 400, *CENTRE, 0.5, doffs=-20.0), np.where(seen > 0, seen + 20, 0)
    again = rollcli.estimate_roll(more, calibration=beyond)
    assert (again.roll_deg, again.ci95) == pytest.approx((estimate.roll_deg, estimate.ci95), abs=1e-5)
    assert np.allclose(rollcli.height_map(more, again, beyond), flat, atol=1e-4, equal_nan=True)
    # numbers of any size, as of a map in other units, have the same heights, at the same cost
    same = [rollcli.height_map(seen * by, rollcli.estimate_roll(seen * by)) for by in (1, 1e-6, 1e7)]
    assert all(np.allclose(each, same[0], atol=1e-4, equal_nan=True) for each in same)
    dip = (depth > 7) & (depth < 8) & (np.abs(across - 0.5) < 0.3)
    seen[dip] /= 1.03  # on the same rays, below the road at its distance
    z = 1.03 * depth[dip]
    below = 1.03 * (1.5 + 0.0015 * depth[dip] ** 2) - (1.5 + 0.0015 * z**2)
    below *= np.cos(np.arctan(0.003 * z - 0.1))
    lower = rollcli.height_map(seen, rollcli.estimate_roll(seen, calibration=rig), rig)
    assert np.median(lower[dip] + below) == pytest.approx(0, abs=0.002)


@pytest.mark.parametrize("options", [{}, {"method": "areas"}, {"road": "all"}])
def test_those_of_an_estimate_are_those_of_its_row(options):
    crop, rig = banked_road(2, cropped=200), Calibration(360, 300, 110, 94, 0.5)
    estimate = rollcli.estimate_roll(crop, calibration=rig, **options)
    road = FittedRoad.of_row(Row("crop.png", **estimate.to_dict()), rig)
    heights = heights_over(crop, road, rig)
    np.testing.assert_allclose(rollcli.height_map(crop, estimate, rig), heights, atol=1e-4)
