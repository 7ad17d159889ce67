"""Shadows fall where the sun is hidden, and it is dim below cars."""

import numpy as np
import pytest

from rollcli.simulate.build import build_scene
from rollcli.simulate.road import Piece
from rollcli.simulate.roadside import vehicle
from rollcli.simulate.scene import air_below, draw_light, in_shadow, sky
from rollcli.simulate.solids import Post
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import NEAR, Course


def on_ground(x, z):
    x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
    return np.array([x.ravel(), np.zeros(x.size), z.ravel()])


@pytest.mark.parametrize("azimuth_deg", [-150, -40, 10, 95])
def test_the_shadow_of_a_post_lies_opposite_to_the_sun_and_is_as_long_as_its_height_asks_for(azimuth_deg):
    azimuth, rise = np.radians(azimuth_deg), np.radians(40)
    sun = np.array([np.cos(rise) * np.sin(azimuth), np.sin(rise), np.cos(rise) * np.cos(azimuth)])
    post = Post(np.array([2.0, 0.0, 9.0]), 0.1, 3.0, 0)
    away = -np.array([np.sin(azimuth), np.cos(azimuth)])
    distances = np.linspace(-5, 5, 400)
    shaded = in_shadow(on_ground(2 + distances * away[0], 9 + distances * away[1]), sun, [post])
    # a ray toward the sun meets the near side of the post, at least NEAR away and below its top
    first = 0.1 + NEAR * np.cos(rise)
    assert np.array_equal(shaded, (distances > first) & (distances < 0.1 + 3 / np.tan(rise)))


@pytest.mark.parametrize("seed", [2, 3, 11])
def test_shadows_do_not_depend_on_the_outlines_that_spare_work(seed):
    scene = build_scene(FrameSpec("street", seed=seed))
    sun, casters = np.array([0.5, 0.6, -0.62]), [s for s in scene.surfaces if s.bounds() is not None]
    points = on_ground(*np.meshgrid(np.linspace(-6, 4, 60), np.linspace(3, 40, 80)))
    toward = np.broadcast_to(sun[:, None], points.shape)
    hidden = np.any([np.isfinite(s.intersect(points, toward)) for s in casters], axis=0)
    assert 0.01 < hidden.mean() < 0.9
    assert np.array_equal(in_shadow(points, sun, casters), hidden)


@pytest.mark.parametrize("oncoming", [False, True])
def test_below_a_car_the_sky_is_hidden_and_two_metres_beside_it_is_not(oncoming):
    course = Course()
    car = vehicle(np.random.default_rng(3), course, Piece(-5, 5), 1.0, 12.0, 0, oncoming)
    below, beside = air_below(on_ground(1.0, 12.0), car), air_below(on_ground([-2.0, 4.0], 12.0), car)
    assert below[0] < 0.2
    assert beside.min() > 0.99
    outward = air_below(on_ground(np.linspace(1.0, 3.0, 40), 12.0), car)
    assert np.all(np.diff(outward) >= -1e-6)
    along = air_below(on_ground(1.0, [12.0 - 3.5, 12.0 + 3.5]), car)
    assert along.min() > 0.9


def test_half_of_the_scenes_have_sun_and_it_is_above_the_horizon():
    lights = [draw_light(np.random.default_rng(seed)) for seed in range(400)]
    assert 0.4 < np.mean([light.sunny for light in lights]) < 0.6
    assert min(light.sun[1] for light in lights) > np.sin(0.44)
    assert np.allclose([np.linalg.norm(light.sun) for light in lights], 1)


def test_the_sky_is_bluer_above_and_pale_at_the_horizon():
    light = draw_light(np.random.default_rng(1))
    up, level = (sky(light, np.array([[0.1], [rise], [1.0]]))[0] for rise in (5.0, 0.0))
    assert up[2] / up[0] < level[2] / level[0], "red to blue"
    assert np.ptp(level) < 0.1
