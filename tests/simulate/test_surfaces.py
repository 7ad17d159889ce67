"""Rays meet the nearest surface where a slow march along the ray says so."""

import math

import numpy as np
import pytest

from rollcli.simulate.build import build_scene
from rollcli.simulate.scene import Post
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Backdrop, Course, Ground, Wall
from rollcli.simulate.vehicles import vehicle
from rollcli.simulate.views import first_hits

COURSE = Course(heading=0.03, bend=1 / 300, curvature=0.001)
ORIGIN = np.array([[0.3], [1.6], [0.1]])
GROUND = Ground(COURSE, (-4.0, 1.0, 9.0), (0, 1), far=80.0, slope=0.1, offset=-0.2)
DISH = Ground(COURSE, (-4.0, 1.0, 9.0), (0, 1), far=80.0, offset=-0.2, camber=0.03)
WALL = Wall(COURSE, -6.0, 0.0, np.array([-5.0, 20.0, 50.0]), np.array([9.0, 4.0]), 0)
BACKDROP = Backdrop(COURSE, 60.0, -5.0, np.full(200, 7.0), 0)
CAR = vehicle(np.random.default_rng(3), COURSE.frame(9.0) * [[-1], [1], [-1]], COURSE.point(1.0, 9.0), 0)
POST = Post(COURSE.point(2.0, 8.0), 0.3, 4.0, 0)


def inside_car(points):
    local = CAR.frame @ (points - CAR.place[:, None])
    return np.any([np.all(n @ local <= d[:, None], axis=0) for n, d, _ in CAR.parts], axis=0)


def inside_post(points):
    x, y, z = points - POST.foot[:, None]
    return (np.hypot(x, z) <= 0.3) & (y >= 0) & (y < 4)


def below_ground(points):
    lateral, elevation = COURSE.lateral(points), COURSE.elevation(points)
    return (elevation < -0.2 + 0.1 * lateral) & (lateral >= -4) & (lateral < 9) & (points[2] < 80)


def below_dish(points):
    lateral, elevation = COURSE.lateral(points), COURSE.elevation(points)
    return (elevation < -0.2 + 0.015 * lateral**2) & (lateral >= -4) & (lateral < 9) & (points[2] < 80)


def behind_wall(points):
    elevation, z = COURSE.elevation(points), points[2]
    top = np.where(z < 20, 9.0, 4.0)
    return (COURSE.lateral(points) < -6) & (elevation >= 0) & (elevation < top) & (z > -5) & (z < 50)


def beyond_backdrop(points):
    rise = COURSE.curvature / 2 * 60**2
    return (points[2] > 60) & (points[1] - rise >= -5) & (points[1] - rise < 7)


def rays(count, toward, spread, seed=0):
    """Directions around one, of length one along Z."""
    rng = np.random.default_rng(seed)
    aim = (np.array(toward)[:, None] - ORIGIN) + rng.uniform(-spread, spread, (3, count))
    return aim / aim[2]


SURFACES = [
    pytest.param(GROUND, below_ground, (2, 0, 15), 6, id="ground"),
    pytest.param(DISH, below_dish, (2, 0, 15), 6, id="dish in a bend"),
    pytest.param(WALL, behind_wall, (-6, 3, 18), 6, id="wall"),
    pytest.param(BACKDROP, beyond_backdrop, (0, 5, 60), 12, id="backdrop"),
    pytest.param(CAR, inside_car, COURSE.point(1.0, 9.0, 0.7), 1.6, id="car"),
    pytest.param(POST, inside_post, COURSE.point(2.0, 8.0, 2.0), 1.2, id="post"),
    pytest.param(POST, inside_post, COURSE.point(2.0, 8.0, 0.1), 0.8, id="foot of a post"),
]


@pytest.mark.parametrize(("surface", "inside", "toward", "spread"), SURFACES)
def test_a_ray_meets_a_surface_where_marching_along_it_first_comes_inside(surface, inside, toward, spread):
    direction = rays(300, toward, spread)
    # along rays of any length
    scale = np.random.default_rng(1).uniform(0.3, 3, 300)
    met = surface.intersect(ORIGIN, direction * scale) * scale
    step = 0.02
    marched = np.full(300, np.inf)
    for t in np.arange(step, 75, step)[::-1]:
        marched[inside(ORIGIN + t * direction)] = t
    hits = np.isfinite(met)
    assert 50 < hits.sum() < 300
    # a corner can be thinner than a step, and a wall be entered from its end
    agree = np.isclose(met, marched, atol=step * 1.01) | (hits == np.isfinite(marched)) & ~hits
    assert agree.mean() > 0.97


SPEC = FrameSpec("street", math.radians(8), math.radians(3), seed=11, size=(160, 120), focal=93.0)


def every_pixel(spec):
    scene = build_scene(spec)
    camera = spec.cameras(scene.normal)[0]
    return scene, camera.rays_of(range(spec.size[1]))


def test_no_ray_passes_between_uneven_ground_and_its_kerbs():
    scene, rays = every_pixel(FrameSpec("open", roughness="C", size=(160, 120), focal=93))
    scene.surfaces = [each for each in scene.surfaces if isinstance(each, Ground | Wall)]
    assert np.isfinite(first_hits(scene, rays)[0][rays.direction[1] < -0.05]).all()


@pytest.mark.parametrize("seed", [3, 11, 19])
@pytest.mark.parametrize("scene", ["open", "street", "verge"])
def test_each_ray_meets_the_nearest_of_all_surfaces(scene, seed):
    scene, rays = every_pixel(FrameSpec(scene, 0.14, 0.05, seed=seed, size=(160, 120), focal=93.0))
    depth, surface = first_hits(scene, rays)
    # without the boxes around objects, which spare rays that pass by
    every = np.array([s.intersect(rays.origin, rays.direction) for s in scene.surfaces])
    nearest = every.min(axis=0)
    assert np.array_equal(depth, nearest)
    assert np.array_equal(surface, np.where(np.isfinite(nearest), every.argmin(axis=0), -1))


def box(low, high):
    """The corners of a box in the world, (3, 8)."""
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij")).reshape(3, -1)


def test_a_box_around_the_camera_may_be_met_by_any_ray_and_one_behind_it_by_none():
    _, rays = every_pixel(SPEC)
    for corners in (None, box((-1, 0, -2), (1, 3, 2)), box((-1, 0, 0.05), (1, 3, 9))):
        assert rays.window(corners) == slice(None)
    assert len(rays.window(box((-1, 0, -9), (1, 3, -4)))) == 0
    ahead = rays.window(box((-1, 0, 4), (1, 2, 9)))
    assert 0 < len(ahead) < len(rays.u)
