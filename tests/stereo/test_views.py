"""Views are made grey, 8 bits deep and small, as their numbers say."""

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.stereo.views import prepare_views, shrink, shrink_both


def test_colours_are_weighted_as_the_eye_does():
    bgr = np.random.default_rng(0).integers(0, 256, (6, 7, 3), dtype=np.uint8)

    left, right = prepare_views(bgr, bgr[:, ::-1].copy(), 1)

    grey = bgr @ np.array([0.114, 0.587, 0.299])  # ITU-R BT.601
    assert left.dtype == np.uint8
    np.testing.assert_allclose(left, grey, atol=0.51)
    np.testing.assert_array_equal(right, left[:, ::-1])


def test_the_brightest_pixel_of_both_views_is_white():
    left = np.array([[0, 100, 1000], [2000, 3000, 4000]], np.uint16)
    right = np.full((2, 3), 2000, np.uint16)

    for one, other in ((left, right), (right, left)):
        views = prepare_views(one, other, 1)
        for view, given in zip(views, (one, other), strict=True):
            np.testing.assert_allclose(view, given * (255 / 4000), atol=0.51)


def test_eight_bits_stay_as_they_are_and_black_stays_black():
    dark = np.arange(12, dtype=np.uint8).reshape(3, 4)
    np.testing.assert_array_equal(prepare_views(dark, dark, 1)[0], dark)
    for kind in (np.uint8, np.uint16):
        black = np.zeros((3, 4), kind)
        assert not prepare_views(black, black, 1)[0].any()


def test_one_of_16_bits_is_not_taken_for_black():
    faint = np.eye(4, dtype=np.uint16)
    assert (prepare_views(faint, 0 * faint, 1)[0] == 255 * np.eye(4)).all()


@pytest.mark.parametrize("factor", [2, 3])
def test_a_small_view_has_the_means_of_the_pixels_it_stands_for(factor):
    view = np.random.default_rng(1).integers(0, 256, (6 * factor, 8 * factor), dtype=np.uint8)
    means = view.reshape(6, factor, 8, factor).mean(axis=(1, 3))

    both = shrink_both((view, 255 - view), factor)

    np.testing.assert_allclose(both[0], means, atol=0.51)
    np.testing.assert_allclose(both[1], 255 - means, atol=0.51)
    np.testing.assert_array_equal(prepare_views(view, view, factor)[1], both[0])
    assert shrink(view, 1) is view


@pytest.mark.parametrize(
    ("shape", "kind"),
    [((4, 5), "i2"), ((4, 5), "f4"), ((4, 5, 4), "u1"), ((4, 5, 1), "u1"), ((4, 5, 3), "i4")],
)
def test_other_kinds_are_named_and_refused(shape, kind):
    image = np.ones(shape, kind)
    with pytest.raises(InputError, match="grey and BGR images of 8 and 16 bits can"):
        prepare_views(image, image, 1)


@pytest.mark.parametrize("other", [(4, 6), (3, 5)])
def test_views_of_two_sizes_are_refused(other):
    with pytest.raises(InputError, match=f"5x4 and {other[1]}x{other[0]}"):
        prepare_views(np.ones((4, 5), np.uint8), np.ones((*other, 3), np.uint8), 1)
