"""Pictures of maps: what is no data stays black, and the road stands out."""

import numpy as np
import pytest

from rollcli.pictures import overlay
from rollcli.pictures.overlay import BAR_WIDTH, draw_disparity, draw_preview, draw_road, draw_road_on_photo


def test_no_data_is_black_and_data_never_is():
    values = np.array([[0, np.nan, -1, np.inf], [0.001, 1, 50, 100]])

    picture = draw_disparity(values)

    assert picture.shape == (2, 4, 3)
    assert picture.dtype == np.uint8
    assert not picture[0].any()
    assert picture[1].any(axis=1).all()


def test_larger_disparities_are_brighter():
    brightness = draw_disparity(np.arange(1.0, 100.0)[None]).astype(int).sum(axis=2)[0]

    assert brightness[-1] > brightness[50] > brightness[0]


def test_the_road_is_tinted_and_nothing_else():
    values = np.tile(np.linspace(5, 60, 40), (30, 1))
    mask = np.zeros(values.shape, bool)
    mask[15:, 10:30] = True

    plain, drawn = draw_disparity(values), draw_road(values, mask)

    changed = (plain != drawn).any(axis=2)
    np.testing.assert_array_equal(changed, mask)


def test_empty_maps_and_empty_masks_are_drawn():
    assert not draw_disparity(np.zeros((3, 4))).any()
    assert draw_road(np.ones((3, 4)), np.zeros((3, 4))).shape == (3, 4, 3)


@pytest.mark.parametrize("photo", [np.full((20, 30), 90, np.uint8), np.full((40, 60, 3), 90 << 8, np.uint16)])
def test_the_road_is_tinted_on_a_photo_of_any_kind(photo):
    mask = np.zeros((20, 30))
    mask[10:] = 1
    picture = draw_road_on_photo(photo, mask)
    assert picture.shape == (20, 30, 3)
    assert (picture[:9] == 90).all()
    assert (picture[12:18, 5:25] != 90).all()


def test_a_preview_is_the_map_in_colour_beside_a_bar_from_the_brightest_to_the_darkest():
    values = np.linspace(1, 100, 20000).reshape(100, 200)
    preview = draw_preview(values)
    np.testing.assert_array_equal(preview[:, :200], draw_disparity(values))
    assert preview.shape == (100, 200 + BAR_WIDTH, 3)
    bar = preview[:, 210].astype(int).sum(axis=1)
    assert bar[0] > bar[50] > bar[-1]
    labels = np.flatnonzero((preview[:, 200 + 24 :] < 250).any(axis=(0, 2)))
    assert labels[0] == 4  # pixels right of the bar


def test_a_map_is_drawn_the_same_a_few_rows_at_a_time(monkeypatch):
    disparity = np.random.default_rng(0).uniform(-5, 60, (50, 40)).astype(np.float32)
    whole = draw_disparity(disparity)
    monkeypatch.setattr(overlay, "_BLOCK", 3 * 40)
    assert np.array_equal(draw_disparity(disparity), whole)


def test_labels_of_a_preview_stand_beside_the_colours_they_name():
    values = np.linspace(0.5, 100, 400)
    preview = draw_preview(values[:, None] * np.ones((400, 50))).astype(int)
    picture, bar, labels = preview[:, 25], preview[:, 50 + 16], preview[:, 50 + 24 :]
    inked = (labels < 200).any(axis=(1, 2)).astype(int)
    starts, ends = (np.flatnonzero(np.diff(inked, prepend=0, append=0) == way) for way in (1, -1))
    assert len(starts) == 5  # 80, 60, 40, 20, and 0 px
    for name, start, end in zip((80, 60, 40, 20), starts, ends, strict=False):
        colour = picture[np.abs(values - name).argmin()]
        same = np.abs(bar - colour).sum(axis=1).argmin()
        assert (start + end - 1) / 2 == pytest.approx(same, abs=2)
