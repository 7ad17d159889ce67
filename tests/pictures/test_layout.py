"""Colours of pictures against a few lines of plain NumPy; where things stand in them is on record."""

import cv2
import numpy as np
import pytest

from rollcli.pictures.overlay import draw_disparity, draw_preview, draw_road, draw_road_on_photo
from rollcli.pictures.vdisparity import BOTTOM_MARGIN, LEFT_MARGIN, VDisparity, draw_v_disparity

ROAD = (220, 230, 40)


def counts_of(height=200, top=100.0, bins=100):
    """A road from 20 to 80 px, a row of counts each."""
    counts = np.zeros((height, bins), np.int32)
    at = np.linspace(0.2 * bins, 0.8 * bins, height).astype(int)
    counts[np.arange(height), at] = np.arange(height) + 1
    counts[:, -1] = 5  # so that all is shown
    return VDisparity(counts, top)


@pytest.mark.parametrize(("height", "unit"), [(200, 1), (960, 2)])
def test_names_stand_in_the_margins_in_whole_letters_of_the_size_of_the_picture(height, unit):
    picture = draw_v_disparity(counts_of(height))
    inked = (picture < 250).any(axis=2)
    names, below = inked[:, : (LEFT_MARGIN - 5) * unit], inked[height + 5 * unit :]
    for margin in (names, below):
        assert 0.02 < margin.mean() < 0.2
    assert not names[:, 0].any()
    assert picture.shape[0] == height + BOTTOM_MARGIN * unit
    assert (draw_preview(np.full((200, 30), 60.0))[:, 30 + 28 :] < 128).any(axis=(1, 2)).sum() > 20


def test_the_chart_has_the_colours_of_the_logarithm_of_the_counts():
    picture = draw_v_disparity(counts_of())[:200, LEFT_MARGIN:]

    light = np.log1p(np.arange(1, 201))
    most = np.percentile(np.log1p(np.concatenate([np.arange(1, 201), np.full(200, 5)])), 99.9)
    levels = np.minimum(light * 255 / most, 255).astype(np.uint8)
    expected = cv2.applyColorMap(levels[:, None], cv2.COLORMAP_INFERNO)[:, 0]
    at = np.linspace(20, 80, 200).astype(int)
    for row in range(0, 200, 7):
        columns = slice(int(np.ceil(at[row] * 3.2)), int((at[row] + 1) * 3.2))
        off = picture[row, columns].astype(int) - expected[row]
        assert np.abs(off).max() <= 6  # the next colour, at most
        assert (
            picture[row, 10] == cv2.applyColorMap(np.zeros((1, 1), np.uint8), cv2.COLORMAP_INFERNO)[0, 0]
        ).all()


@pytest.mark.parametrize("per_px", [0.5, 1, 2, 4])
@pytest.mark.parametrize(("last", "shown"), [(15.5, 16), (16.5, 32), (47.5, 48), (48.5, 64)])
def test_the_range_shown_ends_at_the_next_multiple_of_16(last, shown, per_px):
    counts, bin_of_last = np.zeros((50, round(100 * per_px)), np.int32), int(last * per_px)
    counts[:, bin_of_last] = 100
    beyond = int(90 * per_px)

    def bright(few):
        counts[0, beyond] = few
        picture = draw_v_disparity(VDisparity(counts, 100.0))[:50, LEFT_MARGIN:]
        return np.flatnonzero(picture[25].astype(int).sum(axis=1) > 300)

    columns = bright(9)  # 0.18 % of the pixels lie beyond
    per_bin = 320 / shown / per_px
    assert columns[0] == pytest.approx(bin_of_last * per_bin, abs=1)
    assert columns[-1] == pytest.approx((bin_of_last + 1) * per_bin - 1, abs=1)
    assert bright(12)[0] == pytest.approx(bin_of_last / per_px * 320 / 96, abs=3)  # 0.24 %: all is shown


def levels_of(values, top):
    return np.clip(values * (255 / top), 1, 255).astype(np.uint8)


def colours_of(levels):
    """The ramp begins at 40 of 255, so that what is far differs from no data."""
    ramp = np.linspace(40, 255, 256).astype(np.uint8)
    return cv2.applyColorMap(ramp, cv2.COLORMAP_INFERNO).reshape(256, 3)[levels]


def test_disparities_have_the_colours_of_their_share_of_the_largest():
    values = np.linspace(0.01, 90, 5000).reshape(50, 100)
    values[3, 3] = 4000  # one outlier
    top = np.percentile(values, 99)

    np.testing.assert_array_equal(draw_disparity(values), colours_of(levels_of(values, top)))


def test_a_road_is_half_of_its_colour_within_an_outline():
    values = np.linspace(1, 60, 1200).reshape(30, 40)
    mask = np.zeros((30, 40))
    mask[10:25, 5:35] = -3  # whatever is not 0
    plain, drawn = draw_disparity(values), draw_road(values, mask)
    photo = np.random.default_rng(0).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    on_photo = draw_road_on_photo(photo, mask)
    kept = photo.copy()

    for before, after in ((plain, drawn), (photo, on_photo)):
        inside, edge = np.zeros((30, 40), bool), np.zeros((30, 40), bool)
        inside[11:24, 6:34] = edge[10:25, 5:35] = True
        edge &= ~inside
        assert (after[edge] == ROAD).all()
        np.testing.assert_allclose(after[inside], (before[inside].astype(float) + ROAD) / 2, atol=1)
        np.testing.assert_array_equal(after[~inside & ~edge], before[~inside & ~edge])
    np.testing.assert_array_equal(photo, kept)  # the photo that was given is not drawn on


def test_photos_of_16_bits_and_of_other_sizes_are_shrunk_to_the_mask():
    photo = np.random.default_rng(0).integers(0, 65536, (60, 80), dtype=np.uint16)
    picture = draw_road_on_photo(photo, np.zeros((30, 40)))
    means = (photo >> 8).reshape(30, 2, 40, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(picture, np.repeat(means[..., None], 3, axis=2), atol=0.51)


def test_no_data_is_black_and_data_never_is():
    values = np.array([[0, np.nan, -1, np.inf], [0.001, 1, 50, 100]])

    picture = draw_disparity(values)

    assert picture.shape == (2, 4, 3)
    assert picture.dtype == np.uint8
    assert not picture[0].any()
    assert picture[1].any(axis=1).all()


def test_empty_maps_and_empty_masks_are_drawn():
    assert not draw_disparity(np.zeros((3, 4))).any()
    assert draw_road(np.ones((3, 4)), np.zeros((3, 4))).shape == (3, 4, 3)
