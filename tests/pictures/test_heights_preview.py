"""Colours of heights: fixed, the road in the middle."""

import numpy as np
import pytest

from rollcli.pictures.heights_preview import BAR_WIDTH, draw_heights

SPAN = (-0.1, 0.1)


def colour(height, **options):
    heights = np.full((60, 40), height, np.float32)
    return draw_heights(heights, options.pop("span", SPAN), "metres", **options)[30, 20].astype(int)


def test_the_road_is_white_what_is_below_blue_and_above_red():
    assert np.ptp(colour(0)) == 0
    assert colour(0).min() > 240
    blue, _, red = colour(-0.08)
    assert blue > red + 50
    blue, _, red = colour(0.08)
    assert red > blue + 50


def test_a_height_has_the_same_colour_in_every_picture():
    heights = np.linspace(-0.3, 0.3, 60 * 40, dtype=np.float32).reshape(60, 40)
    heights[30, 20] = 0.03
    assert (draw_heights(heights, SPAN, "metres")[30, 20] == colour(0.03)).all()
    assert (colour(0.1) == colour(5)).all()
    assert (colour(0.05, span=(-0.1, 0.1)) != colour(0.05, span=(-0.1, 0.4))).any()
    assert (colour(0, span=(-0.1, 0.4)) == colour(0)).all()


def test_no_data_is_dark_and_shows_the_photo_where_there_is_one():
    assert colour(np.nan).max() < 80
    photo = np.full((120, 80, 3), 200, np.uint8)
    assert colour(np.nan, photo=photo).tolist() == [200, 200, 200]
    light = colour(0.05, photo=photo)
    dark = np.full((120, 80), 200 << 8, np.uint16)
    dark[:80] = 20 << 8
    assert (colour(0.05, photo=dark) < light).all()


@pytest.mark.parametrize(("span", "unit"), [((-0.1, 0.1), "metres"), ((-0.02, 0.3), "camera heights")])
def test_a_bar_of_the_same_colours_stands_on_the_right(span, unit):
    picture = draw_heights(np.zeros((200, 40), np.float32), span, unit)
    assert picture.shape == (200, 40 + BAR_WIDTH, 3)
    bar = picture[:, 40 + 16]
    assert (bar[0] == colour(span[1], span=span)).all()
    assert (bar[-1] == colour(span[0], span=span)).all()
    assert (picture[:, 40 + 28 :] < 128).any(axis=(1, 2)).sum() > 20
