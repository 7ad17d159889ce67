"""Where the axes, the legend, the lines and the bars of a chart lie, by arithmetic."""

import numpy as np
import pytest

from rollcli.report.chart import Chart
from rollcli.report.figures import (
    Area,
    Axes,
    Axis,
    Line,
    Marks,
    Words,
    axis_items,
    lay_out,
    legend_items,
    margins,
)

FONT = 20.0
AXES = Axes(Axis((0.0, 10.0), "frame"), Axis((-1.0, 1.0), "roll", zero=True))


def trace(name, **more):
    return {"type": "scatter", "mode": "lines", "name": name, "line": {"color": "@c1", "width": 2}, **more}


@pytest.mark.parametrize(
    ("axis", "length", "apart", "expected"),
    [
        (((0.0, 10.0), "x"), 1000, 200, {0: "0", 200: "2", 400: "4", 600: "6", 800: "8", 1000: "10"}),
        (((-0.1, 0.1), "x"), 100, 25, {0: "−0.10", 25: "−0.05", 50: "0.00", 75: "0.05", 100: "0.10"}),
        (((0.5, 2.5), "x", 1.0), 200, 10, {50: "1", 150: "2"}),  # no half frames
        (((-500.0, 2500.0), "x"), 300, 100, {50: "0", 150: "1,000", 250: "2,000"}),
        (((0.95, 1.25), "x"), 300, 100, {50: "1.0", 150: "1.1", 250: "1.2"}),
    ],
)
def test_labels_stand_at_round_numbers_and_not_nearer_than_asked(axis, length, apart, expected):
    found = Axis(*axis).ticks(length, apart)
    assert [text for _, text in found] == list(expected.values())
    assert [place for place, _ in found] == pytest.approx(list(expected), abs=1e-9)


def test_an_axis_takes_its_ends_name_step_and_zero_from_the_layout():
    title = {"title": {"text": "frame"}}
    plain = Axis.of({**title, "range": [1, 5]})
    assert plain == ((1.0, 5.0), "frame", 0.0, False)
    assert Axis.of({**title, "range": [1, 5], "dtick": 1, "zeroline": True}) == (
        (1.0, 5.0),
        "frame",
        1.0,
        True,
    )


def test_labels_stand_beside_the_lines_that_they_name():
    left, top, width, height = 100, 50, 800, 640
    words = list(AXES.names(left, top, width, height, FONT))
    lines = list(axis_items(AXES, width, height, FONT))
    across = [each for each in lines if each.points[0, 1] == each.points[1, 1]]
    upward = [each for each in lines if each.points[0, 0] == each.points[1, 0]]
    below = [each for each in words if each.anchor == "middle" and each.text.isdigit()]
    beside = [each for each in words if each.anchor == "end"]
    assert [each.x - left for each in below] == pytest.approx([each.points[0, 0] for each in upward])
    # letters are 0.7 of the font's size high: their middle is at the line
    assert [each.y - top - 0.35 * FONT for each in beside] == pytest.approx(
        [each.points[0, 1] for each in across]
    )
    assert {tuple(each.points[:, 1]) for each in upward} == {(0.0, height)}
    assert {tuple(each.points[:, 0]) for each in across} == {(0.0, width)}
    assert {each.y for each in below} == {top + height + 1.4 * FONT}
    assert {each.x for each in beside} == {left - 0.5 * FONT}
    name, upright = words[-2:]
    assert (name.text, name.x, name.y) == ("frame", left + width / 2, top + height + 3 * FONT)
    assert (upright.text, upright.y, upright.upright) == ("roll", top + height / 2, True)


def test_the_line_of_zero_is_twice_as_wide_where_zero_is_marked():
    lines = list(axis_items(AXES, 800, 400, 39.0))
    assert {(each.colour, each.width) for each in lines} == {("grid", 3), ("line", 6)}
    (zero,) = (each for each in lines if each.colour == "line")
    assert zero.points == pytest.approx(np.array([(0, 200), (800, 200)]))
    unmarked = AXES._replace(y=AXES.y._replace(zero=False))
    assert {each.colour for each in axis_items(unmarked, 800, 400, 13.0)} == {"grid"}


def test_margins_hold_the_labels_the_names_and_the_legend():
    axes = AXES._replace(y=Axis((-2.0, 2.0), "roll"))
    left, top, right, bottom = margins(axes, 600, FONT, rows=2)
    words = list(axes.names(left, top, 800, 600, FONT))
    widest = max(len(each.text) for each in words if each.anchor == "end")
    upright = words[-1]
    # letters 0.56 of the font's size wide, half a font's size from the axis; the name's foot is beside them
    assert left - (0.5 + 0.56 * widest) * FONT - upright.x == pytest.approx(0.6 * FONT, abs=1)
    lowest = max(each.y for each in words if not each.upright)
    assert 0.25 * FONT < top + 600 + bottom - lowest < FONT
    assert margins(axes, 600, FONT, rows=3)[1] - top == pytest.approx(1.55 * FONT, abs=1)
    baselines = [
        each.y
        for row in legend_items(Chart("x", "x", [trace("a" * 30), trace("b" * 30)]), 500, FONT)
        for each in row
        if isinstance(each, Words)
    ]
    assert len(set(baselines)) == 2
    assert 0.25 * FONT < top - max(baselines) < 1.5 * FONT
    assert 0.5 * FONT < right < 1.2 * FONT


