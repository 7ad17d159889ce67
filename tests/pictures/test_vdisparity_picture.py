"""The picture of a v-disparity shows the road, the horizon, rows and disparities."""

import numpy as np
import pytest

from rollcli.pictures.vdisparity import BOTTOM_MARGIN, LEFT_MARGIN, draw_v_disparity, v_disparity

CYAN = (255, 255, 0)


def road_map(height=100, width=80, near=60.0):
    return np.repeat(np.linspace(10, near, height)[:, None], width, axis=1)


def chart(picture):
    """The part of a picture whose rows are those of the map."""
    return picture[:-BOTTOM_MARGIN, LEFT_MARGIN:]


def test_the_road_is_drawn_in_a_colour_that_counts_do_not_have():
    histogram = v_disparity(road_map())

    plain = chart(draw_v_disparity(histogram))
    drawn = chart(draw_v_disparity(histogram, (10, 50 / 99, 0)))

    assert plain.shape == drawn.shape
    changed = (plain != drawn).any(axis=2)
    assert 30 < changed.any(axis=1).sum() < 70  # every other piece of eight rows
    per_pixel = drawn.shape[1] / 61  # the histogram ends there, below the next multiple of 16
    drawn_rows = changed.any(axis=1)
    rows = np.flatnonzero(drawn_rows[1:-1] & drawn_rows[:-2] & drawn_rows[2:]) + 1  # not the ends of dashes
    middles = [np.flatnonzero(changed[row]).mean() for row in rows]
    road = np.linspace(10, 60, 100)[rows] * per_pixel
    np.testing.assert_allclose(middles, road, atol=per_pixel * 50 / 99)  # within a row


def test_a_few_outliers_do_not_change_the_range():
    values = road_map(100, 400)
    with_outliers = values.copy()
    with_outliers[0, :20] = 900.0

    kept = chart(draw_v_disparity(v_disparity(with_outliers, bins=1000, max_disparity=1000)))
    plain = chart(draw_v_disparity(v_disparity(values, bins=1000, max_disparity=1000)))

    assert kept.shape == plain.shape
    np.testing.assert_array_equal(kept[1:], plain[1:])


def test_frames_of_one_drive_share_their_range():
    near = [
        chart(draw_v_disparity(v_disparity(road_map(near=n), bins=400, max_disparity=100))) for n in (58, 63)
    ]
    assert near[0].shape == near[1].shape


@pytest.mark.parametrize(("bins", "near"), [(61, 60.0), (256, 60.0), (319, 90.0), (330, 90.0), (1024, 200.0)])
def test_maps_of_one_size_have_pictures_of_one_size(bins, near):
    histogram = v_disparity(road_map(near=near), bins=bins, max_disparity=near + 1)
    assert draw_v_disparity(histogram).shape == (100 + BOTTOM_MARGIN, LEFT_MARGIN + 320, 3)


def test_a_high_map_has_a_picture_as_wide_for_its_height_with_letters_that_can_be_read():
    histogram = v_disparity(road_map(height=1080, width=100, near=90.0))
    picture = draw_v_disparity(histogram, (10, 80 / 1079, 0), horizon=300.0)
    assert picture.shape == (1080 + 2 * BOTTOM_MARGIN, 2 * (LEFT_MARGIN + 320), 3)
    below = (picture[1080 + 20 : 1080 + 2 * 15, 2 * LEFT_MARGIN :] < 128).any(axis=(0, 2))
    assert below.sum() > 50  # numbers, in the rows where they stand


def test_the_horizon_is_a_line_across_at_its_row():
    histogram = v_disparity(road_map())
    changed = chart(draw_v_disparity(histogram)) != chart(draw_v_disparity(histogram, horizon=40.2))
    rows = np.flatnonzero(changed.any(axis=2).sum(axis=1) > 100)
    assert rows.tolist() == [40]


@pytest.mark.parametrize("horizon", [-5.0, 99.5, 1e9])
def test_a_horizon_outside_of_the_map_is_not_drawn(horizon):
    histogram = v_disparity(road_map())
    np.testing.assert_array_equal(draw_v_disparity(histogram), draw_v_disparity(histogram, horizon=horizon))


def test_the_margins_are_written_on():
    picture = draw_v_disparity(v_disparity(road_map()))
    left, below = picture[:-BOTTOM_MARGIN, :LEFT_MARGIN], picture[-BOTTOM_MARGIN:, LEFT_MARGIN:]
    assert (left < 128).any()
    assert (below < 128).any()


def test_the_same_counts_give_the_same_picture():
    histogram = v_disparity(np.random.default_rng(0).uniform(0, 50, (40, 50)))

    np.testing.assert_array_equal(draw_v_disparity(histogram), draw_v_disparity(histogram))


def test_ticks_are_four_pixels_long_beside_the_rows_and_below_the_disparities():
    picture = draw_v_disparity(v_disparity(road_map()))
    ink = (picture < 128).all(axis=2)
    assert ink[0, :LEFT_MARGIN][-6:].tolist() == [False] * 2 + [True] * 4
    assert ink[-BOTTOM_MARGIN:, LEFT_MARGIN][:6].tolist() == [True] * 4 + [False] * 2
    np.testing.assert_array_equal(chart(picture)[0, :4], chart(picture)[5, :4])  # none of it on the chart


def test_a_road_that_turns_back_within_a_dash_is_a_line_and_no_loop():
    histogram = v_disparity(road_map())
    there_and_back = (42.25, -7.0, 1.0)  # 30 px in the middle of the first eight rows, 42 px at their ends
    plain, drawn = (chart(draw_v_disparity(histogram, road)) for road in (None, there_and_back))
    changed = (plain != drawn).any(axis=2)
    ends = 42.25 * changed.shape[1] / 61
    assert np.flatnonzero(changed[0]).max() == pytest.approx(ends, abs=3)
    assert np.flatnonzero(changed[3]).max() < ends - 20
