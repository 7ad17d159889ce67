"""The light of what rays hit: shadows, sun, sky, textures, and what a sensor makes of it."""

import numpy as np
import pytest

from rollcli.simulate.build import build_scene
from rollcli.simulate.materials import band, bars
from rollcli.simulate.scene import Light, Post, Scene, in_shadow
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import NEAR
from rollcli.simulate.views import AIR, LONG, LONG_P, LONG_Q, SHORT, SUN, Hits, P, Q, Rays, shade


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


AHEAD = np.array([[0.0], [0.0], [1.0]])


class Slope:
    """A material whose albedo is the square of its q coordinate."""

    def albedo(self, p, q, w):
        """The square of q."""
        return np.asarray(q * q, np.float32)

    def colour(self, p, q):
        """White."""
        return np.ones(3, np.float32)


def shaded(material, rows):
    values = np.zeros((8, 1), np.float32)
    for row, value in ({AIR: 1.0, SUN: 1.0, LONG: 0.01, SHORT: 0.01} | rows).items():
        values[row] = value
    light = Light(np.array([0.0, 1.0, 0.0]), ambient=0.3, exposure=1.4, clouds=0.0)
    scene = Scene(light, normal=np.array([0.0, 1.0, 0.0]), materials=[material])
    return shade(scene, Rays(None, None, None, AHEAD), Hits(None, None, np.zeros(1, np.int16), values))[0]


@pytest.mark.parametrize("ratio", [8, 30])
def test_albedo_is_averaged_over_the_length_of_the_footprint(ratio):
    reads = {Q: 3.0, LONG_Q: 2.0, LONG: 2.0, SHORT: 2.0 / ratio, P: 1.0, LONG_P: 0.0}
    # the mean of q^2 over a length of 2 around 3 is 9 + 2^2 / 12; eight points lose 1/64 of it
    assert shaded(Slope(), reads) / 1.4 == pytest.approx(9 + 4 / 12 * (1 - 1 / 64), rel=1e-5)


def averaged(pattern, centre, width):
    """The mean of a pattern of 0 and 1 over pixels, by brute force."""
    offsets = (np.arange(4000) + 0.5) / 4000 - 0.5
    return pattern(centre[:, None] + offsets * width).mean(axis=1)


@pytest.mark.parametrize("width", [0.01, 0.3, 2.0, 25.0])
def test_a_band_and_bars_cover_their_share_of_a_pixel_however_many_it_holds(width):
    x = np.linspace(-3, 3, 101, dtype=np.float32)
    of_band = averaged(lambda t: (t > -0.4) & (t < 0.7), x, width)
    assert np.allclose(band(x, -0.4, 0.7, np.full_like(x, width)), of_band, atol=1e-3)
    of_bars = averaged(lambda t: np.mod(t, 1.3) < 0.4, x, width)
    assert np.allclose(bars(x, 1.3, 0.4, np.full_like(x, width)), of_bars, atol=2e-3)
