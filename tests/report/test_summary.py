"""What a report says in words and numbers, by hand."""

import html
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from rollcli.report import content
from rollcli.report.chart import Chart, chart_names, script_json
from rollcli.report.charts import _bins, chart_over_frames, histogram, label, outside, view
from rollcli.report.options import ReportOptions
from rollcli.report.pictures import Picture, Pictures, _encoded, no_pictures
from rollcli.report.sources import SPREAD, SUSPECT, WIDEST, Choice
from rollcli.report.summary import degrees, frame_count, input_folders, option_lines, summarize, written_at
from rollcli.rig.quantities import HEIGHT, PITCH, QUANTITIES
from tests.report.results import row


def test_the_middle_is_from_the_5th_to_the_95th_percentile():
    found = summarize([row(f"{i}.png", float(i), None) for i in range(101)])
    assert (found.middle, found.extremes) == ((5, 95), (0, 100))
    assert found.half_width is None
    nothing = summarize([row("a.png", None)])
    assert (nothing.middle, nothing.extremes, nothing.frames) == (None, None, 1)


def test_counts_have_commas_and_one_frame_is_one():
    assert [frame_count(count) for count in (0, 1, 2, 12_345)] == [
        "0 frames",
        "1 frame",
        "2 frames",
        "12,345 frames",
    ]


def test_an_angle_without_a_sign_has_none():
    assert [degrees(angle, 1, sign=False) for angle in (-1.26, 0.0, 3.0)] == ["1.3°", "0.0°", "3.0°"]
    assert degrees(-0.04, 1) == "0.0°"
    assert degrees(0.06, 1) == "+0.1°"


def test_folders_are_listed_once_in_their_order_with_those_of_right_images():
    rows = [replace(row("b/1.png"), right_file="r/1.png"), row("a/x/1.png"), row("b/2.png"), row("3.png")]
    assert input_folders(rows) == ["b", "r", "a/x", "."]


def test_the_time_of_a_file_is_told_in_utc_and_that_of_a_stream_is_not(tmp_path):
    (tmp_path / "rolls.csv").touch()
    os.utime(tmp_path / "rolls.csv", (86_400 * 365 + 3_720, 86_400 * 365 + 3_720))
    assert written_at(str(tmp_path / "rolls.csv")) == "1971-01-01 01:02 UTC"
    assert written_at("-") == written_at("s3://maps/rolls.csv") == written_at("a\0b") == ""


def test_options_are_shown_but_those_that_were_not_given():
    options = {"a": None, "b": False, "c": [], "d": 0, "e": True, "f": [0.5, 2.0], "g": "x"}
    assert option_lines({"options": options}) == [
        ("--d", "0"),
        ("--e", "True"),
        ("--f", "0.5,2"),
        ("--g", "x"),
    ]
    assert option_lines({"options": {"invalid": [7.0]}}) == [("--invalid", "7")]
    assert option_lines({}) == []


def test_a_chart_of_its_own_is_beside_the_others_of_its_folder():
    options = ReportOptions(("rolls.csv",), png="slides/", svg="s3://maps/svg")
    assert options.chart_paths("roll") == {"svg": "s3://maps/svg/roll.svg", "png": "slides/roll.png"}
    assert ReportOptions(("rolls.csv",)).chart_paths("roll") == {}
    assert (ReportOptions(("rolls.csv",)).gallery, options.output) == (12, None)


def test_the_axis_reaches_a_little_beyond_the_values():
    rows = [row("a.png", 1.0, None), row("b.png", 3.0, None)]
    assert view(rows) == pytest.approx((1 - 0.17, 3 + 0.17))  # 6 % of two degrees and 0.05
    suspect = row("c.png", 4.19, 9.0, "suspect")  # 35 % of two degrees and half a degree away
    assert view([*rows, suspect]) == pytest.approx((1 - 0.2414, 4.19 + 0.2414), abs=5e-4)
    beyond = [*rows, replace(suspect, roll_deg=4.21), replace(suspect, roll_deg=-0.21)]
    assert (view(beyond), outside(beyond), outside(rows)) == (view(rows), 2, 0)
    below = [*rows, replace(suspect, roll_deg=-0.19)]
    assert view(below) == pytest.approx((-0.19 - 0.2414, 3 + 0.2414), abs=5e-4)


def test_the_axis_holds_intervals_of_up_to_a_degree():
    rows = [row("a.png", 1.0, 0.5), row("b.png", 3.0, 5.0)]
    assert view(rows) == pytest.approx((0.5 - 0.26, 4.0 + 0.26))  # 6 % of 3.5 degrees and 0.05
    assert view([row("a.png", None)]) == (-1, 1)
    doubted = [row("a.png", 1.0, None, "suspect"), row("b.png", 3.0, None, "suspect")]
    assert view(doubted) == pytest.approx((0.83, 3.17))


