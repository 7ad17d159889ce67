"""Views are made grey, 8 bits deep and small, as their numbers say."""

import cv2
import numpy as np
import pytest
from scipy import ndimage

from rollcli.stereo.sampling import sampled, smoothed_at_pixels
from rollcli.stereo.views import (
    as_bright,
    as_clear,
    as_sharp,
    matched_shape,
    prepare_views,
    shows_nothing,
    shrink,
    shrink_both,
)


def test_colours_are_weighted_as_the_eye_does():
    bgr = np.random.default_rng(0).integers(0, 256, (6, 7, 3), dtype=np.uint8)

    left, right = prepare_views(bgr, bgr[:, ::-1].copy())

    grey = bgr @ np.array([0.114, 0.587, 0.299])  # ITU-R BT.601
    assert left.dtype == np.uint8
    np.testing.assert_allclose(left, grey, atol=0.51)
    np.testing.assert_array_equal(right, left[:, ::-1])


def test_the_brightest_pixel_of_both_views_is_white():
    left = np.array([[0, 100, 1000], [2000, 3000, 4000]], np.uint16)
    right = np.full((2, 3), 2000, np.uint16)

    for one, other in ((left, right), (right, left)):
        views = prepare_views(one, other)
        for view, given in zip(views, (one, other), strict=True):
            np.testing.assert_allclose(view, given * (255 / 4000), atol=0.51)


def test_eight_bits_stay_as_they_are_and_black_stays_black():
    dark = np.arange(12, dtype=np.uint8).reshape(3, 4)
    np.testing.assert_array_equal(prepare_views(dark, dark)[0], dark)
    for kind in (np.uint8, np.uint16):
        black = np.zeros((3, 4), kind)
        assert not prepare_views(black, black)[0].any()


def test_one_of_16_bits_is_not_taken_for_black():
    faint = np.eye(4, dtype=np.uint16)
    assert (prepare_views(faint, 0 * faint)[0] == 255 * np.eye(4)).all()


@pytest.mark.parametrize("factor", [2, 3])
def test_a_small_view_has_the_means_of_the_pixels_it_stands_for(factor):
    view = np.random.default_rng(1).integers(0, 256, (6 * factor, 8 * factor), dtype=np.uint8)
    means = view.reshape(6, factor, 8, factor).mean(axis=(1, 3))

    both = shrink_both((view, 255 - view), factor)

    np.testing.assert_allclose(both[0], means, atol=0.51)
    np.testing.assert_allclose(both[1], 255 - means, atol=0.51)
    np.testing.assert_array_equal(shrink(view, factor), both[0])
    assert shrink(view, 1) is view


@pytest.mark.parametrize("factor", [2, 4])
@pytest.mark.parametrize("shape", [(375, 1242), (376, 1241), (373, 1243)])
def test_rows_of_an_odd_view_lie_at_even_distances(factor, shape):
    """As a calibration is scaled where they are matched; so many rows apart where they are looked at."""
    lowest = np.clip(np.indices(shape)[0] - shape[0] + 256, 0, 255).astype(np.uint8)  # a grey level a row
    matched, looked_at = shrink(lowest, factor), shrink_both((lowest, lowest), factor)[0]
    for small, apart in ((matched, shape[0] / matched_shape(shape, factor)[0]), (looked_at, factor)):
        assert small.shape == matched_shape(shape, factor)
        seen = np.indices(small.shape)[0] * apart + (apart - 1) / 2 - shape[0] + 256
        np.testing.assert_allclose(small[-50:-1], seen[-50:-1], atol=0.6)  # the last row may stand for fewer


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_grey_levels_are_those_at_32nds_of_a_pixel_on_every_opencv(kind):
    rng = np.random.default_rng(4)
    view = rng.integers(0, 256, (30, 40)).astype(kind)
    u, v = rng.uniform(0, 38.9, (50, 64)), rng.uniform(0, 28.9, (50, 64))

    grey = sampled(view, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR)

    places = [np.rint(32 * each.astype(np.float32)) / 32.0 for each in (v, u)]
    exact = ndimage.map_coordinates(view.astype(float), places, order=1)
    assert grey.dtype == kind
    if kind == np.uint8:
        np.testing.assert_array_equal(grey, np.floor(exact + 0.5))
    else:
        np.testing.assert_allclose(grey, exact, atol=1e-3)


def test_what_is_halfway_between_two_grey_levels_is_rounded_up_in_every_column():
    view = np.random.default_rng(5).integers(0, 256, (40, 75), dtype=np.uint8)
    wider = np.pad(view.astype(float), 1, mode="reflect")
    down = (wider[:-2] + 6 * wider[1:-1] + wider[2:]) / 8
    smooth = (down[:, :-2] + 6 * down[:, 1:-1] + down[:, 2:]) / 8

    np.testing.assert_array_equal(smoothed_at_pixels(view), np.floor(smooth + 0.5))


