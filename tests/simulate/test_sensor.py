"""What a sensor makes of an even light."""

import numpy as np
import pytest

from rollcli.simulate.camera import expose


def exposed(level, gain=1.0, noise=0.0, colour=True):
    light = np.full((101, 201, 3), level, np.float32)
    return expose(light, noise, gain, colour, np.random.default_rng(0))


@pytest.mark.parametrize(("level", "grey"), [(0.0, 0), (0.25, 128), (1.0, 255), (4.0, 255)])
def test_the_grey_level_is_the_root_of_the_light_up_to_saturation(level, grey):
    assert (exposed(level)[50, 100] == grey).all()


def test_the_image_darkens_toward_its_corners_and_not_elsewhere():
    image = exposed(0.64, colour=False).astype(float)
    assert image[50, 100] == 204
    assert image.argmin() == 0
    # at a corner 24 % of the light are lost, in the middle of a side 12 %
    assert image[0, 0] == image[-1, -1] == image[0, -1] == np.rint(204 * np.sqrt(0.76))
    assert image[0, 100] == image[50, 0] == np.rint(204 * np.sqrt(0.88))


def test_grey_is_the_weighted_mean_of_red_green_and_blue():
    light = np.zeros((3, 3, 3), np.float32)
    for channel, weight in enumerate((0.114, 0.587, 0.299)):  # BT.601, blue first
        light[:] = 0
        light[..., channel] = 1
        image = expose(light, 0.0, 1.0, False, np.random.default_rng(0))
        assert image[1, 1] == np.rint(255 * np.sqrt(weight))


def test_noise_has_a_mean_of_zero():
    errors = exposed(0.25, noise=6.0)[40:60, 90:110].astype(float) - 127.5
    assert abs(errors.mean()) < 0.8