def test_a_tenth_of_a_metre_is_worth_a_degree():
    rows = [replace(row(f"{height}.png"), height_m=height) for height in (1.5, 1.7)]
    assert view(rows, HEIGHT) == pytest.approx((1.5 - 0.017, 1.7 + 0.017))
    assert view([row("a.png")], HEIGHT) == pytest.approx((-0.1, 0.1))
    near = replace(row("c.png", status="suspect"), height_m=1.819)  # 35 % of 0.2 m and 5 cm away
    assert view([*rows, near], HEIGHT) == pytest.approx((1.5 - 0.0241, 1.819 + 0.0241), abs=5e-4)
    assert view([*rows, replace(near, height_m=1.821)], HEIGHT) == view(rows, HEIGHT)


def test_bars_count_the_rolls_between_round_numbers():
    rows = [row(f"{roll}.png", roll, None) for roll in (0.0, 0.1, 0.1)]
    chart = histogram([*rows, row("s.png", 0.25, None, "suspect"), row("e.png", None)])
    ok, suspect = chart.data
    assert ok["x"] == suspect["x"] == pytest.approx([0, 0.05, 0.1, 0.15, 0.2, 0.25])  # five bars at least
    assert (ok["y"], suspect["y"]) == ([1, 0, 2, 0, 0, 0], [0, 0, 0, 0, 0, 1])
    assert (ok["width"], ok["name"], suspect["name"]) == (pytest.approx(0.05), "ok", "suspect")
    assert ok["customdata"][:2] == ["0.000° to +0.050°", "+0.050° to +0.100°"]
    assert chart.layout["xaxis"]["range"] == pytest.approx([-0.006, 0.306])  # 2 % of the bars
    assert chart.layout["yaxis"] == {"title": {"text": "frames"}, "range": [0, 2.1], "dtick": 1}
    assert (chart.layout["showlegend"], histogram(rows).layout["showlegend"]) == (True, False)


def test_there_are_two_bars_for_the_root_of_the_frames_from_5_to_40():
    assert [_bins(frames) for frames in (1, 6, 7, 100, 399, 400, 10_000)] == [5, 5, 6, 20, 40, 40, 40]


def test_ticks_are_at_whole_frames_where_bars_are_low():
    for count, ticks in ((6, True), (7, False)):
        axis = histogram([row(f"{i}.png", 1.0, None) for i in range(count)]).layout["yaxis"]
        assert (axis["range"][1], "dtick" in axis) == (pytest.approx(1.05 * count), ticks)
    alone = histogram([row("a.png", 1.0, None)])
    assert alone.layout["xaxis"]["range"] == pytest.approx([1 - 0.025, 1.01 + 0.025])  # six bars wide
    assert alone.layout["yaxis"]["range"] == pytest.approx([0, 1.05])
    nothing = histogram([row("a.png", None), row("b.png", None)])
    assert (nothing.data, nothing.layout["yaxis"]["range"]) == ([], [0, 1.05])


@pytest.mark.parametrize(
    ("frames", "margin", "dtick"), [(1, 0.5, 1), (10, 0.5, 1), (11, 0.5, None), (200, 2, None)]
)
def test_the_axis_of_the_frames_reaches_half_a_frame_or_a_hundredth_beyond_them(frames, margin, dtick):
    chart = chart_over_frames([row(f"{i}.png") for i in range(frames)])
    axis = chart.layout["xaxis"]
    assert (axis["range"], axis.get("dtick")) == ([1 - margin, frames + margin], dtick)
    assert chart.label == f"Roll in degrees over {frames} frames; 0 suspect and 0 failed are marked"


def test_axes_are_named_with_their_unit_and_zero_is_marked_for_the_roll_alone():
    rows = [
        replace(row("a.png"), pitch_deg=1.0, height_m=1.5),
        row("b.png", None),
        row("c.png", status="suspect"),
    ]
    axes = [chart_over_frames(rows, each).layout["yaxis"] for each in QUANTITIES]
    assert [each["title"]["text"] for each in axes] == ["roll, degrees", "pitch, degrees", "height, m"]
    assert [each["zeroline"] for each in axes] == [True, False, False]
    assert [tuple(each["range"]) for each in axes] == [view(rows, each) for each in QUANTITIES]
    failed = {each["name"]: each for each in chart_over_frames(rows, PITCH).data}["failed"]
    assert (failed["x"], failed["y"]) == ([2], [0.035])
    label_of_all = chart_over_frames(rows).label
    assert label_of_all == "Roll in degrees over 3 frames; 1 suspect and 1 failed are marked"


@pytest.mark.parametrize(("frames", "size"), [(400, 8), (401, 5)])
def test_marks_are_smaller_where_there_are_many(frames, size):
    traces = {each["name"]: each for each in chart_over_frames([row(f"{i}.png") for i in range(frames)]).data}
    assert traces["roll"]["marker"]["size"] == size