def test_a_legend_runs_on_in_the_next_row_where_a_name_does_not_fit():
    chart = Chart("x", "x", [trace("one"), trace("second"), trace("3")])
    needed = [FONT * (2.3 + 0.5 + 0.56 * len(name)) for name in ("one", "second", "3")]
    step = 1.1 * FONT
    first_two = 0.5 * FONT + needed[0] + step + needed[1]
    for width, names in (
        (first_two + 1, [["one", "second"], ["3"]]),
        (first_two - 1, [["one"], ["second", "3"]]),
        (2000, [["one", "second", "3"]]),
        (10, [["one"], ["second"], ["3"]]),
    ):
        rows = list(legend_items(chart, width, FONT))
        texts = [[each for each in row if isinstance(each, Words)] for row in rows]
        assert [[each.text for each in row] for row in texts] == names
        for number, row in enumerate(texts):
            assert [each.y for each in row] == pytest.approx([(1.25 + 1.55 * number) * FONT] * len(row))
            assert row[0].x == pytest.approx((0.5 + 2.3 + 0.5) * FONT)
    (row,) = legend_items(chart, 2000, FONT)
    places = [each.x for each in row if isinstance(each, Words)]
    assert np.diff(places) == pytest.approx([each + step for each in needed[:2]])


def test_a_legend_is_in_the_order_of_the_ranks_and_leaves_out_what_has_no_name_there():
    traces = [
        trace("late", legendrank=1001),
        trace("hidden", showlegend=False),
        trace("soon"),
        trace("first", legendrank=1),
    ]
    (row,) = legend_items(Chart("x", "x", traces), 2000, FONT)
    assert [each.text for each in row if isinstance(each, Words)] == ["first", "soon", "late"]
    assert list(legend_items(Chart("x", "x", traces, {"showlegend": False}), 2000, FONT)) == []


def test_the_samples_of_a_legend_look_like_what_they_name():
    marker = {"color": "@suspect", "symbol": "diamond"}
    traces = [
        {"type": "bar", "name": "bar", "marker": {"color": "@c2"}},
        trace("band", fill="toself", fillcolor="@band"),
        trace("line", line={"color": "@c4", "width": 1.5, "dash": "dot"}),
        trace("marks", mode="markers", marker=marker),
    ]
    (row,) = legend_items(Chart("x", "x", traces), 2000, FONT)
    bar, band, line, marks = [each for each in row if not isinstance(each, Words)]
    words = [each for each in row if isinstance(each, Words)]
    for area, colour, name in ((bar, "c2", words[0]), (band, "band", words[1])):
        assert isinstance(area, Area)
        assert area.colour == colour
        low, high = area.points.min(axis=0), area.points.max(axis=0)
        assert high - low == pytest.approx([2.3 * FONT, 0.7 * FONT])  # as high as a capital
        assert abs(polygon_area(area.points)) == pytest.approx(np.prod(high - low))
        assert (high[1], name.x - high[0]) == pytest.approx((name.y, 0.5 * FONT))
    assert isinstance(line, Line)
    assert (line.colour, line.width, line.dash) == (
        "c4",
        pytest.approx(1.5 * FONT / 13),
        pytest.approx(3 * FONT / 13),
    )
    assert line.points[:, 1] == pytest.approx([words[2].y - 0.35 * FONT] * 2)
    assert words[2].x - line.points[1, 0] == pytest.approx(0.5 * FONT)
    assert isinstance(marks, Marks)
    assert (marks.colour, marks.symbol, marks.size) == ("suspect", "diamond", 0.6 * FONT)
    assert marks.points == pytest.approx(
        np.array([(words[3].x - (0.5 + 1.15) * FONT, words[3].y - 0.35 * FONT)])
    )


def polygon_area(points):
    """By the shoelace formula; 0 for corners in the order of a bow tie."""
    x, y = points.T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


def layout(x, y):
    return {
        "showlegend": False,
        "xaxis": {"range": list(x), "title": {"text": "x"}},
        "yaxis": {"range": list(y), "title": {"text": "y"}},
    }


def drawn(traces, x=(0, 10), y=(-1, 1), font=26.0):
    """The traces in a frame, without axes: the frame's size, and the items."""
    laid = lay_out(Chart("x", "what", traces, layout(x, y)), 1000, 600, font)
    lines = len(list(axis_items(Axes.of(layout(x, y)), *laid.frame[2:], font)))
    return laid.frame[2:], laid.inside[lines:]


