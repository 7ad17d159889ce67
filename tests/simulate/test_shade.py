"""The light of what rays hit: sun, sky and the mean over a pixel's footprint."""

import numpy as np
import pytest

from rollcli.simulate.materials import Plain
from rollcli.simulate.scene import Light, Scene
from rollcli.simulate.views import AIR, LONG, LONG_P, LONG_Q, NONE, SHORT, SUN, P, Q, shade

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
    return shade(scene, AHEAD, np.zeros(1, np.int16), values)[0]


@pytest.mark.parametrize("ratio", [8, 30])
def test_albedo_is_averaged_over_the_length_of_the_footprint(ratio):
    reads = {Q: 3.0, LONG_Q: 2.0, LONG: 2.0, SHORT: 2.0 / ratio, P: 1.0, LONG_P: 0.0}
    # the mean of q^2 over a length of 2 around 3 is 9 + 2^2 / 12; eight points lose 1/64 of it
    assert shaded(Slope(), reads) / 1.4 == pytest.approx(9 + 4 / 12 * (1 - 1 / 64), rel=1e-5)


def test_a_ray_that_hits_nothing_shows_the_sky_whatever_its_reads_are():
    light = Light(np.array([0.0, 1.0, 0.0]), ambient=0.3, exposure=1.4, clouds=0.0)
    scene = Scene(light, normal=np.array([0.0, 1.0, 0.0]), materials=[Plain(0.5)])
    kinds = np.full(1, NONE, np.int16)
    sky = [shade(scene, AHEAD, kinds, np.full((8, 1), value, np.float32)) for value in (0, 1)]
    assert np.array_equal(*sky)
    assert sky[0].min() > 0.5