def test_a_histogram_is_of_two_angles_or_more():
    assert chart_names([row("a.png"), row("b.png")]) == ["roll", "histogram"]
    assert chart_names([row("a.png"), row("b.png", None)]) == ["roll"]
    posed = replace(row("a.png", None), pitch_deg=0.0, height_m=1.5)
    assert chart_names([row("b.png", None), posed]) == ["roll", "pitch", "height"]
    pairs = [replace(row(f"{name}.png", None), right_lower_px=0.1) for name in "ab"]
    assert chart_names(pairs) == ["roll", "alignment"]
    assert chart_names(pairs[:1]) == ["roll"]


def test_a_label_is_cut_to_44_characters_a_line_and_five_lines():
    assert label(row("x" * 44 + ".png"), "").split("<br>")[0] == "…" + "x" * 39 + ".png"
    assert label(row("x" * 40 + ".png"), "") == "x" * 40 + ".png"
    lines = label(row("a.png", None, message="word " * 99), "").split("<br>")
    assert lines[:2] == ["a.png", "failed"]
    assert len(lines) == 2 + 5
    assert lines[-1].endswith(" …")
    assert label(row("a.png", message="of no matter"), "+1°") == "a.png<br>+1°"


@pytest.mark.parametrize(
    ("chosen", "angled", "words"),
    [
        ([], 5, "Every frame that has an angle."),
        ([SPREAD] * 5, 5, "Every frame that has an angle."),
        ([SPREAD] * 2, 5, "2 of 5 frames that have an angle: 2 evenly spread."),
        (
            [SUSPECT, SPREAD],
            5,
            "2 of 5 frames that have an angle: 1 of the suspect ones and 1 evenly spread over the rest.",
        ),
        (
            [WIDEST, WIDEST, SUSPECT, SPREAD],
            1000,
            "4 of 1,000 frames that have an angle: the 2 with the widest interval, 1 of the other suspect "
            "ones and 1 evenly spread over the rest.",
        ),
        ([WIDEST], 2, "1 of 2 frames that have an angle: the 1 with the widest interval."),
    ],
)
def test_which_frames_are_shown_is_said_in_words(chosen, angled, words):
    rows = [row(f"{i}.png", 1.0 if i < angled else None) for i in range(angled + 3)]
    assert content._chosen_text(rows, [Choice(place, reason) for place, reason in enumerate(chosen)]) == words


def test_the_table_has_a_line_for_each_frame():
    rows = [
        row("a\udcff.png", 1.23456789, 0.05),
        row("b.png", None, message="is empty"),
        row("c.png", -2.0, None, "suspect", "wide"),
    ]
    assert content._table(rows).rows == [
        (1, "a?.png", "ok", 1.234568, "+1.23° ± 0.05°", ""),
        (2, "b.png", "failed", None, "–", "is empty"),
        (3, "c.png", "suspect", -2.0, "−2.00°", "wide"),
    ]


def test_a_card_shows_the_map_first_and_names_its_pictures():
    shown = Picture(b"x", 4, 3)
    rows = [row("a.png"), row("b.png", -2.345, 0.004)]
    card = content._card(rows, Choice(1, WIDEST), Pictures(map=shown, level=shown))
    assert (card["number"], card["row"], card["roll"], card["reason"]) == (2, rows[1], "−2.345°", WIDEST)
    assert (card["show"], card["empty"], card["missing"]) == ("before", False, "")
    left, right = card["columns"]
    assert [(side, caption) for side, _, caption, _, _ in left] == [
        ("", "road on the left image"),
        ("before", "map"),
        ("after", "map de-rotated by −2.345°"),
        ("heights", "heights over the road"),
    ]
    assert [side for side, *_ in right] == ["before", "after heights"]
    gone = content._card(rows, Choice(0, SPREAD), no_pictures(None, "its worker died"))
    assert (gone["show"], gone["empty"], gone["missing"]) == ("after", True, "its worker died")


@pytest.mark.parametrize("kind", ["road", "map", "level", "level_counts"])
def test_a_frame_with_any_picture_is_not_empty(kind):
    assert not Pictures(**{kind: Picture(b"x", 4, 3)}).empty


@pytest.mark.parametrize(
    ("shape", "size"),
    [((30, 40), (40, 30)), ((100, 1280), (1280, 100)), ((500, 2560), (1280, 250)), ((1, 6000), (1280, 1))],
)
def test_a_picture_is_at_most_1280_pixels_wide(shape, size):
    made = _encoded(np.zeros((*shape, 3), np.uint8))
    assert (made.width, made.height) == size
    assert made.uri.startswith("data:image/webp;base64,UklGR")


def test_json_in_a_script_cannot_end_it():
    value = {"a": "</script><!--&\u2028\u2029"}
    text = script_json(value)
    assert not set(text) & set("<>&\u2028\u2029")
    assert json.loads(text) == value
    with pytest.raises(ValueError, match="not JSON compliant"):
        script_json([float("nan")])
    page = Chart('"a"', "<b>", [], still="<svg/>").__html__()
    assert page.startswith(
        '<div class="chart" id="&quot;a&quot;" role="img" aria-label="&lt;b&gt;"><svg/></div>'
    )
    assert html.unescape(page).endswith('data-chart=""a"">{"data": [], "layout": {}}</script>')
