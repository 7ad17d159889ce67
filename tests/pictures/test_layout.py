"""Where lines, labels and curves stand in pictures, in pixels, and with which colours."""

import cv2
import numpy as np
import pytest

from rollcli.pictures.heights_preview import draw_heights
from rollcli.pictures.overlay import BAR_WIDTH, draw_disparity, draw_preview, draw_road, draw_road_on_photo
from rollcli.pictures.vdisparity import BOTTOM_MARGIN, LEFT_MARGIN, VDisparity, draw_v_disparity, v_disparity

INK, CYAN, ROAD = (60, 60, 60), (255, 255, 0), (220, 230, 40)


def boxes(picture, axis):
    """First and last row (axis 0) or column (axis 1) of each piece of ink that a blank line divides."""
    inked = (picture < 250).any(axis=2).any(axis=1 - axis).astype(int)
    starts, ends = (np.flatnonzero(np.diff(inked, prepend=0, append=0) == way) for way in (1, -1))
    return list(zip(starts.tolist(), (ends - 1).tolist(), strict=True))


def size_of(text, unit=1):
    canvas = np.full((80, 400, 3), 255, np.uint8)
    cv2.putText(canvas, text, (40, 40), cv2.FONT_HERSHEY_SIMPLEX, 0.36 * unit, INK, unit, cv2.LINE_AA)
    (top, bottom), (left, right) = (
        (each[0][0], each[-1][1]) for each in (boxes(canvas, 0), boxes(canvas, 1))
    )
    return canvas[top : bottom + 1, left : right + 1], left - 40, bottom - 40


def find_text(picture, text, unit=1):
    """The places (row, column) of a text in a picture, from its own letters."""
    letters, _, _ = size_of(text, unit)
    off = cv2.matchTemplate(picture, letters, cv2.TM_SQDIFF)
    rows, columns = np.nonzero(off < 5000)  # of float32: another digit has a hundred thousand
    height, width = letters.shape[:2]
    return [
        (int(row), int(row) + height - 1, int(column), int(column) + width - 1)
        for row, column in zip(rows, columns, strict=True)
    ]


def counts_of(height=200, top=100.0, bins=100):
    """A road from 20 to 80 px, a row of counts each."""
    counts = np.zeros((height, bins), np.int32)
    at = np.linspace(0.2 * bins, 0.8 * bins, height).astype(int)
    counts[np.arange(height), at] = np.arange(height) + 1
    counts[:, -1] = 5  # so that all is shown
    return VDisparity(counts, top)


@pytest.mark.parametrize(("height", "unit"), [(200, 1), (959, 1), (960, 2), (1440, 3)])
def test_all_of_a_v_disparity_picture_grows_with_its_rows(height, unit):
    picture = draw_v_disparity(counts_of(height, top=96.0, bins=96))

    left, below = LEFT_MARGIN * unit, picture[height:]
    assert picture.shape == (height + BOTTOM_MARGIN * unit, left + 320 * unit, 3)
    ink = (picture == INK).all(axis=2)
    step = {1: 50, 2: 100, 3: 200}[unit]  # 40 px and more, at a round number
    for row in range(0, height, step):
        assert ink[row, left - 4 * unit : left].all()
        named = [abs(box[0] + box[1] - 2 * row) for box in find_text(picture[:, :left], f"{row}", unit)]
        assert row == 0 or min(named) <= 4 * unit
    assert len(find_text(below[:, :left], "row", unit)) == 1
    for text, disparity in (("disparity, px", 48), ("20", 20), ("40", 40), ("60", 60), ("80", 80)):
        middle = left + disparity * 320 * unit / 96
        (box,) = [each for each in find_text(below, text, unit) if abs(sum(each[2:]) / 2 - middle) < 2 * unit]
        assert ink[height : height + 4 * unit, round(middle)].all() == (text != "disparity, px")
        assert (box[1] > 20 * unit) == (text == "disparity, px")  # below the numbers
    assert not find_text(below, "10", unit)  # they are 60 px and more apart


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


@pytest.mark.parametrize(("height", "unit"), [(200, 1), (960, 2)])
def test_the_road_is_dashed_and_lies_where_its_parabola_is(height, unit):
    histogram = counts_of(height)
    alpha, offset = (30.0, 40 / height, 10 / height**2), 7.0
    plain = draw_v_disparity(histogram)
    drawn = draw_v_disparity(histogram, alpha, offset)
    changed = (plain != drawn).any(axis=2)[:height, LEFT_MARGIN * unit :]
    assert not (plain != drawn)[height:].any()
    cyan = (drawn == CYAN).all(axis=2)[:height, LEFT_MARGIN * unit :]
    for row in range(2 * unit, height):
        phase = row % (16 * unit)
        if unit < phase < 7 * unit - unit:
            y = row + offset
            road = (alpha[0] + alpha[1] * y + alpha[2] * y**2) * 320 * unit / 100
            columns = np.flatnonzero(changed[row])
            assert columns.mean() == pytest.approx(road, abs=0.8 * unit + 0.5)
            assert 2 <= len(columns) <= 4 * unit + 2
            assert cyan[row].any() or unit == 1
        elif 9 * unit < phase < 15 * unit:
            assert not changed[row].any()


