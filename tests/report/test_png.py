"""What a sketch is as a PNG, pixel by pixel."""

import math

import cv2
import numpy as np
import pytest

from rollcli.report.colours import LIGHT, rgb
from rollcli.report.figures import Area, Line, Marks, Sketch, Words, png_file

WIDTH, HEIGHT, FRAME = 200, 120, (40, 20, 140, 80)  # the frame reaches from (40, 20) to (180, 100)


def picture(inside=(), around=(), scale=1.0, font=20.0):
    """The sketch of these items as an array, RGB."""
    data = png_file(Sketch("", WIDTH, HEIGHT, font, FRAME, tuple(inside), tuple(around)), scale)
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def inked(shown):
    """How much of each pixel is not white, from 0 to 1 of what is darkest."""
    dark = 255.0 - shown.min(axis=2)
    return dark / dark.max()


def extent(shown):
    """Left, top, right and bottom of what is drawn, to about half a pixel."""
    rows, columns = (np.flatnonzero(inked(shown).max(axis=axis) > 0.5) for axis in (1, 0))
    return columns[0], rows[0], columns[-1] + 1, rows[-1] + 1


def box(left, top, right, bottom, colour="c1"):
    return Area(np.array([(left, top), (right, top), (right, bottom), (left, bottom)], float), colour)


@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_an_area_lies_in_the_frame_and_is_cut_off_at_its_edges(scale):
    shown = picture([box(10, 30, 20, 50)], scale=scale)
    assert shown.shape == (HEIGHT * scale, WIDTH * scale, 3)
    assert extent(shown) == pytest.approx([50 * scale, 50 * scale, 60 * scale, 70 * scale], abs=1)
    middle = shown[round(60 * scale), round(55 * scale)]
    assert tuple(middle) == rgb("c1")
    assert tuple(shown[0, 0]) == (255, 255, 255)
    beyond = picture([box(-500, -500, 500, 500)], scale=scale)
    assert extent(beyond) == pytest.approx([40 * scale, 20 * scale, 180 * scale, 100 * scale], abs=1)
    assert extent(picture(around=[box(10, 30, 20, 50)], scale=scale))[0] == pytest.approx(10 * scale, abs=1)


def test_a_light_colour_lets_shine_through_what_lies_below():
    shown = picture([box(0, 0, 70, 80, "error"), box(35, 0, 105, 80, "band")])
    digits, opacity = LIGHT["band"]
    for column, below in ((60, None), (90, rgb("error")), (130, (255, 255, 255))):
        expected = (
            rgb("error")
            if below is None
            else [
                opacity * band + (1 - opacity) * each
                for band, each in zip(bytes.fromhex(digits), below, strict=True)
            ]
        )
        assert shown[60, column] == pytest.approx(expected, abs=2)
    for left, top in ((-90, 10), (150, 10), (10, -90), (10, 90)):  # wholly outside of it
        outside = picture([box(left, top, left + 20, top + 20, "band")])
        assert outside.min() == 255
    edge = picture([box(-30, -30, 20, 20, "band")])  # reaches out of the frame
    assert extent(edge) == pytest.approx([40, 20, 60, 40], abs=1)
    assert edge[30, 50] == pytest.approx(shown[60, 130], abs=2)


def test_a_line_is_as_wide_as_it_says_but_for_its_soft_edges():
    def across(width, colour="c1"):
        return inked(picture([Line(np.array([(20.0, 40.0), (100.0, 40.0)]), colour, width)]))[:, 100]

    assert across(3.0).sum() == pytest.approx(3.5, abs=0.5)
    assert across(8.0).sum() - across(3.0).sum() == pytest.approx(5, abs=0.1)
    rows = np.flatnonzero(across(8.0) > 0.1)
    assert (rows[0] + rows[-1] + 1) / 2 == pytest.approx(60, abs=0.6)
    assert across(0.1).max() > 0  # no line vanishes
    np.testing.assert_allclose(across(8.0, "band"), across(8.0), atol=0.1)