def test_a_line_has_gaps_where_values_are_missing_and_grows_with_the_font():
    line = trace("a", x=[0, 5, 7, 10], y=[-1, 0, None, 1], line={"color": "@c1", "width": 2, "dash": "dash"})
    (width, height), (first, last) = drawn([line])
    assert first.points == pytest.approx(np.array([(0, height), (width / 2, height / 2)]))
    assert last.points == pytest.approx(np.array([(width, 0)]))
    assert (first.colour, first.width, first.dash) == ("c1", 4.0, 16.0)


def test_the_second_axis_reaches_from_nothing_to_one():
    mark = {"color": "@error", "size": 8, "symbol": "x-thin"}
    (width, height), (marks,) = drawn(
        [trace("a", x=[5, None], y=[0.25, None], yaxis="y2", mode="markers", marker=mark)]
    )
    assert marks.points == pytest.approx(np.array([(width / 2, 0.75 * height)]))
    assert (marks.colour, marks.symbol, marks.size) == ("error", "cross", 16.0)


def test_what_lies_far_off_is_drawn_fifty_heights_away():
    (_, height), (line,) = drawn([trace("a", x=[1, 2], y=[1e9, -1e9])])
    assert line.points[:, 1] == pytest.approx([-50 * height, 50 * height])


def test_a_band_without_a_pen_is_an_area_alone_and_one_with_a_pen_has_an_edge():
    corners = {"x": [0, 10, 10, 0], "y": [1, 1, -1, -1]}
    for pen, kinds in ((0, [Area]), (1, [Area, Line])):
        line = {"color": "@band", "width": pen}
        (width, height), items = drawn([trace("a", **corners, fill="toself", fillcolor="@band", line=line)])
        assert [type(each) for each in items] == kinds
        assert items[0].points == pytest.approx(np.array([(0, 0), (width, 0), (width, height), (0, height)]))


def test_bars_of_error_reach_as_far_as_the_interval_and_lie_below_their_marks():
    bar = {"array": [0.5, 0.25], "color": "@suspect", "thickness": 1}
    marks = trace(
        "a", x=[2, 4], y=[0, 0.5], mode="markers", marker={"color": "@suspect", "size": 8}, error_y=bar
    )
    (width, height), (one, other, points) = drawn([marks])
    assert one.points == pytest.approx(np.array([(0.2 * width, 0.25 * height), (0.2 * width, 0.75 * height)]))
    assert other.points == pytest.approx(
        np.array([(0.4 * width, 0.125 * height), (0.4 * width, 0.375 * height)])
    )
    assert (one.width, one.colour, points.symbol) == (2.0, "suspect", "circle")


def test_bars_stand_on_each_other_a_pixel_apart_and_none_is_drawn_for_nothing():
    bars = [
        {"type": "bar", "name": name, "x": [2, 4, 6], "y": y, "width": 2, "marker": {"color": colour}}
        for name, y, colour in (("ok", [1, 0, 3], "@c1"), ("suspect", [2, 1, 0], "@suspect"))
    ]
    (width, height), items = drawn(bars, x=(2, 12), y=(0, 4))
    boxes = [(each.colour, *each.points.min(axis=0), *each.points.max(axis=0)) for each in items]

    def box(colour, first, last, foot, top):
        return (
            colour,
            first * width / 10 + 0.5,
            height * (1 - top / 4),
            last * width / 10 - 0.5,
            height * (1 - foot / 4),
        )

    expected = [
        box("c1", 0, 2, 0, 1),
        box("c1", 4, 6, 0, 3),
        box("suspect", 0, 2, 1, 3),
        box("suspect", 2, 4, 0, 1),
    ]
    assert [each[0] for each in boxes] == [each[0] for each in expected]
    for found, each in zip(boxes, expected, strict=True):
        assert found[1:] == pytest.approx(each[1:])
        corners, (_, left, top, right, bottom) = items[boxes.index(found)].points, found
        assert abs(polygon_area(corners)) == pytest.approx((right - left) * (bottom - top))


def test_a_picture_has_the_size_asked_for_and_the_words_of_its_chart():
    laid = lay_out(Chart("x", "what", [trace("a", x=[1], y=[0])], layout((0, 1), (0, 1))), 900, 500, 15.0)
    assert lay_out(Chart("x", "what", [], layout((0, 1), (0, 1))), 900, 500).font == 13
    assert (laid.label, laid.width, laid.height, laid.font) == ("what", 900, 500, 15.0)
    left, top, width, height = laid.frame
    axes = Axes.of(layout((0, 1), (0, 1)))
    assert (left, top, 900 - left - width, 500 - top - height) == margins(axes, 500, 15.0, rows=0)