def test_a_road_at_the_border_of_the_chart_is_drawn_to_it():
    histogram = counts_of()
    plain = draw_v_disparity(histogram)
    for disparity, column in ((0.0, 0), (0.2, 0), (99.8, 319)):
        changed = (draw_v_disparity(histogram, (disparity, 0, 0)) != plain).any(axis=2)[:200, LEFT_MARGIN:]
        assert changed[4, column]
    for disparity in (-0.2, 100.0, 140.0):
        assert np.array_equal(draw_v_disparity(histogram, (disparity, 0, 0)), plain)


@pytest.mark.parametrize(
    ("height", "unit", "row"), [(200, 1, 120), (960, 2, 500), (200, 1, 3), (200, 1, 0), (200, 1, 199)]
)
def test_the_horizon_is_dashed_and_named(height, unit, row):
    histogram = counts_of(height)
    plain, drawn = draw_v_disparity(histogram), draw_v_disparity(histogram, horizon=float(row))
    line = (drawn == (120, 220, 120)).all(axis=2)[row, LEFT_MARGIN * unit :]
    expected = np.arange(320 * unit) // (8 * unit) % 2 == 0
    free = slice(60 * unit, None) if row < 12 * unit else slice(None)  # its name may lie on it
    assert (line == expected)[free].mean() > (0.99 if unit == 1 else 0.9)
    changed = (plain != drawn).any(axis=2)[:, LEFT_MARGIN * unit :]
    rows = np.flatnonzero(changed[:, 4 * unit : 50 * unit].any(axis=1))
    bottom = max(row - 4 * unit, 10 * unit)
    letters, left, below = size_of("horizon", unit)
    top = bottom + below - letters.shape[0] + 1
    assert rows.min() == pytest.approx(min(top, row), abs=unit)
    if row > 20:
        named = changed.copy()
        named[row - unit : row + unit + 1] = False
        columns = np.flatnonzero(named.any(axis=0))
        assert columns.min() == pytest.approx(4 * unit + left, abs=unit)
        assert columns.max() == pytest.approx(4 * unit + left + letters.shape[1] - 1, abs=unit)
        assert np.flatnonzero(named.any(axis=1)).max() == pytest.approx(bottom + below, abs=unit)


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


@pytest.mark.parametrize(
    ("height", "top", "names"),
    [
        (50, 60, ["60"]),
        (51, 60, []),
        (101, 60, ["50"]),
        (200, 60, ["20", "40", "60"]),
        (400, 0.7, ["0.1", "0.2", "0.6", "0.7"]),
    ],
)
def test_a_bar_names_round_disparities_beside_their_colours(height, top, names):
    preview = draw_preview(np.full((height, 30), float(top)))
    bar, labels = preview[:, 30:54], preview[:, 54:]
    assert preview.shape == (height, 30 + BAR_WIDTH, 3)
    assert (bar[:, :8] == 255).all()
    assert (labels[:, :4] == 255).all()
    levels = np.linspace(255, 1, height).astype(np.uint8)
    np.testing.assert_array_equal(bar[:, 8:24], np.repeat(colours_of(levels)[:, None], 16, axis=1))
    for name in [*names, "0 px"]:
        _, _, below = size_of(name)
        value = float(name.split()[0])
        baseline = min(max(round((1 - value / top) * (height - 1)) + 4, 9), height - 4)
        assert any(abs(box[1] - baseline - below) <= 0 and box[2] <= 7 for box in find_text(labels, name)), (
            name
        )
    assert len(boxes(labels, 0)) == {50: 2, 51: 1, 101: 2, 200: 4, 400: 8}[height]


def test_maps_without_data_have_a_preview_of_one_pixel():
    preview = draw_preview(np.zeros((120, 20)))
    assert not preview[:, :20].any()
    assert find_text(preview[:, 20 + 24 :], "1")
    assert v_disparity(np.zeros((3, 4))).max_disparity == 1


def road_map(height=100, width=80, near=60.0):
    return np.repeat(np.linspace(10, near, height)[:, None], width, axis=1)


@pytest.mark.parametrize("horizon", [-5.0, 99.5, 1e9])
def test_a_horizon_outside_of_the_map_is_not_drawn(horizon):
    histogram = v_disparity(road_map())
    np.testing.assert_array_equal(draw_v_disparity(histogram), draw_v_disparity(histogram, horizon=horizon))


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


@pytest.mark.parametrize(("unit", "zero"), [("metres", "0 m"), ("camera heights", "0 H")])
def test_the_bar_of_heights_names_its_ends_and_its_unit_where_the_road_is(unit, zero):
    bar = draw_heights(np.zeros((200, 40), np.float32), (-0.1, 0.1), unit)[:, 40:]
    for text, row in (("+0.1", 5), (zero, 100), ("-0.1", 195)):
        assert any(abs((box[0] + box[1]) / 2 - row) <= 5 for box in find_text(bar, text))