GREY = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (120, 160), dtype=np.uint8), (0, 0), 1.5)


@pytest.mark.parametrize(("left", "right"), [(1.0, 0.5), (0.4, 1.0), (0.7, 1.3)])
def test_a_view_exposed_less_is_brightened_to_the_other_and_one_in_focus_smoothed_to_it(left, right):
    one, other = as_bright(tuple(np.minimum(GREY * by, 255).astype(np.uint8) for by in (left, right)))

    np.testing.assert_allclose(one.astype(int), other.astype(int), atol=4)
    one, other = as_sharp((cv2.GaussianBlur(GREY, (0, 0), 2), GREY))
    np.testing.assert_allclose(one.astype(int), other.astype(int), atol=4)


@pytest.mark.parametrize(
    "other_camera",
    [
        lambda grey: 255 * (grey / 255) ** 0.6,
        lambda grey: 255 * (grey / 255) ** 1.5,
        lambda grey: grey + 30.0,
        lambda grey: np.maximum(grey - 30.0, 0),
        lambda grey: 0.5 * grey + 90,
    ],
)
@pytest.mark.parametrize("swapped", [False, True])
def test_a_view_of_another_gamma_or_offset_gets_the_others_grey_levels(other_camera, swapped):
    views = GREY, np.rint(other_camera(GREY)).astype(np.uint8)

    one, other = as_bright(views[::-1] if swapped else views)

    # one in 20 is darker than the first quantile, one brighter than the last
    assert np.percentile(np.abs(one.astype(int) - other), 88) <= 4


@pytest.mark.parametrize(
    ("by", "haze", "kind"), [(1, 1, np.uint8), (1, 150, np.uint8), (99, 9000, np.uint16)]
)
def test_dark_and_hazy_views_have_the_grey_levels_of_clear_ones(by, haze, kind):
    clear = (4 * (GREY.astype(int) - 128) + 128).clip(16, 240).astype(np.uint8)
    dim = (clear // 4).astype(kind) * kind(by) + kind(haze)

    # the brightest may be clipped
    np.testing.assert_allclose(np.minimum(as_clear(prepare_views(dim, dim))[1], 240), clear, atol=9)
    assert all(each is clear for each in as_clear((clear, clear)))


def test_faint_views_are_spread_by_four_times_at_most():
    """More would be noise."""
    faint = (GREY // 16 + 20,) * 2
    between = np.percentile(faint[0], [5, 95])
    assert np.diff(np.percentile(as_clear(faint)[0], [5, 95])) == pytest.approx(4 * np.diff(between), abs=1)


@pytest.mark.parametrize("level", [0, 16])
def test_neither_a_border_of_one_view_alone_nor_a_tenth_more_light_makes_a_view_brighter(level):
    grey = np.random.default_rng(0).integers(60, 200, (120, 160), dtype=np.uint8)
    bordered = grey.copy()
    bordered[-50:] = level

    for views in ((grey, bordered), (bordered, grey), (grey, (grey * 1.1).astype(np.uint8))):
        assert all(a is b for a, b in zip(as_bright(views), views, strict=True))


@pytest.mark.parametrize("level", [0, 255])
def test_patches_that_were_clipped_show_nothing_and_single_pixels_do(level):
    view = np.random.default_rng(0).integers(1, 255, (60, 80), dtype=np.uint8)
    assert shows_nothing(view) is None
    view[::5, ::4] = level
    assert shows_nothing(view) is None
    view[20:30, 30:40] = level
    nothing = shows_nothing(view)
    assert nothing is not None
    assert nothing[19:31, 29:41].all()
    assert nothing.sum() <= 14 * 14  # single pixels beside the patch widen it


def test_a_dark_edge_of_one_level_shows_nothing():
    view = np.random.default_rng(0).integers(20, 250, (60, 80), dtype=np.uint8)
    view[-10:] = 16
    nothing = shows_nothing(view)
    assert nothing is not None
    assert nothing[-11:].all()
    assert nothing.sum() == 11 * 80


def test_a_defect_pixel_of_16_bits_makes_no_view_dark():
    view = np.random.default_rng(0).integers(0, 4096, (120, 160)).astype(np.uint16)
    defect = view.copy()
    defect[50, 60] = 65535

    plain, found = prepare_views(view, view)[0], prepare_views(defect, view)

    for each in found:
        different = np.abs(each.astype(int) - plain) > 1
        assert different.sum() <= 1


def test_either_byte_order_of_16_bits_is_read():
    view = np.random.default_rng(0).integers(0, 4096, (6, 7)).astype("<u2")
    plain = prepare_views(view, view)

    np.testing.assert_array_equal(prepare_views(view.astype(">u2"), view.astype(">u2")), plain)