def test_dashes_and_gaps_are_alike_and_turn_with_the_line():
    corner = np.array([(0.0, 10.0), (45.0, 10.0), (45.0, 70.0)])
    shown = inked(picture([Line(corner, "c1", 2.0, dash=20.0)]))
    along = shown[29:32, 40:85].max(axis=0) > 0.5
    assert along[4:16].all()
    assert not along[25:35].any()
    down = shown[30:95, 84:87].max(axis=1) > 0.5
    assert down[2:12].all()  # the second dash begins 5 px before the corner and ends 15 px behind it
    assert not down[19:31].any()
    assert down[38:52].all()
    assert not down[59:].any()


@pytest.mark.parametrize(("symbol", "share"), [("circle", math.pi / 4), ("diamond", 0.5), ("cross", None)])
def test_marks_are_as_large_as_they_say_and_lie_at_their_points(symbol, share):
    size = 24.0
    shown = inked(picture([Marks(np.array([(30.0, 40.0), (110.0, 40.0)]), "c1", symbol, size)]))
    for centre in (70, 150):
        part = shown[60 - 20 : 60 + 20, centre - 20 : centre + 20]
        rows, columns = np.mgrid[-19.5:20, -19.5:20]
        assert (part * columns).sum() / part.sum() == pytest.approx(0, abs=0.6)
        assert (part * rows).sum() / part.sum() == pytest.approx(0, abs=0.6)
        reach = np.flatnonzero(part.max(axis=0) > 0.3)
        pen = size / 4 * math.sqrt(0.5) if symbol == "cross" else 0
        assert np.ptp(reach) + 1 == pytest.approx(size + pen, abs=3)
        if share is None:  # two strokes along the diagonals
            assert part[20, 20] == part[12, 12] == part[12, 27] == pytest.approx(1, abs=0.1)
            assert part[20, 8:14].max() == part[8:14, 20].max() == 0
            assert part.sum() == pytest.approx(2 * size / 4 * size * math.sqrt(2), rel=0.25)
        else:
            assert part.sum() == pytest.approx(share * size**2, rel=0.1)


def test_where_two_marks_overlap_there_is_no_hole():
    points = np.array([(60.0, 40.0), (66.0, 40.0)])
    assert inked(picture([Marks(points, "c1", "circle", 24.0)]))[60, 103] == 1


@pytest.mark.parametrize(
    ("anchor", "left", "right"), [("start", 0, 1), ("middle", -0.5, 0.5), ("end", -1, 0)]
)
@pytest.mark.parametrize("upright", [False, True])
def test_words_begin_end_or_have_their_middle_at_their_place(anchor, left, right, upright):
    x, y = 100, 60
    shown = picture(around=[Words(x, y, "HEH", "text", anchor, upright=upright)])
    reached = extent(shown)
    if upright:  # they read from below to above: their foot is at the right
        along, capital, foot = (y - reached[3], y - reached[1]), reached[2] - reached[0], reached[2] - x
    else:
        along, capital, foot = (reached[0] - x, reached[2] - x), reached[3] - reached[1], reached[3] - y
    length = along[1] - along[0]
    assert along == pytest.approx((left * length, right * length), abs=3)
    assert capital == pytest.approx(0.72 * 20, abs=2)
    assert foot == pytest.approx(0, abs=2)
    assert 30 < length < 45


def test_words_are_cut_off_at_the_edges_and_a_true_minus_is_written():
    for x, y in ((-10, 60), (195, 60), (100, 4), (100, 125), (-500, 60), (100, 900)):
        shown = picture(
            around=[Words(x, y, "HEH", "text"), Line(np.array([(99.0, 60.0), (101.0, 60.0)]), "c1", 2)]
        )
        assert shown.shape == (HEIGHT, WIDTH, 3)
    assert inked(picture(around=[Words(-10, 60, "HEHHEH", "text")]))[50:60, :20].max() == 1
    minus, plain = (picture(around=[Words(50, 60, text, "text")]) for text in ("−1", "-1"))
    np.testing.assert_array_equal(minus, plain)


def test_words_lie_on_what_is_below_them():
    under = [box(0, 0, 200, 120, "grid")]
    shown = picture(around=[*under, Words(100, 60, "H", "text")])
    assert tuple(shown[80, 100]) == rgb("grid")
    assert tuple(shown[62, 100]) == rgb("grid")  # the white around letters covers nothing
    assert shown.min() < 100
